"""The comparison of a result with a reference, which people read as text."""

from __future__ import annotations

from dataclasses import dataclass, replace

from cosim.comparison.comparison_text import comparison_parts
from cosim.comparison.verdict import ComparisonData
from fmus.tables.line_picture import Line, line_picture
from fmus.tables.table import Parts, Readable


@dataclass(frozen=True)
class Comparison(ComparisonData, Readable):
    """What a comparison found; see `cosim.comparison.verdict.ComparisonData`."""

    def _picture_html(self) -> str:
        """Both sides and the error of the signal that differs most, or else of the first; the tolerance around them."""
        shown = next((s for s in (*self.failed, *self.signals) if s.curves is not None), None)
        if shown is None or (curves := shown.as_shown().curves) is None:
            return ""
        unit = f" [{shown.shown.name}]" if shown.shown.name not in ("", "1") else ""
        tube = [Line("tolerance", curves.tube_time, edge, "allowed") for edge in (curves.lower, curves.upper)]
        reference = Line(self.reference, curves.reference_time, curves.reference, "true")
        both = [*tube[:1], replace(tube[1], label=""), reference, Line(self.result, curves.result_time, curves.result)]
        error = Line("result minus reference", curves.error_time, curves.error)
        return line_picture(f"{shown.name}{unit}", both) + line_picture(f"Error of {shown.name}{unit}", [error])

    def parts(self) -> Parts:
        """What was different in what was run, the verdict, what differences have in common, how large they are."""
        return comparison_parts(self)
