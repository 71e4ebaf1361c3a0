"""Errors of several runs, phase by phase, with the difference to the first run. Standard library only."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import isfinite, isnan

from cosim.evaluation.error_table import MEASURED
from cosim.evaluation.metrics import PhaseMetrics, phase_metrics
from cosim.evaluation.phase_details import phase_details
from cosim.evaluation.roles import label, phases
from cosim.report.overlay.overlaid_runs import OverlayRun, observers_of, one_each
from cosim.report.page.phases import COLUMNS
from fmus.tables.numbers import DASH, error_number, number

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
    """Maximal and rms errors of speed and position, in the columns of `table.MEASURED`.

    Args:
        runs: from `make_runs`.
    """
    return _by_phase(runs, lambda run: {(m.observer, m.phase): _sizes(m) for m in phase_metrics(run.result, run.spec)})


def detailed(runs: Sequence[OverlayRun]) -> list[Measured]:
    """The numbers of `phase_details`, in the columns of `phases.COLUMNS` and their units.

    Args:
        runs: from `make_runs`.
    """

    def of(run: OverlayRun) -> dict[tuple[str, str], Values]:
        return {
            (d.observer, d.phase): tuple(_scaled(getattr(d, f), f) for f in COLUMNS)
            for d in phase_details(run.result, run.spec)
        }

    return _by_phase(runs, of)


def headings(rows: Sequence[Measured], names: Sequence[str]) -> tuple[list[str], list[int]]:
    """Headings of the columns that hold a number somewhere, and their indices.

    Args:
        rows: from `measured` or `detailed`.
        names: headings of all columns.
    """
    kept = [i for i in range(len(names)) if any(v[i] is not None for row in rows for v in row.values.values())]
    return [names[i] for i in kept], kept


ERROR_HEADINGS = tuple(column.text for column in MEASURED)
DETAIL_HEADINGS = tuple(heading for heading, _ in COLUMNS.values())


def cell(value: float | None, first: float | None) -> str:
    """A number, and below it the difference to the first run, absolute and in percent.

    Args:
        value: of a run; None without one.
        first: of the first run; None where nothing is to be compared.
    """
    if value is None:
        return DASH
    text = str(value) if isinstance(value, int) else error_number(value)  # counts and sizes
    return text if first is None else f"{text}\n{difference(value, first)}"


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
    sizes = (size for e in (m.speed, m.position) for size in ((e.max_abs, e.rms) if e else (None, None)))
    return tuple(None if size is None or isnan(size) else size for size in sizes)


def _scaled(value: float | None, field: str) -> float | None:
    return value if value is None or isinstance(value, int) else COLUMNS[field][1] * value


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
