"""Noise of a measured signal that may not be white: what residuals show of it, and how uncertain it leaves parameters.
Arrays in, values out.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

Array = NDArray[np.float64]

_WHITE = 0.5
"""Probability of white noise before anything was measured; all the others share the rest alike."""
_SHARES = (0.05, 0.1, 0.2, 0.4, 0.7, 1.0)
"""Of the variance, of the part that is not white."""
_SHORTEST, _LONGEST = 0.625, 0.25
"""Correlation times of that part go from so many samples to this share of all, each twice the one before."""
_FEWEST = 20
"""Samples; of fewer ones the noise is taken for white."""
_DOUBTFUL = 0.1
"""Probability of white noise below which it is said to be none."""
_ROUNDING = 1e-12


class Noise(NamedTuple):
    """What residuals show of their noise.

    Attributes:
        deviation: standard deviation of a sample. samples_per_independent: how many samples say as much of a mean as
            one with white noise; 1 where it may be white. spread: covariance of ``J' noise``, shape (p, p).
    """

    deviation: float
    samples_per_independent: float
    spread: Array


def noise_of(residuals: Array, slopes: Array) -> Noise:
    """The noise of one signal, of which a fit has explained what the parameters can.

    It is white, or a share q of its variance has the correlation r^k over k samples, as noise of first order:
    ``V = (1 - q) I + q R(r)``. How probable each q and r is follows from the restricted likelihood of the residuals, in
    which the parameters have no part, so that it does not matter what the fit took from them. The covariance is the
    mean over all of them, for a recording seldom shows which one it is.

    Args:
        residuals: measured less fitted, shape (n,). slopes: J, of the signal by the parameters, shape (n, p).

    Source: Patterson and Thompson, Biometrika 58 (1971) 545, for the likelihood; the grid of models and their
    probabilities before are ours, the error rates stand in docs/reference/identification.md.
    """
    left, values, _ = np.linalg.svd(slopes, full_matrices=False)
    basis = left[:, values > _ROUNDING * max(float(values[0]), np.finfo(float).tiny)]
    rest = residuals - basis @ (basis.T @ residuals)
    if len(residuals) <= basis.shape[1] or not np.any(rest):
        variance = float(np.mean(residuals**2))
        return Noise(float(np.sqrt(variance)), 1.0, variance * slopes.T @ slopes)
    scores, variances, counts, spreads = (np.array(each) for each in zip(*_models(slopes, basis, rest), strict=True))
    scores[0] += np.log(_WHITE)
    scores[1:] += np.log((1.0 - _WHITE) / max(1, len(scores) - 1))
    weights = np.exp(scores - scores.max()) / np.exp(scores - scores.max()).sum()
    coloured = 1.0 if weights[0] >= _DOUBTFUL else float(weights[1:] @ counts[1:] / weights[1:].sum())
    return Noise(float(np.sqrt(weights @ variances)), coloured, np.einsum("g,gij->ij", weights * variances, spreads))


def _models(slopes: Array, basis: Array, rest: Array) -> Iterator[tuple[float, float, float, Array]]:
    """Of each model of the noise, white noise first: logarithm of its likelihood but for a constant, variance, how many
    samples of a mean count as one, and the covariance of ``J' noise`` by the variance.
    """
    freedom, white = len(rest) - basis.shape[1], slopes.T @ slopes
    variance = float(rest @ rest) / freedom
    yield -0.5 * freedom * float(np.log(variance)), variance, 1.0, white
    for r in _correlations(len(rest)):
        chain = _FirstOrder(r, len(rest))
        correlated = slopes.T @ chain.times(slopes)
        for share in _SHARES:
            score, variance = chain.likelihood(share, basis, rest)
            count = 1.0 - share + share * (1.0 + r) / (1.0 - r)
            yield score, variance, count, (1.0 - share) * white + share * correlated


def _correlations(count: int) -> Array:
    """Correlations of neighbours, of correlation times that so many samples can show."""
    if count < _FEWEST:
        return np.zeros(0)
    doublings = np.arange(np.floor(np.log2(_LONGEST * count / _SHORTEST)) + 1.0)
    return np.asarray(np.exp(-1.0 / (_SHORTEST * 2.0**doublings)))


class _FirstOrder:
    """Correlation matrix ``R = r^|i - k|`` of noise of first order, by its inverse T, which has three diagonals.

    Args:
        r: correlation of neighbours, between 0 and 1. count: samples n.
    """

    def __init__(self, r: float, count: int) -> None:
        self._diagonals = np.zeros((2, count))
        self._diagonals[0, 1:] = -r / (1.0 - r * r)
        self._diagonals[1] = (1.0 + r * r) / (1.0 - r * r)
        self._diagonals[1, [0, -1]] = 1.0 / (1.0 - r * r)
        self._log_size = (count - 1) * np.log(1.0 - r * r)

    def times(self, columns: Array) -> Array:
        """R times columns, shape (n, k)."""
        return np.asarray(scipy.linalg.solveh_banded(self._diagonals, columns))

    def likelihood(self, share: float, basis: Array, rest: Array) -> tuple[float, float]:
        """Logarithm of the restricted likelihood at its best variance, but for a constant, and that variance.

        ``V = R S`` with ``S = q I + (1 - q) T``.
        """
        whole = (1.0 - share) * self._diagonals
        whole[1] += share
        factor = scipy.linalg.cholesky_banded(whole)
        columns = np.column_stack([basis, rest])
        solved = scipy.linalg.cho_solve_banded((factor, False), self._inverse_times(columns))
        products = columns.T @ solved
        normal, mixed = products[:-1, :-1], products[:-1, -1]
        freedom = len(rest) - len(mixed)
        variance = float(products[-1, -1] - mixed @ np.linalg.solve(normal, mixed)) / freedom
        size = self._log_size + 2.0 * float(np.log(factor[1]).sum()) + float(np.linalg.slogdet(normal)[1])
        return -0.5 * (freedom * np.log(variance) + size), variance

    def _inverse_times(self, columns: Array) -> Array:
        """T times columns, shape (n, k)."""
        beside, own = self._diagonals[0, 1:, None], self._diagonals[1, :, None]
        found = own * columns
        found[1:] += beside * columns[:-1]
        found[:-1] += beside * columns[1:]
        return found
