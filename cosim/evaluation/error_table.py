"""The table of errors of the observers, phase by phase. Standard library only."""

from __future__ import annotations

from collections.abc import Sequence

from cosim.evaluation.metrics import PhaseMetrics
from cosim.evaluation.roles import label
from cosim.evaluation.spec import ReportSpec
from fmus.tables.table import Column, Table, error_column, name_column

NAMES = (name_column("observer", "Observer", short="observer"), name_column("phase", "Phase", short="phase"))
_LARGEST = "Largest absolute estimate minus true value in the phase"
_RMS = "Time-weighted root mean square of estimate minus true value in the phase"
MEASURED = (
    error_column("max_speed_error", "max |speed error|", "m/s", _LARGEST, short="max |v|"),
    error_column("rms_speed_error", "rms speed error", "m/s", _RMS, short="rms v"),
    error_column("max_position_error", "max |position error|", "m", _LARGEST, short="max |p|"),
    error_column("rms_position_error", "rms position error", "m", _RMS, short="rms p"),
)
_REFERENCES = (
    Column("published", "published max |speed error|", "m/s", "The number in print", short="published"),
    Column(
        "independent",
        "independent max |speed error|",
        "m/s",
        "Measured by a separate implementation",
        short="independent",
    ),
)


def sizes(entry: PhaseMetrics) -> list[float | None]:
    """Maximal and rms errors of speed and position, in the columns of `MEASURED`.

    Args:
        entry: errors of an observer in a phase.
    """
    return [
        size
        for error in (entry.speed, entry.position)
        for size in ((error.max_abs, error.rms) if error else (None, None))
    ]


def error_table(metrics: Sequence[PhaseMetrics], spec: ReportSpec) -> Table:
    """Errors of speed v and position p of every observer in every phase, reference numbers beside them.

    Args:
        metrics: from `phase_metrics`. spec: labels.
    """
    rows = [[label(spec, m.observer), m.phase, *sizes(m), m.published, m.independent] for m in metrics]
    return Table("errors", [*NAMES, *MEASURED, *_REFERENCES], rows).filled([column.key for column in MEASURED])
