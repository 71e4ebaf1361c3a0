"""The tables of every observer, phase by phase: errors, and the long one with all the rest. Standard library only."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

from cosim.evaluation.error_table import cells, columns
from cosim.evaluation.metrics import PhaseMetrics
from cosim.evaluation.phase_details import PhaseDetails
from cosim.evaluation.roles import label
from cosim.evaluation.spec import ReportSpec
from cosim.report.page.page_table import PageTable, grouped_table
from fmus.tables.numbers import DASH, error_number

COLUMNS: dict[str, tuple[str, float]] = {  # field: heading with unit, factor to that unit
    "slip": ("Slip error, rms [%]", 100.0),
    "adhesion_force": ("Adhesion force error, rms [kN]", 1e-3),
    "coupler_force": ("Coupler force error, rms [kN]", 1e-3),
    "speed_before": ("Speed error before telegrams, rms [m/s]", 1.0),
    "speed_after": ("and after them [m/s]", 1.0),
    "position_before": ("Position error before telegrams, rms [m]", 1.0),
    "position_after": ("and after them [m]", 1.0),
    "indicator_on": ("Slip indicated [% of the time]", 100.0),
    "telegrams": ("Telegrams used", 1.0),
}


def errors_table(metrics: Sequence[PhaseMetrics], spec: ReportSpec) -> PageTable:
    """Errors of speed and position of every observer in every phase, published numbers beside them.

    Args:
        metrics: from `phase_metrics`.
        spec: labels.

    Returns:
        The table; without rows where there are no metrics.
    """
    chosen = columns(metrics)
    groups = groupby(metrics, key=lambda m: m.observer)
    rows = ((label(spec, name), [[m.phase, *cells(m, chosen)] for m in group]) for name, group in groups)
    return grouped_table(["Observer", "Phase", *(c.text for c in chosen)], rows)


def phases_table(details: Sequence[PhaseDetails], spec: ReportSpec) -> PageTable | None:
    """Root mean squares and counts of every observer in every phase.

    Args:
        details: from `phase_details`.
        spec: labels.

    Returns:
        The table with the columns that hold a number somewhere; None without any.
    """
    shown = [field for field in COLUMNS if any(getattr(d, field) is not None for d in details)]
    if not shown:
        return None
    groups = groupby(details, key=lambda d: d.observer)
    rows = (
        (label(spec, name), [[d.phase, *(_cell(d, field) for field in shown)] for d in group]) for name, group in groups
    )
    return grouped_table(["Observer", "Phase", *(COLUMNS[field][0] for field in shown)], rows)


def _cell(entry: PhaseDetails, field: str) -> str:
    value = getattr(entry, field)
    if value is None:
        return DASH
    return str(value) if field == "telegrams" else error_number(COLUMNS[field][1] * value)
