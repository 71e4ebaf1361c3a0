"""The table of errors, as text. Standard library only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from cosim.evaluation.metrics import PhaseMetrics
from cosim.evaluation.roles import label
from cosim.evaluation.spec import ReportSpec
from fmus.tables.numbers import error_number, number
from fmus.text_table import text_table


@dataclass(frozen=True)
class Column:
    """Heading and unit of a column of numbers."""

    heading: str
    unit: str

    @property
    def text(self) -> str:
        """Heading with unit."""
        return f"{self.heading} [{self.unit}]"


MEASURED = (
    Column("max |speed error|", "m/s"),
    Column("rms speed error", "m/s"),
    Column("max |position error|", "m"),
    Column("rms position error", "m"),
)
PUBLISHED = Column("published max |speed error|", "m/s")
INDEPENDENT = Column("independent max |speed error|", "m/s")
SHORT = {
    MEASURED[0]: "max |v|",
    MEASURED[1]: "rms v",
    MEASURED[2]: "max |p|",
    MEASURED[3]: "rms p",
    PUBLISHED: "published",
    INDEPENDENT: "independent",
}


def columns(metrics: Sequence[PhaseMetrics]) -> list[Column]:
    """Columns that hold a number somewhere; the measured ones always stand.

    Args:
        metrics: from `phase_metrics`.
    """
    chosen = [*MEASURED]
    chosen += [PUBLISHED] if any(m.published is not None for m in metrics) else []
    chosen += [INDEPENDENT] if any(m.independent is not None for m in metrics) else []
    return chosen


def cells(entry: PhaseMetrics, chosen: Sequence[Column]) -> list[str]:
    """The numbers of a row as text.

    Args:
        entry: errors of an observer in a phase.
        chosen: from `columns`.
    """
    sizes = [
        size
        for error in (entry.speed, entry.position)
        for size in ((error.max_abs, error.rms) if error else (None, None))
    ]
    texts = dict(zip(MEASURED, map(error_number, sizes), strict=True))
    texts |= {PUBLISHED: number(entry.published), INDEPENDENT: number(entry.independent)}
    return [texts[column] for column in chosen]


def error_text(metrics: Sequence[PhaseMetrics], spec: ReportSpec) -> str:
    """The errors as a table for a terminal.

    Args:
        metrics: from `phase_metrics`. spec: labels.

    Returns:
        Lines of equal width, v the speed error and p the position error; ends without a line break.
    """
    chosen = columns(metrics)
    rows = [["observer", "phase", *(f"{SHORT[c]} [{c.unit}]" for c in chosen)]]
    rows += [[label(spec, m.observer), m.phase, *cells(m, chosen)] for m in metrics]
    return "\n".join(text_table(rows, (0, 1), heading=True))
