"""The long table of a report: every observer, phase by phase. Standard library only."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

from cosim.evaluation.numbers import DASH, error_number
from cosim.evaluation.phase_details import PhaseDetails
from cosim.evaluation.roles import label
from cosim.evaluation.spec import ReportSpec
from cosim.report.page.parts import grouped_table, paragraph

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
TEXT = (
    "Root mean squares of estimate minus true value. Before and after: in the last row before, and the first row "
    "after, "
    "each telegram that the observer used."
)


def phases_html(details: Sequence[PhaseDetails], spec: ReportSpec) -> list[str]:
    """Text and table; nothing where no column holds a number.

    Args:
        details: from `phase_details`. spec: labels.
    """
    shown = [field for field in COLUMNS if any(getattr(d, field) is not None for d in details)]
    if not shown:
        return []
    headings = ["Observer", "Phase", *(COLUMNS[field][0] for field in shown)]
    groups = [(label(spec, observer), list(group)) for observer, group in groupby(details, key=lambda d: d.observer)]
    rows = [(name, [[d.phase, *(_cell(d, field) for field in shown)] for d in group]) for name, group in groups]
    return [paragraph(TEXT), grouped_table(headings, rows)]


def _cell(entry: PhaseDetails, field: str) -> str:
    value = getattr(entry, field)
    if value is None:
        return DASH
    return str(value) if field == "telegrams" else error_number(COLUMNS[field][1] * value)
