"""Smoothing over a recording: a filter runs to the end, and what came later corrects what was believed before.

The smoother of Rauch, Tung and Striebel, AIAA Journal 3 (1965) 1445, for linear, extended and unscented filters alike:
what it needs of a filter is each transition's cross covariance. Plain NumPy over whole recordings, nothing that traces.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fmu_observer.formulas.filtering import unscented
from fmu_observer.formulas.filtering.kalman import (
    Corrected,
    correct,
    log_likelihood,
    normalised_square,
    predicted_covariance,
    symmetric,
)
from fmu_observer.formulas.filtering.square_root import factor

Transition = Callable[[int, np.ndarray], tuple[np.ndarray, np.ndarray]]
"""(number k of the step, state of shape (n,)) -> state one step later, and its Jacobian of shape (n, n)."""
Measured = Callable[[int, np.ndarray], tuple[np.ndarray, np.ndarray]]
"""(number k of the sample, state of shape (n,)) -> measurements of shape (q,), and their Jacobian of shape (q, n)."""

_Predicted = tuple[np.ndarray, np.ndarray, np.ndarray]
_Updated = tuple[np.ndarray, np.ndarray, float, int, float]


@dataclass(frozen=True)
class _FilterPass:
    """A filter's way through a recording of N samples.

    Attributes:
        estimates: after each sample, shape (N, n). covariances: of them, shape (N, n, n).
        predictions: before each sample, shape (N, n). predicted: their covariances, shape (N, n, n).
        crosses: covariance of the state after sample k - 1 and its prediction for sample k, shape (N, n, n); zero at 0.
        nis: normalised innovation squared of each sample, shape (N,), NaN without a measurement.
        degrees: measurements used at each sample, shape (N,).
        log_likelihood: of all innovations.
    """

    estimates: np.ndarray
    covariances: np.ndarray
    predictions: np.ndarray
    predicted: np.ndarray
    crosses: np.ndarray
    nis: np.ndarray
    degrees: np.ndarray
    log_likelihood: float


@dataclass(frozen=True)
class _Smoothed:
    """Estimates that know the whole recording.

    Attributes:
        estimates: shape (N, n). covariances: shape (N, n, n).
    """

    estimates: np.ndarray
    covariances: np.ndarray

    @property
    def deviations(self) -> np.ndarray:
        """Standard deviations of the states, shape (N, n)."""
        return np.asarray(np.sqrt(np.maximum(np.einsum("kii->ki", self.covariances), 0.0)))


def smooth(passed: _FilterPass) -> _Smoothed:
    """Correct every estimate by all that was measured after it, from the end backwards.

    ``G = cross inv(P(k+1|k))``, ``x(k) + G (xs(k+1) - x(k+1|k))``, ``P(k) + G (Ps(k+1) - P(k+1|k)) G'``. Where a
    predicted covariance is singular, its pseudo-inverse is taken.

    Args:
        passed: of a filter.

    Returns:
        The last estimate is the filter's own.
    """
    estimates, covariances = passed.estimates.copy(), passed.covariances.copy()
    for k in range(len(estimates) - 2, -1, -1):
        gain = _right_divided(passed.crosses[k + 1], passed.predicted[k + 1])
        estimates[k] += gain @ (estimates[k + 1] - passed.predictions[k + 1])
        covariances[k] += gain @ (covariances[k + 1] - passed.predicted[k + 1]) @ gain.T
        covariances[k] = symmetric(covariances[k])
    return _Smoothed(estimates, covariances)


def extended_pass(
    start: np.ndarray,
    P: np.ndarray,
    transition: Transition,
    QN: np.ndarray | Sequence[np.ndarray],
    measured: Measured,
    RN: np.ndarray | Sequence[np.ndarray],
    samples: np.ndarray,
    gate: float | np.ndarray = np.inf,
    limit: float | np.ndarray = np.inf,
) -> _FilterPass:
    """The extended Kalman filter over a recording; for constant Jacobians the linear one.

    Args:
        start: estimate before the first sample, shape (n,). P: covariance of it, shape (n, n).
        transition: from sample k to k + 1, with its Jacobian. measured: what sample k measures, with its Jacobian.
        QN: covariance of the process noise, shape (n, n), or one a transition, shape (N - 1, n, n).
        RN: covariance of the measurements, shape (q, q), or one a sample, shape (N, q, q).
        samples: measurements, shape (N, q); NaN where one is missing.
        gate: a measurement more than so many standard deviations off its prediction is left out; one number, or one a
            measurement, shape (q,). limit: the same in the unit of the measurement.
    """
    Q, R = np.asarray(QN), np.asarray(RN)

    def predict(k: int, x: np.ndarray, covariance: np.ndarray) -> _Predicted:
        moved, F = transition(k, x)
        ahead = predicted_covariance(covariance, F, Q[k] if Q.ndim == 3 else Q)
        return moved, np.asarray(ahead), covariance @ F.T

    def update(k: int, x: np.ndarray, covariance: np.ndarray) -> _Updated:
        noise = R[k] if R.ndim == 3 else R
        return _extended_update(x, covariance, samples[k], measured(k, x), noise, (gate, limit))

    return _passed(start, P, predict, update, len(samples))


def _extended_update(
    x: np.ndarray,
    covariance: np.ndarray,
    sample: np.ndarray,
    expected: tuple[np.ndarray, np.ndarray],
    noise: np.ndarray,
    limits: tuple[float | np.ndarray, float | np.ndarray],
) -> _Updated:
    """After a sample, of what was expected of it with its Jacobian, and with gate and limit."""
    y, H = expected
    used = _used(sample - y, np.diag(H @ covariance @ H.T + noise), *limits)
    if not used.any():
        return _unchanged(x, covariance)
    innovation = (sample - y)[used]
    return _updated(correct(x, covariance, innovation, H[used], noise[np.ix_(used, used)]), innovation)


def unscented_pass(
    start: np.ndarray,
    P: np.ndarray,
    transition: Callable[[int, np.ndarray], np.ndarray],
    QN: np.ndarray,
    measured: Callable[[int, np.ndarray], np.ndarray],
    RN: np.ndarray,
    samples: np.ndarray,
    alpha: float = 1.0,
    beta: float = 2.0,
    kappa: float = 0.0,
) -> _FilterPass:
    """The unscented Kalman filter over a recording, points drawn again for the measurement.

    Args:
        start: estimate before the first sample, shape (n,). P: covariance of it, shape (n, n).
        transition: state of sample k + 1 from that of sample k. measured: what sample k measures, shape (q,).
        QN: covariance of the process noise, shape (n, n). RN: of the measurements, shape (q, q).
        samples: measurements, shape (N, q); a sample with a NaN is left out as a whole.
        alpha, beta, kappa: of the sigma points, see `filtering.unscented.weights`.

    Returns:
        The pass; `smooth` makes it the unscented smoother of Sarkka, IEEE TAC 53 (2008) 845.
    """
    w = unscented.weights(len(start), alpha, beta, kappa)

    def predict(k: int, x: np.ndarray, covariance: np.ndarray) -> _Predicted:
        before, after = _scattered(x, covariance, lambda at: transition(k, at), w)
        ahead = symmetric(unscented.covariance(after, after, w)) + QN
        return unscented.mean(after, w), ahead, unscented.covariance(before, after, w)

    def update(k: int, x: np.ndarray, covariance: np.ndarray) -> _Updated:
        return _unscented_update(x, covariance, samples[k], lambda at: measured(k, at), RN, w)

    return _passed(start, P, predict, update, len(samples))


def _unscented_update(
    x: np.ndarray,
    covariance: np.ndarray,
    sample: np.ndarray,
    measured: Callable[[np.ndarray], np.ndarray],
    noise: np.ndarray,
    w: unscented.Weights,
) -> _Updated:
    if not np.isfinite(sample).all():
        return _unchanged(x, covariance)
    states, seen = _scattered(x, covariance, measured, w)
    after = unscented.correct(x, covariance, states, seen, sample, noise, w)
    return _updated(after, sample - unscented.mean(seen, w))


def _scattered(
    x: np.ndarray, covariance: np.ndarray, function: Callable[[np.ndarray], np.ndarray], w: unscented.Weights
) -> tuple[unscented.Scattered, unscented.Scattered]:
    """Sigma points of an estimate, and a function at them."""
    points = unscented.sigma_points(x, factor(covariance), w.spread)
    return unscented.scattered(lambda at: at, points), unscented.scattered(function, points)


def _unchanged(x: np.ndarray, covariance: np.ndarray) -> _Updated:
    """Where nothing was measured."""
    return x, covariance, np.nan, 0, 0.0


def _updated(after: Corrected, innovation: np.ndarray) -> _Updated:
    """What a correction leaves, with the measures of its innovation."""
    S = after.innovation_covariance
    square, likelihood = normalised_square(innovation, S), log_likelihood(innovation, S)
    return after.estimate, after.covariance, float(square), len(innovation), float(likelihood)


def _passed(
    start: np.ndarray, P: np.ndarray, predict: Callable[..., _Predicted], update: Callable[..., _Updated], count: int
) -> _FilterPass:
    n = len(start)
    estimates, predictions = np.empty((count, n)), np.empty((count, n))
    covariances, predicted, crosses = (np.zeros((count, n, n)) for _ in range(3))
    nis, degrees, likelihood = np.full(count, np.nan), np.zeros(count, dtype=int), 0.0
    x, covariance = np.asarray(start, dtype=float), np.asarray(P, dtype=float)
    for k in range(count):
        if k > 0:
            x, covariance, crosses[k] = predict(k - 1, x, covariance)
        predictions[k], predicted[k] = x, covariance
        x, covariance, nis[k], degrees[k], gained = update(k, x, covariance)
        estimates[k], covariances[k] = x, covariance
        likelihood += gained
    return _FilterPass(estimates, covariances, predictions, predicted, crosses, nis, degrees, likelihood)


def _used(
    innovation: np.ndarray, variances: np.ndarray, gate: float | np.ndarray, limit: float | np.ndarray
) -> np.ndarray:
    """Which measurements are there and near enough, shape (q,)."""
    with np.errstate(invalid="ignore"):
        near = np.abs(innovation) <= np.minimum(gate * np.sqrt(variances), limit)
    return np.asarray(np.isfinite(innovation) & near)


def _right_divided(cross: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """``cross inv(covariance)``."""
    try:
        return np.asarray(np.linalg.solve(covariance, cross.T).T)
    except np.linalg.LinAlgError:
        return np.asarray(cross @ np.linalg.pinv(covariance, hermitian=True))
