"""The long table of every observer, phase by phase: slip, forces, errors around telegrams. Standard library only."""

from __future__ import annotations

from collections.abc import Sequence

from cosim.evaluation.error_table import NAMES
from cosim.evaluation.phase_details import PhaseDetails
from cosim.evaluation.roles import label
from cosim.evaluation.spec import ReportSpec
from fmus.tables.table import Column, Table, error_column

_BEFORE = "In the last row before each telegram that the observer used"
_AFTER = "In the first row after each telegram that the observer used"
COLUMNS = (
    error_column("slip", "Slip error, rms", "1"),
    error_column("adhesion_force", "Adhesion force error, rms", "N"),
    error_column("coupler_force", "Coupler force error, rms", "N", "Of the first coupler"),
    error_column("speed_before", "Speed error before telegrams, rms", "m/s", _BEFORE),
    error_column("speed_after", "and after them", "m/s", _AFTER),
    error_column("position_before", "Position error before telegrams, rms", "m", _BEFORE),
    error_column("position_after", "and after them", "m", _AFTER),
    error_column("indicator_on", "Slip indicated", "% of the time", factor=100.0),
    Column("telegrams", "Telegrams used"),
)


def phases_table(details: Sequence[PhaseDetails], spec: ReportSpec) -> Table:
    """Root mean squares and counts of every observer in every phase; without rows where there is no number.

    Args:
        details: from `phase_details`. spec: labels.
    """
    rows = [[label(spec, d.observer), d.phase, *(getattr(d, column.key) for column in COLUMNS)] for d in details]
    return Table("phases", [*NAMES, *COLUMNS], rows).filled()
