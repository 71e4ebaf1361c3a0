"""Gains of the augmented observers: poles for position samples, certified for a gap, and what noise they pass.

Plain NumPy and SciPy, and the exact certificates; nothing of it is needed when an observer runs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, isfinite, sqrt

import numpy as np
import scipy

from fmu_observer.certificates.aperiodic import aperiodic_limit, certify_sampled_error
from fmu_observer.certificates.finding import Finding
from fmu_observer.certificates.sampled_error import SampledError

_ORDER = 4
# [ours] real, geometric mean -1; unequal ones bear longer gaps than four equal ones
UNIT_POLES = (-0.5, -0.8, -1.25, -2.0)
_HORIZON = 20.0  # [s] at unit poles


@dataclass(frozen=True)
class _PositionGains:
    """Gains of sampled positions and what is known of them.

    Attributes:
        gains: ``g_1 ... g_4`` [1/s^i], shape (4,). decay: decay rate of the innovation [1/s].
        certificate: for the gap designed for.
        noise_to_speed: standard deviation of the speed error over that of white position noise, at the design gap
        [1/s].
    """

    gains: tuple[float, ...]
    decay: float
    certificate: Finding
    noise_to_speed: float


def augmented_matrix(drag_slope: float) -> np.ndarray:
    """Matrix of ``[p, v, delta, delta']``, shape (4, 4): the shift with ``-drag_slope`` [1/s] on the speed (4.13)."""
    A = np.diag(np.ones(_ORDER - 1), 1)
    A[1, 1] = -drag_slope
    return A


def position_gains(poles: Sequence[float] | np.ndarray, drag_slope: float = 0.0) -> np.ndarray:
    """Gain L such that ``A - L C`` has the given poles, C = (1, 0, 0, 0), by Ackermann's formula, shape (4,).

    Args:
        poles: four of them [1/s], in the left half plane, equal ones allowed. drag_slope: ``(b + c v) / M`` [1/s].

    Raises:
        ValueError: not four poles, or one that is not stable.
    """
    values = np.asarray(poles)
    if values.shape != (_ORDER,) or not np.all(np.isfinite(values)) or values.real.max() >= 0.0:
        raise ValueError(
            f"position_gains: expected {_ORDER} finite poles with negative real parts [1/s], got {tuple(poles)}."
        )
    A = augmented_matrix(drag_slope)
    observability = np.stack([np.linalg.matrix_power(A, k)[0] for k in range(_ORDER)])
    polynomial = sum(c * np.linalg.matrix_power(A, _ORDER - k) for k, c in enumerate(np.real(np.poly(values))))
    return np.asarray(polynomial @ np.linalg.solve(observability, np.eye(_ORDER)[-1]))


def _sampled_errors(
    gains: Sequence[float], decay: float, drag_slopes: Sequence[float], odometer_gain: Sequence[float] = (0.0,) * _ORDER
) -> tuple[SampledError, ...]:
    """Error equations of the augmented observer, one for each drag slope [1/s]."""
    continuous = np.outer(odometer_gain, np.eye(_ORDER)[1])
    return tuple(SampledError.of((augmented_matrix(s) - continuous).tolist(), gains, decay) for s in drag_slopes)


def design_for_gap(
    max_gap: float, drag_slopes: Sequence[float] = (0.0,), margin: float = 0.1, unit_poles: Sequence[float] = UNIT_POLES
) -> _PositionGains:
    """The fastest gains with poles proportional to `unit_poles` that are certified for every mixture of gaps up to a
    limit.

    Without drag the limit is inversely proportional to the speed of the poles, so one certificate at unit poles gives
    the scale; the result is certified again with its drag. The decay is the first gain, as in (1.47).

    Args:
        max_gap: longest gap between two samples [s]. drag_slopes: ``(b + 2 c v) / M`` at its extremes [1/s].
        margin: how much longer gaps shall be certified, relative. unit_poles: four poles that set the pattern.

    Raises:
        ValueError: the gap or the margin is not positive and finite, or the pattern is not certified for any gap.
    """
    if not (isfinite(max_gap) and max_gap > 0.0 and isfinite(margin) and margin > 0.0):
        raise ValueError(f"design_for_gap: expected a positive gap [s] and margin, got {max_gap!r} and {margin!r}.")
    unit = position_gains(unit_poles)
    limit = aperiodic_limit(_sampled_errors(unit.tolist(), float(unit[0]), (0.0,)), _HORIZON)
    if limit in (0.0, inf):
        raise ValueError(
            f"design_for_gap: no gap is certified for poles like {tuple(unit_poles)}; choose better damped ones."
        )
    scale = limit / ((1.0 + margin) * max_gap)
    gains = position_gains(scale * np.asarray(unit_poles))
    errors = _sampled_errors(gains.tolist(), float(gains[0]), drag_slopes)
    certificate = certify_sampled_error(
        errors, max_gap, "four-state error of the augmented observer at the given drag slopes"
    )
    return _PositionGains(tuple(map(float, gains)), float(gains[0]), certificate, _noise_to_speed(errors[0], max_gap))


def _noise_to_speed(error: SampledError, gap: float) -> float:
    """Standard deviation of the speed error, just before a sample, over that of white noise on positions at a constant
    gap [1/s].

    Exact: the noise enters the innovation, ``e+ = Phi e - Gamma n``, and the stationary covariance solves a discrete
    Lyapunov equation; inf where the gap is unstable.
    """
    if error.spectral_radius(gap) >= 1.0:
        return inf
    transition = error.transition(gap)
    free = _free_transition(error, gap)
    from_noise = (transition - free)[:, 0]  # the innovation enters as C e does
    covariance = scipy.linalg.solve_discrete_lyapunov(transition, np.outer(from_noise, from_noise))
    return sqrt(max(float(covariance[1, 1]), 0.0))


def _free_transition(error: SampledError, gap: float) -> np.ndarray:
    silent = SampledError(error.drift, (0.0,) * error.size, error.decay)
    return silent.transition(gap)
