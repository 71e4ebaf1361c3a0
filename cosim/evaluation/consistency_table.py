"""The table of filter consistency, as rows of text for a page and for a terminal. Standard library only."""

from __future__ import annotations

from collections.abc import Sequence

from cosim.evaluation.consistency import FilterConsistency
from cosim.evaluation.numbers import number
from cosim.evaluation.roles import label
from cosim.evaluation.spec import ReportSpec
from fmus.text_table import text_table

HEADINGS = ("Judged by", "Expected", "Mean", "Band of the mean, 99 %", "Samples inside 95 % band [%]", "Verdict")
SHORT = ("judged by", "expected", "mean", "band, 99 %", "inside [%]", "verdict")


def cells(entry: FilterConsistency) -> list[str]:
    """The numbers of one judgement, in the order of `HEADINGS`.

    Args:
        entry: from `filter_consistency`.
    """
    found = entry.found
    return [
        entry.name,
        number(found.degrees),
        number(found.mean),
        f"{number(found.band.low)} to {number(found.band.high)}",
        number(100.0 * found.inside),
        found.verdict,
    ]


def consistency_text(entries: Sequence[FilterConsistency], spec: ReportSpec) -> str:
    """The table for a terminal; empty where nothing was judged.

    Args:
        entries: from `filter_consistency`. spec: labels.

    Returns:
        Lines of equal width; ends without a line break.
    """
    if not entries:
        return ""
    rows = [["filter consistency", *SHORT], *([label(spec, e.observer), *cells(e)] for e in entries)]
    return "\n".join(text_table(rows, (0, 1, 6), heading=True))
