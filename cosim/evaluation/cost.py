"""What the components were called for, what that took, and how much they logged. Standard library only."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from cosim.evaluation.summary_entries import list_entry, number_entry
from cosim.results.result import Result
from fmus.tables.numbers import DASH
from fmus.text_table import text_table

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


def cost_rows(result: Result) -> list[list[str]]:
    """One row for each component: name, then calls and milliseconds of each column of `KINDS`, then messages logged.

    Args:
        result: the run.
    """
    entries = [entry for entry in list_entry(result, "components") if isinstance(entry, Mapping) and "cost" in entry]
    return [_row(entry, was_compiled(result)) for entry in entries]


def cost_text(result: Result) -> str:
    """The same as a table for a terminal; empty where the result does not say; ends without a line break.

    Args:
        result: the run.
    """
    rows = cost_rows(result)
    if not rows:
        return ""
    return "\n".join(text_table([["calls / estimated ms", *KINDS, "messages"], *rows], heading=True))


def was_compiled(result: Result) -> bool:
    """Whether the compiled stepper took steps of a run.

    Args:
        result: the run.
    """
    master = result.summary.get("master")
    stepper = master.get("stepper") if isinstance(master, Mapping) else None
    return isinstance(stepper, Mapping) and bool(stepper.get("steps_compiled"))


def _row(entry: Mapping[str, Any], compiled: bool) -> list[str]:
    cost = entry["cost"] if isinstance(entry["cost"], Mapping) else {}
    counts = entry.get("message_counts")
    messages = sum(counts.values()) if isinstance(counts, Mapping) else 0
    cells = [_cell(cost, kinds, not (compiled and column in _NOT_TIMED_IN_C)) for column, kinds in KINDS.items()]
    return [str(entry.get("name")), *cells, str(messages)]


def _cell(cost: Mapping[str, Any], kinds: Sequence[str], timed: bool) -> str:
    found = [cost[kind] for kind in kinds if isinstance(cost.get(kind), Mapping)]
    calls = sum(int(number_entry(entry, "calls") or 0) for entry in found)
    seconds = sum(number_entry(entry, "seconds") or 0.0 for entry in found)
    return f"{calls} / {f'{1000 * seconds:.3g}' if timed and seconds else DASH}" if calls else DASH
