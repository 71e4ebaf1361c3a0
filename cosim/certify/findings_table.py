"""Findings as a table: what, value, whether it holds, kind and source; statements and long sources stand below it."""

from __future__ import annotations

from collections.abc import Sequence
from math import isinf, isnan

from cosim.certify.demands import Certified
from fmu_observer.certificates.finding import Finding
from fmus.tables.numbers import number
from fmus.tables.table import Column, Table, name_column, text_column

_LONGEST_SOURCE = 32  # characters of a source beside the numbers; longer ones stand below
_HOLDS = {True: "yes", False: "NO", None: "-"}
_COLUMNS: tuple[Column, ...] = (
    name_column("observer", "observer"),
    name_column("what", "finding"),
    text_column("value", "value", "First value at which it is lost, or the size of an error"),
    text_column("demand", "demanded", "What it was held against"),
    text_column("holds", "holds", "Whether the demand, or the condition, holds"),
    text_column("kind", "kind", "As printed, sufficient, exact, simulated, or the end of a search that found no limit"),
    text_column("source", "source"),
)


def findings_table(observers: Sequence[Certified]) -> Table:
    """One row for each finding.

    Args:
        observers: with their findings.
    """
    rows: list[list[str | None]] = []
    notes: list[str] = []
    for one in observers:
        for found in one.findings:
            demand = None if found.demand is None else _with_unit(found.demand, found)
            verdict = _HOLDS[found.holds], found.kind, _source(found, notes)
            rows.append([one.observer, found.what, _value(found), demand, *verdict])
        notes += one.notes
    kept = slice(0 if len(observers) > 1 else 1, None)
    title = "" if len(observers) > 1 else f"Findings about {', '.join(one.observer for one in observers)}"
    return Table("findings", _COLUMNS[kept], [row[kept] for row in rows], title=title, notes=notes).filled()


def _value(found: Finding) -> str:
    if isnan(found.value):
        return "-"
    if isinf(found.value):
        return "no limit"
    over = "> " if found.kind == "not found up to" else ""
    return over + _with_unit(found.value, found)


def _with_unit(value: float, found: Finding) -> str:
    return f"{number(value)} {found.unit if found.unit != '1' else ''}".rstrip()


def _source(found: Finding, notes: list[str]) -> str:
    """The source, or the number of the note that has it; what is to be said in words goes to the notes too."""
    short = len(found.source) <= _LONGEST_SOURCE
    words = found.explanation or "; ".join(filter(None, [found.statement, "" if short else found.source]))
    if found.holds is not None and not found.explanation and found.conditions:
        words = found.explain()
    if not words:
        return found.source
    known = next((i for i, note in enumerate(notes) if note.partition(" ")[2] == words), None)
    if known is None:
        known = len(notes)
        notes.append(f"({known + 1}) {words}")
    return f"{found.source} ({known + 1})" if short and found.source else f"({known + 1})"
