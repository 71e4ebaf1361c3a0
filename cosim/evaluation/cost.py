"""What the components were called for, what that took, and how much they logged. Standard library only."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from cosim.evaluation.summary_entries import list_entry, number_entry
from cosim.results.result import Result
from fmus.tables.numbers import DASH
from fmus.tables.table import Column, Table, name_column

KINDS = {
    "doStep": ("doStep",),
    "get": ("get",),
    "set": ("set",),
    "events": ("event",),
    "states": ("save", "restore", "release"),
}
"""Columns, and the kinds of calls in each."""
_NOT_TIMED_IN_C = ("get", "set")
"""Columns that the compiled stepper counts and does not time."""


def cost_table(result: Result) -> Table:
    """Calls of each component and the time they took, and the messages it logged.

    Args:
        result: the run.
    """
    entries = [entry for entry in list_entry(result, "components") if isinstance(entry, Mapping) and "cost" in entry]
    columns = [name_column("component", "Component", short="calls / estimated ms")]
    columns += [
        Column(column, column, meaning=f"Calls ({', '.join(kinds)}) and the milliseconds they took", write=_written)
        for column, kinds in KINDS.items()
    ]
    messages = Column("messages", "Messages", meaning="How many messages it logged", short="messages")
    return Table("calls", [*columns, messages], [_row(entry, was_compiled(result)) for entry in entries])


def was_compiled(result: Result) -> bool:
    """Whether the compiled stepper took steps of a run.

    Args:
        result: the run.
    """
    master = result.summary.get("master")
    stepper = master.get("stepper") if isinstance(master, Mapping) else None
    return isinstance(stepper, Mapping) and bool(stepper.get("steps_compiled"))


def _row(entry: Mapping[str, Any], compiled: bool) -> list[Any]:
    cost = entry["cost"] if isinstance(entry["cost"], Mapping) else {}
    counts = entry.get("message_counts")
    messages = sum(counts.values()) if isinstance(counts, Mapping) else 0
    timed = [not (compiled and column in _NOT_TIMED_IN_C) for column in KINDS]
    return [str(entry.get("name")), *map(_spent, [cost] * len(KINDS), KINDS.values(), timed), messages]


def _spent(cost: Mapping[str, Any], kinds: Sequence[str], timed: bool) -> dict[str, Any]:
    """Number of the calls, and their time [s], None where it was not taken."""
    found = [cost[kind] for kind in kinds if isinstance(cost.get(kind), Mapping)]
    calls = sum(int(number_entry(entry, "calls") or 0) for entry in found)
    seconds = sum(number_entry(entry, "seconds") or 0.0 for entry in found)
    return {"calls": calls, "seconds": seconds if timed and seconds else None}


def _written(spent: Mapping[str, Any]) -> str:
    if not spent["calls"]:
        return DASH
    milliseconds = DASH if spent["seconds"] is None else f"{1000 * spent['seconds']:.3g}"
    return f"{spent['calls']} / {milliseconds}"
