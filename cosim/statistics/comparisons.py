"""Observers, or settings, compared on the same disturbances: paired differences, with the number of comparisons told.
NumPy and SciPy.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import isnan, nan

import numpy as np
import scipy

from cosim.statistics.intervals import quantile
from cosim.statistics.spread import LEVEL, Spread
from fmus.tables.numbers import number
from fmus.tables.table import Column, Table, name_column, text_column


@dataclass(frozen=True)
class PairedDifference:
    """Two that were measured in the same runs.

    Args:
        first, second: their names.
        difference: median of first minus second; all such intervals of a comparison hold together with 95 %.
        p: of the sign test, that both are smaller equally often [1]. adjusted: the same by Holm, for all pairs.
    """

    first: str
    second: str
    difference: Spread
    p: float
    adjusted: float

    def verdict(self, level: float = LEVEL) -> str:
        """Which is smaller, or that the runs do not show it.

        Args:
            level: of confidence, for all pairs together [1].
        """
        if isnan(self.adjusted) or self.adjusted > 1.0 - level or self.difference.value == 0.0:
            return "not shown"
        return f"{self.first if self.difference.value < 0.0 else self.second} is smaller"


def compared(measures: Mapping[str, Sequence[float]], level: float = LEVEL) -> list[PairedDifference]:
    """Every pair of columns, run by run.

    The median of the differences has the interval of the sign test, two order statistics (`quantile`), which supposes
    neither symmetry, as Wilcoxon's does, nor finite values. With m pairs each holds ``1 - (1 - level) / m``, so that
    all hold together with `level` (Bonferroni); p is adjusted by Holm, Scandinavian Journal of Statistics 6 (1979) 65,
    and rejects more. Equal values decide nothing in the sign test.

    Args:
        measures: by name, one value a run, of the same runs in the same order; NaN where a run has none.
        level: of confidence for all pairs together [1].

    Raises:
        ValueError: columns differ in length, or hold fewer than two names.
    """
    if len(measures) < 2 or len({len(values) for values in measures.values()}) != 1:
        lengths = ", ".join(f"{name}: {len(values)}" for name, values in measures.items())
        raise ValueError(f"compared: expected two columns or more of the same runs; got {lengths or 'none'}.")
    pairs = list(combinations(measures, 2))
    with np.errstate(invalid="ignore"):  # of two infinite ones none is smaller
        differences = [np.subtract(measures[a], measures[b]) for a, b in pairs]
    p = [_sign_test(values) for values in differences]
    each = 1.0 - (1.0 - level) / len(pairs)
    found = zip(pairs, differences, p, _holm(p), strict=True)
    return [PairedDifference(*pair, quantile(values, 0.5, each), *tests) for pair, values, *tests in found]


def comparison_table(pairs: Sequence[PairedDifference], what: str, unit: str = "") -> Table:
    """The comparisons, how many there are in a note.

    Args:
        pairs: from `compared`. what: was measured, in words. unit: of it.
    """
    columns = (
        name_column("first", "First"),
        name_column("second", "Second"),
        Column("difference", "Median of first - second", unit, "With its interval", write=Spread.text),
        Column("adjusted", "p (Holm)", "", "Of the sign test, for all pairs"),
        text_column("verdict", "Verdict", "Which is smaller; not shown: the runs do not say"),
    )
    rows = [[d.first, d.second, d.difference, number(d.adjusted, 2), d.verdict()] for d in pairs]
    count = f"{len(pairs)} comparisons" if len(pairs) > 1 else "1 comparison"
    note = f"{count} on the same disturbances; intervals and p hold for all of them together (95 %)."
    return Table("comparisons", columns, rows, what, notes=[note])


def _sign_test(differences: np.ndarray) -> float:
    less, more = int(np.count_nonzero(differences < 0.0)), int(np.count_nonzero(differences > 0.0))
    return min(1.0, 2.0 * float(scipy.special.bdtr(min(less, more), less + more, 0.5))) if less + more else nan


def _holm(p: Sequence[float]) -> list[float]:
    """Adjusted values, in order; NaN, which is no test, counts as 1."""
    known = np.nan_to_num(p, nan=1.0)
    order = np.argsort(known, kind="stable")
    steps = np.minimum(np.maximum.accumulate(known[order] * np.arange(len(p), 0, -1)), 1.0)
    adjusted = np.empty(len(p))
    adjusted[order] = steps
    return [float(value) for value in adjusted]
