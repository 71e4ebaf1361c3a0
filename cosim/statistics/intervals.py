"""Shares, rates, means and quantiles of runs with intervals. NumPy, SciPy and the exact intervals of counts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import ceil, isfinite, isnan, log, nan, sqrt
from typing import TypeVar

import numpy as np
import scipy

from cosim.statistics.spread import LEVEL, Spread
from fmu_observer.formulas.diagnosis.thresholds import clopper_pearson, garwood

_Key = TypeVar("_Key")


def proportion(count: int, trials: int, level: float = LEVEL) -> Spread:
    """A share of runs, with the exact interval of Clopper and Pearson (1934): it holds `level` at least, whatever the
    share; near 0 and 1, and with few runs, up to 99 % and more.

    Args:
        count: runs in which it was so. trials: all that were judged. level: of confidence [1].

    Returns:
        The share [1], its `count` how often it was so; NaN without a trial.
    """
    return Spread(count / trials if trials else nan, *clopper_pearson(count, trials, level), count)


def event_rate(count: int, exposure: float, level: float = LEVEL) -> Spread:
    """A rate of events that come independently, with the exact interval of Garwood (1936).

    Args:
        count: events seen. exposure: for how long, in the unit of the rate. level: of confidence [1].

    Returns:
        The rate [1/unit of the exposure]; NaN where nothing was seen for no time.
    """
    return Spread(count / exposure if exposure > 0.0 else nan, *garwood(count, exposure, level), count)


def mean_of(values: Sequence[float] | np.ndarray, level: float = LEVEL) -> Spread:
    """The mean with its interval by Student's t: exact for normal values, of skewed ones it holds less often.

    Args:
        values: one a run; those that are not finite are left out. level: of confidence [1].

    Returns:
        The mean in the unit of the values, without an interval for fewer than two.
    """
    numbers = np.array([value for value in values if isfinite(value)])
    if not len(numbers):
        return Spread(nan, needed=2)
    mean = float(numbers.mean())
    if len(numbers) < 2:
        return Spread(mean, count=1)
    half = _student(len(numbers), level) * float(numbers.std(ddof=1)) / sqrt(len(numbers))
    return Spread(mean, mean - half, mean + half, len(numbers))


def mean_over_samples(
    totals: Sequence[float] | np.ndarray, samples: Sequence[float] | np.ndarray, level: float = LEVEL
) -> Spread:
    """The mean over all samples of all runs, with an interval by runs: samples of one run depend on each other, runs do
    not. So for NEES and NIS: a consistent filter has its degrees of freedom in the interval.

    The ratio ``R = sum T / sum n`` with the variance ``m / (m - 1) sum (T_i - R n_i)^2 / (sum n)^2``: Cochran, Sampling
    Techniques (1977), section 6.4; ends by Student's t of ``m - 1``, for m runs.

    Args:
        totals: T, the sum over the samples of each run, shape (runs,). samples: n, their number, shape (runs,).
        level: of confidence [1].

    Returns:
        The mean in the unit of the totals; without an interval for fewer than two runs.
    """
    T, n = np.asarray(totals, dtype=float), np.asarray(samples, dtype=float)
    used = np.isfinite(T) & (n > 0.0)
    T, n, m = T[used], n[used], int(np.count_nonzero(used))
    if not m:
        return Spread(nan, needed=2)
    mean = float(T.sum() / n.sum())
    if m < 2:
        return Spread(mean, count=m, needed=2)
    half = _student(m, level) * sqrt(m / (m - 1) * float(((T - mean * n) ** 2).sum())) / float(n.sum())
    return Spread(mean, mean - half, mean + half, m)


def coverage(
    inside: Sequence[float] | np.ndarray, samples: Sequence[float] | np.ndarray, level: float = LEVEL
) -> Spread:
    """Share of the time in which a claimed bound holds, with an interval by runs (`mean_over_samples`).

    Where it held throughout, or never, in all runs, samples say nothing of how it varies. Then the share can fall short
    of 1, or of 0, by no more than the share of runs that are otherwise, so the end is that of `proportion`.

    Args:
        inside: samples within the bound, of each run, shape (runs,). samples: all of it, shape (runs,).
        level: of confidence [1].
    """
    found = mean_over_samples(inside, samples, level)
    if found.value in (0.0, 1.0):
        return proportion(found.count if found.value else 0, found.count, level)
    return Spread(found.value, max(found.low, 0.0), min(found.high, 1.0), found.count, found.needed)


def quantile(values: Sequence[float] | np.ndarray, share: float, level: float = LEVEL) -> Spread:
    """A quantile with an interval that holds whatever the distribution: two order statistics.

    With K of n values below the quantile, K is binomial, so the l-th and the u-th value enclose it with probability
    ``P(l <= K <= u - 1)``: David and Nagaraja, Order Statistics (2003), section 7.1. Taken are the ranks with half of
    the rest beyond each, and of these and their inner neighbours those that hold `level` most closely from above.

    Args:
        values: one a run; infinite ones (it diverged) count as larger than all, NaN are left out.
        share: that lies below: 0.5 for the median. level: of confidence [1].

    Returns:
        The quantile in the unit of the values; with `needed` where no order statistic is far enough outside.

    Raises:
        ValueError: the share is not between 0 and 1.
    """
    if not 0.0 < share < 1.0:
        raise ValueError(f"quantile: a share of {share}; expected one between 0 and 1, 0.5 for the median.")
    ordered = np.sort([value for value in values if not isnan(value)])
    n, fewest = len(ordered), _fewest_runs(share, level)
    if not n:
        return Spread(nan, needed=fewest)
    place = n * share
    whole = abs(place - round(place)) < 1e-9 * n  # 0.1 n is not whole in binary
    upper = round(place) if whole else ceil(place) - 1
    value = float(0.5 * (ordered[upper - 1] + ordered[upper]) if whole else ordered[upper])
    if n < fewest:
        return Spread(value, count=n, needed=fewest)
    low, high = _ranks(n, share, level)
    return Spread(value, float(ordered[low - 1]), float(ordered[high - 1]), n)


def extremes(values: Mapping[_Key, float]) -> tuple[_Key, _Key]:
    """Where a measure is smallest and where it is largest, the first of equal ones.

    Args:
        values: by the key of the run, one at least that is a number; infinite ones count.

    Returns:
        Both keys.
    """
    known = {key: value for key, value in values.items() if not isnan(value)}
    return min(known, key=known.__getitem__), max(known, key=known.__getitem__)


def _ranks(n: int, share: float, level: float) -> tuple[int, int]:
    """Ranks, from 1 on, of the values that enclose a quantile; n is large enough."""
    cdf = scipy.special.bdtr(np.arange(float(n)), n, share)  # P(K <= k) for k = 0 ... n - 1
    tail = 0.5 * (1.0 - level)
    low, high = int(np.searchsorted(cdf, tail, side="right")), int(np.searchsorted(cdf, 1.0 - tail)) + 1
    pairs = [(low, high), (low + 1, high), (low, high - 1)]
    held = {pair: float(cdf[pair[1] - 1] - cdf[pair[0] - 1]) for pair in pairs if pair[0] < pair[1] <= n}
    return min((pair for pair in held if held[pair] >= level), key=held.__getitem__, default=(low, high))


def _fewest_runs(share: float, level: float) -> int:
    """Runs of which the smallest and the largest enclose a quantile with half of the rest beyond each."""
    return ceil(log(0.5 * (1.0 - level)) / log(max(share, 1.0 - share)))


def _student(runs: int, level: float) -> float:
    return float(scipy.special.stdtrit(runs - 1, 0.5 + 0.5 * level))
