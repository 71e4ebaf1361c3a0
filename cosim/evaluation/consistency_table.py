"""The table of filter consistency. Standard library only."""

from __future__ import annotations

from collections.abc import Sequence

from cosim.evaluation.consistency import ADVICE, MEANING, FilterConsistency
from cosim.evaluation.roles import label
from cosim.evaluation.spec import ReportSpec
from fmus.tables.table import Column, Table, name_column, text_column

_COLUMNS = (
    name_column("observer", "Observer", short="filter consistency"),
    name_column("quantity", "Judged by", "What is squared and normalised", short="judged by"),
    Column("degrees", "Expected", "", "Degrees of freedom: the mean of a consistent filter", short="expected"),
    Column("mean", "Mean", "", "Of the normalised squares", short="mean"),
    Column("band", "Band of the mean, 99 %", "", "The mean of a consistent filter lies in it", short="band, 99 %"),
    Column("inside", "Samples inside 95 % band", "%", "Of a consistent filter 95 %", factor=100.0, short="inside"),
    text_column("verdict", "Verdict", "; ".join(f"{word}: {text}" for word, text in ADVICE.items()), short="verdict"),
)
VERDICTS = (
    "overconfident: errors are larger than stated; underconfident: smaller; "
    "docs/reference/consistency.md says what to do."
)


def consistency_table(entries: Sequence[FilterConsistency], spec: ReportSpec) -> Table:
    """Filters whose covariances can be judged, and whether they fit; the meaning of the words below.

    Args:
        entries: from `filter_consistency`. spec: labels.
    """
    rows = [
        [label(spec, e.observer), e.name, f.degrees, f.mean, (f.band.low, f.band.high), f.inside, f.verdict]
        for e in entries
        for f in [e.found]
    ]
    kinds = dict.fromkeys(entry.kind for entry in entries)
    meanings = [f"{'NEES of one quantity' if kind == 'error' else kind}: {MEANING[kind]}." for kind in kinds]
    return Table("consistency", _COLUMNS, rows, notes=(*meanings, VERDICTS), bad=set(ADVICE))
