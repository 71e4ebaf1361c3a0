"""Which of the things that vary matters for a measure, from runs that were drawn anyhow. NumPy and SciPy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import atanh, nan, sqrt, tanh
from typing import Any

import numpy as np
import scipy

from cosim.statistics.intervals import mean_of
from cosim.statistics.spread import LEVEL, Spread

_BLOCKS = 20  # left out in turn
_FEWEST = 100  # runs; 5 in a block
_MOST_GROUPS = 40


@dataclass(frozen=True)
class Influence:
    """What one variable does to a measure.

    Args:
        name: of the variable. correlation: of ranks, from -1 to 1; NaN where its values have no order.
        share: of the variance of the measure's ranks that it explains alone, from 0 to 1.
    """

    name: str
    correlation: Spread
    share: Spread


def influences(
    settings: Mapping[str, Sequence[Any]], measure: Sequence[float], level: float = LEVEL
) -> list[Influence]:
    """All variables, the one that explains most first.

    Args:
        settings: by name, one value a run; numbers or choices. measure: one value a run; infinite ones are the
            largest, runs with NaN are left out. level: of confidence [1].
    """
    y = np.asarray(measure, dtype=float)
    used = ~np.isnan(y)
    found = []
    for name, column in settings.items():
        values = [value for value, kept in zip(column, used, strict=True) if kept]
        ordered = all(isinstance(value, int | float | np.number) for value in values)
        correlation = rank_correlation(values, y[used], level) if ordered else Spread(nan)
        found.append(Influence(name, correlation, explained_share(values, y[used], level)))
    return sorted(found, key=lambda entry: -np.nan_to_num(entry.share.value))


def rank_correlation(x: Sequence[Any], y: Sequence[float] | np.ndarray, level: float = LEVEL) -> Spread:
    """Spearman's rank correlation, with the interval of Bonett and Wright (Psychometrika 65 (2000) 23):
    ``tanh(atanh r -+ z sqrt((1 + r^2 / 2) / (n - 3)))``, which is approximate.

    Args:
        x, y: one value a run, shape (runs,); infinite ones are the largest, none is NaN. level: of confidence [1].

    Returns:
        From -1 to 1; NaN where one of them does not vary.
    """
    n = len(x)
    if n < 3 or min(len(set(x)), len(set(y))) < 2:
        return Spread(nan, count=n, needed=4)
    r = float(np.corrcoef(_ranks_of(x), _ranks_of(y))[0, 1])
    if n < 4 or abs(r) > 1.0 - 1e-12:
        return Spread(r, count=n, needed=4 if n < 4 else 0)
    half = float(scipy.special.ndtri(0.5 + 0.5 * level)) * sqrt((1.0 + 0.5 * r * r) / (n - 3))
    return Spread(r, tanh(atanh(r) - half), tanh(atanh(r) + half), n)


def explained_share(x: Sequence[Any], y: Sequence[float] | np.ndarray, level: float = LEVEL) -> Spread:
    """First-order sensitivity index of the ranks of a measure: ``Var(E[rank y | x]) / Var(rank y)``.

    Runs are put into groups of equal x, of many numbers into groups of equal size (the cube root of the runs);
    the share between groups is corrected for the number of groups, ``1 - (SSW / (n - k)) / (SST / (n - 1))``: given
    data, Plischke, Borgonovo, Smith, European Journal of Operational Research 226 (2013) 536, with the correction of
    Kelley (1935). The interval leaves out one of 20 blocks of runs in turn (jackknife), with Student's t; it is
    approximate.

    Args:
        x: one value a run, numbers or choices. y: one value a run, shape (runs,). level: of confidence [1].

    Returns:
        From 0 to 1; NaN where one of them does not vary.
    """
    n, groups = len(x), _groups(x)
    ranks = _ranks_of(y)
    whole = _between(groups, ranks)
    if np.isnan(whole) or n < _FEWEST:
        return Spread(max(whole, 0.0), count=n, needed=_FEWEST)
    blocks = np.random.default_rng(0).permutation(n) % _BLOCKS  # runs may stand in the order of a grid
    parts = [_between(groups[blocks != block], ranks[blocks != block]) for block in range(_BLOCKS)]
    found = mean_of([_BLOCKS * whole - (_BLOCKS - 1) * part for part in parts], level)
    return Spread(max(whole, 0.0), max(found.low, 0.0), min(found.high, 1.0), n)


def _ranks_of(values: Sequence[float] | np.ndarray) -> np.ndarray:
    """Ranks, equal values their mean, shape (runs,)."""
    _, places, counts = np.unique(np.asarray(values, dtype=float), return_inverse=True, return_counts=True)
    return np.asarray((np.cumsum(counts) - 0.5 * (counts - 1))[places])


def _groups(x: Sequence[Any]) -> np.ndarray:
    """The group of each run, from 0 on, shape (runs,)."""
    keys = {value: place for place, value in enumerate(dict.fromkeys(x))}
    if len(keys) <= _MOST_GROUPS and len(keys) * 2 <= len(x):
        return np.array([keys[value] for value in x])
    numbers = all(isinstance(value, int | float | np.number) for value in x)
    places = np.argsort(np.argsort(x, kind="stable")) if numbers else np.arange(len(x))
    return np.asarray(places * min(max(round(len(x) ** (1 / 3)), 2), _MOST_GROUPS) // len(x))


def _between(groups: np.ndarray, y: np.ndarray) -> float:
    """Share of the variance of y between groups, corrected for their number."""
    counts = np.bincount(groups)
    k, n = int(np.count_nonzero(counts)), len(y)
    total = float(((y - y.mean()) ** 2).sum())
    if k < 2 or n <= k or not total:
        return nan
    within = total - float((np.bincount(groups, y - y.mean()) ** 2 / np.maximum(counts, 1)).sum())
    return 1.0 - within / (n - k) * (n - 1) / total
