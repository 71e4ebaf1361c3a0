"""Errors of several runs, phase by phase, with the difference to the first run. Standard library only."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import isfinite, isnan
from typing import Any

from cosim.evaluation.error_table import sizes
from cosim.evaluation.metrics import PhaseMetrics, phase_metrics
from cosim.evaluation.phase_details import phase_details
from cosim.evaluation.roles import label, phases
from cosim.report.overlay.overlaid_runs import OverlayRun, observers_of, one_each
from cosim.report.page.phases import COLUMNS
from fmus.tables.numbers import number
from fmus.tables.table import Column, Table, name_column

Values = tuple[float | None, ...]


@dataclass(frozen=True, slots=True)
class Measured:
    """Numbers of one observer in one phase, run by run.

    Args:
        observer: text to show. phase: name. values: by label of the run, a number or None for each heading.
    """

    observer: str
    phase: str
    values: dict[str, Values]


def measured(runs: Sequence[OverlayRun]) -> list[Measured]:
    """Maximal and rms errors of speed and position, in the columns of `error_table.MEASURED`.

    Args:
        runs: from `make_runs`.
    """
    return _by_phase(runs, lambda run: {(m.observer, m.phase): _sizes(m) for m in phase_metrics(run.result, run.spec)})


def detailed(runs: Sequence[OverlayRun]) -> list[Measured]:
    """The numbers of `phase_details`, in the columns of `phases.COLUMNS`.

    Args:
        runs: from `make_runs`.
    """

    def of(run: OverlayRun) -> dict[tuple[str, str], Values]:
        return {
            (d.observer, d.phase): tuple(getattr(d, column.key) for column in COLUMNS)
            for d in phase_details(run.result, run.spec)
        }

    return _by_phase(runs, of)


def numbers_table(runs: Sequence[OverlayRun], rows: Sequence[Measured], columns: Sequence[Column]) -> Table:
    """A row for each observer, phase and run, with the difference to the first run below each number.

    Args:
        runs: from `make_runs`. rows: from `measured` or `detailed`. columns: of their values.
    """
    reference = runs[0].label
    found: list[list[Any]] = []
    for row in rows:
        first = row.values.get(reference)
        for name, values in row.values.items():
            compared: Values = (None,) * len(values) if first is None or name == reference else first
            pairs = [None if v is None else (v, other) for v, other in zip(values, compared, strict=True)]
            found.append([f"{row.observer}, {row.phase}", name, *pairs])
    names = [name_column("observer and phase", "Observer and phase"), name_column("run", "Run")]
    return Table("errors", [*names, *map(_compared, columns)], found).filled()


def _compared(column: Column) -> Column:
    """The column of a number and that of the first run, of which the difference is shown, absolute and in percent."""

    def written(pair: tuple[float, float | None] | None) -> str:
        value, first = pair or (None, None)
        if value is None or first is None:
            return column.cell(value)
        scaled = [v if isinstance(v, int) else column.factor * v for v in (value, first)]  # counts are not scaled
        return f"{column.cell(value)}\n{difference(*scaled)}"

    return replace(column, write=written)


def difference(value: float, first: float) -> str:
    """How far a number is from that of the first run.

    Args:
        value: of a run.
        first: of the first run.
    """
    if value == first:
        return "same"
    if not (isfinite(value) and isfinite(first)):
        return "diverged" if isfinite(first) else "did not diverge" if isfinite(value) else "same"
    change = value - first
    size = str(abs(change)) if isinstance(change, int) else number(abs(change), 2)
    sign = "+" if change > 0 else "−"
    return f"{sign}{size} ({sign}{number(100 * abs(change / first))} %)" if first else f"{sign}{size}"


def _sizes(m: PhaseMetrics) -> Values:
    return tuple(None if size is None or isnan(size) else size for size in sizes(m))


def _by_phase(runs: Sequence[OverlayRun], of: Callable[[OverlayRun], dict[tuple[str, str], Values]]) -> list[Measured]:
    """Rows by observer and phase; the single observers of runs that have one each stand together."""
    known = {run.label: of(run) for run in runs}
    names = [p.name for p in phases(runs[0].result, runs[0].spec)]
    if one_each(runs):
        own = {run.label: run.spec.observers[0] for run in runs}
        texts = list(dict.fromkeys(label(run.spec, own[run.label]) for run in runs))
        return [
            Measured(" / ".join(texts), p, {r: v[own[r], p] for r, v in known.items() if (own[r], p) in v})
            for p in names
        ]
    texts_of = {o: next(label(run.spec, o) for run in runs if o in run.spec.observers) for o in observers_of(runs)}
    rows = [
        Measured(text, p, {r: v[o, p] for r, v in known.items() if (o, p) in v})
        for o, text in texts_of.items()
        for p in names
    ]
    return [row for row in rows if row.values]
