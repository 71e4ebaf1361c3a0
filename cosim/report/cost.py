"""What the components were called for, what that took, and what they logged: as text and as HTML. Standard library
only.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from cosim.evaluation.facts import list_entry, number_entry
from cosim.evaluation.numbers import DASH, number
from cosim.report.page.parts import paragraph, simple_table
from cosim.results.result import Result
from fmus.text_table import text_table

KINDS = {
    "doStep": ("doStep",),
    "get": ("get",),
    "set": ("set",),
    "events": ("event",),
    "states": ("save", "restore", "release"),
}
"""Columns, and the kinds of calls in each."""
NOT_TIMED_IN_C = ("get", "set")
"""Columns that the compiled stepper counts and does not time."""
MESSAGES_SHOWN = 100


def cost_rows(result: Result) -> list[list[str]]:
    """One row for each component: name, then calls and milliseconds of each column of `KINDS`, then messages logged."""
    entries = [entry for entry in list_entry(result, "components") if isinstance(entry, Mapping) and "cost" in entry]
    return [_row(entry, _compiled(result)) for entry in entries]


def cost_text(result: Result) -> str:
    """The same as a table for a terminal; empty where the result does not say; ends without a line break."""
    rows = cost_rows(result)
    if not rows:
        return ""
    return "\n".join(text_table([["calls / ms", *KINDS, "messages"], *rows], heading=True))


def cost_html(result: Result) -> list[str]:
    """The same for the report."""
    rows = cost_rows(result)
    if not rows:
        return []
    timed = "in C none" if _compiled(result) else "one call in 64"
    text = f"Calls and the milliseconds they took. Of reading (get) and writing (set) {timed} was timed."
    return [paragraph(text), simple_table(["Component", *KINDS, "Messages"], rows, range(1, len(KINDS) + 2))]


def messages_html(result: Result) -> list[str]:
    """What the components logged: the first and last messages."""
    messages = list(result.messages)
    if not messages:
        return []
    half = MESSAGES_SHOWN // 2
    shown = messages if len(messages) <= MESSAGES_SHOWN else [*messages[:half], *messages[-half:]]
    cut = len(shown) < len(messages)
    note = f"The first and last of {len(messages)} messages; messages.csv holds them." if cut else ""
    rows = [[m.component, number(m.time), m.status, m.category or DASH, m.text] for m in shown]
    return [paragraph(note), simple_table(["Component", "Time [s]", "Status", "Category", "Text"], rows, (1,))]


def _compiled(result: Result) -> bool:
    master = result.summary.get("master")
    stepper = master.get("stepper") if isinstance(master, Mapping) else None
    return isinstance(stepper, Mapping) and bool(stepper.get("steps_compiled"))


def _row(entry: Mapping[str, Any], compiled: bool) -> list[str]:
    cost = entry["cost"] if isinstance(entry["cost"], Mapping) else {}
    counts = entry.get("message_counts")
    messages = sum(counts.values()) if isinstance(counts, Mapping) else 0
    cells = [_cell(cost, kinds, not (compiled and column in NOT_TIMED_IN_C)) for column, kinds in KINDS.items()]
    return [str(entry.get("name")), *cells, str(messages)]


def _cell(cost: Mapping[str, Any], kinds: Sequence[str], timed: bool) -> str:
    found = [cost[kind] for kind in kinds if isinstance(cost.get(kind), Mapping)]
    calls = sum(int(number_entry(entry, "calls") or 0) for entry in found)
    seconds = sum(number_entry(entry, "seconds") or 0.0 for entry in found)
    return f"{calls} / {f'{1000 * seconds:.3g}' if timed and seconds else DASH}" if calls else DASH
