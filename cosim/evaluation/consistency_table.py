"""The table of filter consistency, as rows of text for a page and for a terminal. Standard library only."""

from __future__ import annotations

from collections.abc import Sequence

from cosim.evaluation.consistency import MEANING, FilterConsistency
from cosim.evaluation.roles import label
from cosim.evaluation.spec import ReportSpec
from fmus.tables.numbers import number
from fmus.text_table import text_table

HEADINGS = ("Judged by", "Expected", "Mean", "Band of the mean, 99 %", "Samples inside 95 % band [%]", "Verdict")
SHORT = ("judged by", "expected", "mean", "band, 99 %", "inside [%]", "verdict")

VERDICTS = "overconfident: errors are larger than told; underconfident: smaller; docs/consistency.md says what to do."


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
        Lines, the meaning of the words below them; ends without a line break.
    """
    if not entries:
        return ""
    rows = [["filter consistency", *SHORT], *([label(spec, e.observer), *cells(e)] for e in entries)]
    kinds = dict.fromkeys(entry.kind for entry in entries)
    meanings = [f"{'NEES of one quantity' if kind == 'error' else kind}: {MEANING[kind]}." for kind in kinds]
    return "\n".join([*text_table(rows, (0, 1, 6), heading=True), *meanings, VERDICTS])
