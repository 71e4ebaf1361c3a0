"""The comparison of a result with a reference, which people read as text."""

from __future__ import annotations

from dataclasses import dataclass

from cosim.comparison.comparison_text import comparison_parts
from cosim.comparison.verdict import ComparisonData
from fmus.tables.table import Parts, Readable


@dataclass(frozen=True)
class Comparison(ComparisonData, Readable):
    """What a comparison found; see `cosim.comparison.verdict.ComparisonData`."""

    def parts(self) -> Parts:
        """What was different in what was run, the verdict, what differences have in common, how large they are."""
        return comparison_parts(self)
