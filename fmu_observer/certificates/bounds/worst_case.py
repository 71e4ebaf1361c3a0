"""The exact worst case of an error that is driven by a held measurement: no bound, what can happen. NumPy and one
matrix exponential.

With ``de = F e + K (v(t) - y_k)`` and ``|dv| <= xi`` the error at an instant is an integral over all past
accelerations, each with its own weight; the worst acceleration is xi with the sign of the weight (bang-bang). What a
formula says beyond that is its reserve.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fmu_observer.certificates.gap_error import matrix_powers
from fmu_observer.certificates.matrix_exponential import small_exponential
from fmu_observer.models.checks import check_numbers

_POINTS, _FEWEST = 400, 8  # a period: errors of the trapezium rule are of the order 1e-6 of the result
_TOTAL = 50_000  # points altogether: for short periods fewer a period, which are closer then
_FORGOTTEN = 30.0  # time constants of the slowest pole that are taken into account


@dataclass(frozen=True, eq=False)
class WorstCase:
    """What the error can become at an instant.

    Attributes:
        error: largest size of the first component of e [m/s].
        ages: how long before that instant [s], shape (k,), ascending.
        weights: what a unit of acceleration at that age contributes [s per s], shape (k,).
        rate: xi [m/s2].
    """

    error: float
    ages: np.ndarray
    weights: np.ndarray
    rate: float

    def acceleration(self, age: float | np.ndarray) -> np.ndarray:
        """The acceleration that leads there [m/s2]: the largest, with the sign of its weight.

        Args:
            age: how long before the instant [s], any shape.
        """
        return np.asarray(self.rate * np.sign(np.interp(age, self.ages, self.weights)))


def worst_case(
    F: np.ndarray,
    K: np.ndarray,
    rate: float,
    period: float,
    since_sample: float | None = None,
    *,
    periods: int | None = None,
) -> WorstCase:
    """The largest first component of the error, over all motions with ``|dv| <= rate``, at some time after a sample.

    Args:
        F: error matrix ``A - K C``, shape (n, n), Hurwitz [1/s]. K: gain on the measurement, shape (n,).
        rate: xi, largest acceleration or deceleration [m/s2]. period: between samples [s].
        since_sample: time since the last sample [s]; longer than the period where samples are missing. None: a period.
        periods: taken into account before that gap; 0 for an error that is zero at the sample. None: until what
            was before is forgotten.

    Returns:
        The worst case with the accelerations that lead to it.

    Raises:
        ValueError: F is not Hurwitz, or a number is not legal.
    """
    gap = period if since_sample is None else since_sample
    decay = _checked_decay(F, rate, period, gap)
    count = int(np.ceil(_FORGOTTEN / (decay * period))) if periods is None else periods
    ages, weights, total = _response(F, np.asarray(K, dtype=float), period, gap, count)
    return WorstCase(rate * total, ages, weights, rate)


def _checked_decay(F: np.ndarray, rate: float, period: float, gap: float) -> float:
    """Decay of the slowest pole [1/s], of numbers that are legal."""
    check_numbers("Worst case", {"the period": period, "the time since the sample": gap}, {"the rate": rate})
    decay = -float(np.linalg.eigvals(F).real.max())
    if not decay > 0.0:
        raise ValueError(f"Worst case: the error matrix is not stable, its slowest pole is at {-decay:+.4g} 1/s.")
    return decay


def _response(
    F: np.ndarray, gain: np.ndarray, period: float, gap: float, count: int
) -> tuple[np.ndarray, np.ndarray, float]:
    """Ages [s] and weights of a unit of acceleration over a gap and `count` periods before it, shape (k,), and the
    integral of their sizes.
    """
    shape = max(_FEWEST, min(_POINTS, _TOTAL // max(count, 1)))
    last_ages, last = _weights(F, gap, max(_FEWEST, round(shape * min(gap / period, _POINTS))))
    past_ages, past = _weights(F, period, shape)
    before = small_exponential(F * gap) @ gain
    powers = matrix_powers(small_exponential(F * period), max(count, 1))
    states = np.vstack([before, powers @ before])[:count]  # of the response, at the young ends of the gaps before
    starts = gap + period * np.arange(count)
    ages = np.concatenate([last_ages, (starts[:, None] + past_ages).ravel()])
    weights = np.concatenate([last @ gain, (states @ past.T).ravel()])
    total = np.trapezoid(np.abs(last @ gain), last_ages)
    total += np.trapezoid(np.abs(states @ past.T), past_ages, axis=1).sum()
    return ages, weights, float(total)


def _weights(F: np.ndarray, length: float, points: int) -> tuple[np.ndarray, np.ndarray]:
    """Ages in a gap from its young end, shape (points + 1,), and by state the integral of the first component of the
    response up to there, shape (points + 1, n).
    """
    step = length / points
    powers = matrix_powers(small_exponential(F * step), points)
    response = np.vstack([np.eye(1, len(F)), powers[:, 0, :]])
    summed = np.cumsum(0.5 * step * (response[1:] + response[:-1]), axis=0)
    return step * np.arange(points + 1), np.vstack([np.zeros((1, len(F))), summed])
