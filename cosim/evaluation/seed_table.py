"""The table of errors over several seeds. Standard library only."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from cosim.evaluation.error_table import NAMES
from fmus.tables.table import Table, error_column

_LARGEST = "Largest absolute speed error in the phase"
_COLUMNS = (
    *NAMES,
    error_column("lower quartile", "lower quartile", "m/s", f"{_LARGEST}, of a quarter of the seeds smaller"),
    error_column("median", "median", "m/s", f"{_LARGEST}, of half of the seeds smaller"),
    error_column("upper quartile", "upper quartile", "m/s", f"{_LARGEST}, of three quarters of the seeds smaller"),
    error_column("published", "published", "m/s", f"{_LARGEST}, in print"),
    error_column("independent", "independent", "m/s", f"{_LARGEST}, measured by a separate implementation"),
)


def seed_table(rows: Iterable[Mapping[str, Any]], title: str = "", notes: Iterable[str] = ()) -> Table:
    """Quartiles of the maximal speed errors over several seeds, of every observer in every phase.

    Args:
        rows: by the keys of the columns; what is missing is left open. title, notes: above and below it.
    """
    return Table("seeds", _COLUMNS, [[row.get(c.key) for c in _COLUMNS] for row in rows], title, [*notes])
