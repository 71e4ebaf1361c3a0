"""Whether a filter's covariance fits its errors: normalised squares, chi-square bands, a verdict. NumPy and SciPy.

A consistent filter has errors of the size that its covariance states. Then the normalised square of the estimation
error (NEES) is chi-square distributed with as many degrees of freedom as there are states, that of the innovation (NIS)
with as many as there are measurements, and innovations of different samples do not depend on each other: Bar-Shalom,
Li, Kirubarajan, Estimation with Applications to Tracking and Navigation (2001), section 5.4.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, nan
from typing import Literal

import numpy as np
import scipy

Verdict = Literal["consistent", "overconfident", "underconfident", "not finite", "too few samples"]

_POINTWISE = 0.95  # of the samples of a consistent filter lie inside the band
_TEST_LEVEL = 0.99  # of consistent runs pass the test of the mean
_FEWEST = 5  # independent samples below which nothing is said
_SINGULAR = 1e-12  # smallest eigenvalue of a correlation matrix that is inverted


@dataclass(frozen=True)
class Band:
    """An interval that holds a number with a probability.

    Attributes:
        low, high: ends. level: the probability.
    """

    low: float
    high: float
    level: float


@dataclass(frozen=True)
class Consistency:
    """What the normalised squares of a run, or of many, say of a covariance.

    Attributes:
        degrees: mean degrees of freedom of a sample, what the mean is for a consistent filter.
        mean: of the normalised squares. samples: how many there are.
        independent: how many independent ones they are worth.
        inside: share of the samples inside the pointwise 95 % band.
        band: that holds the mean of 99 % of consistent filters.
        verdict: ``overconfident`` where the mean lies above the band: errors are larger than stated.
    """

    degrees: float
    mean: float
    samples: int
    independent: float
    inside: float
    band: Band
    verdict: Verdict


def normalised_squares(errors: np.ndarray, covariances: np.ndarray) -> np.ndarray:
    """``e' inv(P) e`` of each row.

    Args:
        errors: shape (rows, k).
        covariances: shape (rows, k, k), or variances alone, shape (rows, k), of numbers that are independent.

    Returns:
        Shape (rows,); NaN where a covariance is not finite, or not positive definite.
    """
    diagonal = covariances if covariances.ndim == 2 else np.einsum("rii->ri", covariances)
    with np.errstate(invalid="ignore"):
        finite = np.isfinite(covariances).all(axis=tuple(range(1, covariances.ndim)))  # of no rows too
        usable = finite & (diagonal > 0.0).all(axis=1)
    found = np.full(len(errors), nan)
    deviations = np.sqrt(diagonal[usable])
    scaled = errors[usable] / deviations
    if covariances.ndim == 2:
        found[usable] = (scaled**2).sum(axis=1)
        return found
    correlations = covariances[usable] / (deviations[:, :, None] * deviations[:, None, :])
    regular = np.linalg.eigvalsh(correlations)[:, 0] > _SINGULAR if len(correlations) else np.zeros(0, dtype=bool)
    solved = np.linalg.solve(correlations[regular], scaled[regular][:, :, None])[:, :, 0]
    squares = np.full(len(scaled), nan)
    squares[regular] = (scaled[regular] * solved).sum(axis=1)
    found[usable] = squares
    return found


def quantile(degrees: float | np.ndarray, probability: float) -> np.ndarray:
    """Quantile of the chi-square distribution.

    Args:
        degrees: of freedom; need not be whole. probability: that a number lies below.
    """
    return np.asarray(2.0 * scipy.special.gammaincinv(0.5 * np.asarray(degrees), probability))


def chi_square_band(degrees: float, count: float = 1.0, level: float = _POINTWISE) -> Band:
    """Band of the mean of independent chi-square numbers.

    Args:
        degrees: of freedom of each. count: how many are averaged, seeds say; need not be whole.
        level: probability that the mean lies inside, half of the rest on either side.

    Returns:
        The band; for ``count = 1`` that of a single number.
    """
    low, high = (float(quantile(degrees * count, share)) / count for share in _tails(level))
    return Band(low, high, level)


def _independent_count(values: np.ndarray) -> float:
    """How many independent numbers a correlated series is worth for its mean.

    ``N / (1 + 2 sum rho)``, the sum of the autocorrelations cut where a pair of them is no longer positive: Geyer,
    Practical Markov Chain Monte Carlo, Statistical Science 7 (1992) 473, section 3.3.
    """
    count = len(values)
    centred = values - values.mean()
    if count < 2 or not centred.any():
        return float(count)
    size = 2 * count
    spectrum = np.abs(np.fft.rfft(centred, size)) ** 2
    rho = np.fft.irfft(spectrum, size)[:count]
    rho = rho / rho[0]
    pairs = rho[: count - count % 2].reshape(-1, 2).sum(axis=1)
    ends = np.flatnonzero(pairs <= 0.0)
    length = 2.0 * float(pairs[: ends[0] if len(ends) else None].sum()) - 1.0
    return float(count / max(length, 1.0))


def evaluate(
    squares: np.ndarray, degrees: float | np.ndarray, *, white: bool, level: float = _TEST_LEVEL
) -> Consistency:
    """Whether normalised squares are those of a consistent filter.

    Args:
        squares: NEES or NIS of each sample, shape (rows,), in order of time; those that are NaN are left out.
        degrees: degrees of freedom, one number or one a sample, shape (rows,).
        white: whether samples do not depend on each other, as those of NIS; otherwise `_independent_count` says how
            many there are.
        level: share of consistent filters that pass.

    Returns:
        The verdict; ``not finite`` where a square is infinite, ``too few samples`` below 5 independent ones.
    """
    each = np.broadcast_to(np.asarray(degrees, dtype=float), squares.shape)
    used = ~np.isnan(squares) & (each > 0.0)
    values, each = squares[used], each[used]
    if not len(values):
        return Consistency(nan, nan, 0, 0.0, nan, Band(nan, nan, level), "too few samples")
    of_one, mean = float(each.mean()), float(values.mean())
    if not isfinite(mean):
        return Consistency(of_one, mean, len(values), nan, nan, Band(nan, nan, level), "not finite")
    independent = float(len(values)) if white else _independent_count(values / each)
    band = chi_square_band(of_one, independent, level)
    inside = float(np.mean(_is_inside(values, each)))
    verdict: Verdict = "consistent"
    if independent < _FEWEST:
        verdict = "too few samples"
    elif not band.low <= mean <= band.high:
        verdict = "overconfident" if mean > band.high else "underconfident"
    return Consistency(of_one, mean, len(values), independent, inside, band, verdict)


def _is_inside(squares: np.ndarray, degrees: float | np.ndarray) -> np.ndarray:
    """Which samples lie inside the band of one, shape (rows,)."""
    few, place = np.unique(degrees, return_inverse=True)  # of mostly equal ones, each of which takes microseconds
    low, high = (quantile(few, share)[place] for share in _tails(_POINTWISE))
    return np.asarray((squares >= low) & (squares <= high))


def average_over_runs(squares: np.ndarray, degrees: float, level: float = _POINTWISE) -> tuple[np.ndarray, Band]:
    """Averages over independent runs at each instant, with the band that holds them for a consistent filter.

    Args:
        squares: NEES or NIS, shape (runs, rows). degrees: of freedom of each. level: of the band.

    Returns:
        Averages, shape (rows,), and the band.
    """
    return squares.mean(axis=0), chi_square_band(degrees, float(len(squares)), level)


def _tails(level: float) -> tuple[float, float]:
    return 0.5 - 0.5 * level, 0.5 + 0.5 * level
