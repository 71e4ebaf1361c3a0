"""By when the repaired jam rules believe an odometer again, as numbers: the bounds of the theorem in
docs/theses/jam_detection.md. NumPy only; knows the rules' parameters and the error equations of their observer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, inf, log
from typing import Any

import numpy as np

from fmu_observer.certificates.gap_error import matrix_powers
from fmu_observer.certificates.matrix_exponential import small_exponential
from fmu_observer.detection.repaired_jam_rules import doubt_limit, settled_limit

_NEGLIGIBLE, _LONGEST = 1e-9, 5000  # of what is left of an error; periods until then at most


@dataclass(frozen=True)
class _RecoveryBounds:
    """What is proven of `RepairedRules` on a wheel that rolls for good.

    Attributes:
        agrees: whether agreement is guaranteed: the error at the onset and the noise are within eps' / M.
        agreement: from the instant at which the wheel rolls to the sample that believes it [s], where `agrees`, and the
            model's error grows by the disturbance bound at most, and the hold limit is not reached before.
        settles: whether the residual of a followed odometer stays small (`settled_limit`) from `settle_time` on, until
            the next stop.
        settle_time: from a restart, or a departure, to a small residual until the next stop [s]; infinite where
            it does not settle.
        any_state: from the instant at which the wheel rolls to trust for good, from whatever state and memory [s].
        steady_residual: bound of the residual of a settled estimate [m/s].
        contraction: factor by which the error falls in a period at the middle of the vertices, after long [1].
    """

    agrees: bool
    agreement: float
    settles: bool
    settle_time: float
    any_state: float
    steady_residual: float
    contraction: float


def held_position_error(held: np.ndarray | float, p: Any, onset_error: float) -> np.ndarray:
    """Bound of what the position error grows while the model runs alone [m]: ``e_0 T + delta T^2 / 2``.

    Args:
        held: how long, T [s]. p: parameters of the rules. onset_error: bound e_0 at the onset [m/s].
    """
    T = np.asarray(held)
    return np.asarray(onset_error * T + 0.5 * p.disturbance_bound * T * T)


def recovery_bounds(
    drifts: np.ndarray,
    gains: np.ndarray,
    p: Any,
    *,
    onset_error: float,
    disturbance_error: float = 1.0,
    rate_error: float = 0.2,
    curvature: float = 1e-3,
    aggregated: bool = False,
) -> _RecoveryBounds:
    """The bounds for the gains and parameters in use, the innovation held between samples.

    Args:
        drifts: ``A_1``, ``A_2`` of speed, disturbance and its rate, shape (2, 3, 3). gains: ``K_1``, ``K_2``, shape (2,
            3, 1).
        onset_error: bound of the speed error at the onset of a fault, e_0 [m/s].
        disturbance_error: bound of the error of the disturbance when the speed is last set to the odometer [m/s2].
        rate_error: bound of the error of its rate then [m/s3].
        curvature: bound of the second derivative of the true disturbance [m/s4].
        aggregated: readings are means over a period, so that the first of a rolling wheel comes a period later.
    """
    corners = np.array([float(p.odometer_noise), disturbance_error, rate_error])
    settling = _settling(_over_a_period(drifts, gains, float(p.odometer_period)), p, corners, curvature)
    return _recovery(p, onset_error, settling, float(p.odometer_period) if aggregated else 0.0)


def _recovery(p: Any, onset_error: float, settling: tuple[float, float, float], late: float) -> _RecoveryBounds:
    """The bounds of an estimate that settles so, with readings that come so much later [s]."""
    period, noise, theta = float(p.odometer_period), float(p.odometer_noise), float(doubt_limit(p) / p.residual_gain)
    steady, settle, radius = settling
    quiet = settle + float(p.settle_samples) * period
    hold = period * ceil(float(p.hold_limit) / period - 1e-9) + period
    trust = max(quiet, settle + float(p.trust_time) + period)
    return _RecoveryBounds(
        agrees=onset_error + noise <= theta,
        agreement=float(p.recover_samples) * period + late,
        settles=settle < inf,
        settle_time=settle,
        any_state=late + float(p.fault_limit) * (hold + quiet) + hold + trust,
        steady_residual=steady * float(p.residual_gain),
        contraction=radius,
    )


def estimate_noise(drifts: np.ndarray, gains: np.ndarray, p: Any) -> float:
    """Deviation of a settled estimate before a reading over that of a reading, at the middle of the vertices [1];
    infinite where the gains are unstable at the period. Noise of one reading is independent of that of the others.

    Args:
        drifts, gains, p: as in `recovery_bounds`.
    """
    error = _over_a_period(drifts, gains, float(p.odometer_period))
    radius = float(np.abs(np.linalg.eigvals(error.middle)).max())
    return inf if radius >= 1.0 else float(np.sqrt(np.sum((_powers(error.middle, radius) @ error.noise)[:, 0] ** 2)))


def _settling(error: _PeriodError, p: Any, corners: np.ndarray, curvature: float) -> tuple[float, float, float]:
    """Bound of the steady speed error [m/s], time until the residual of any start within the corners is small from then
    on [s], and the spectral radius at the middle of the vertices.

    Noise, curvature and start are taken at their worst (sums of absolute values), and so is the speed of the
    scheduling, which may be another one in each period: the error over a period is that at the middle of the vertices
    and at most a `spread` beside it, element by element, and what the spread does is summed up too.
    """
    period, noise, small = float(p.odometer_period), float(p.odometer_noise), float(settled_limit(p) / p.residual_gain)
    radius = float(np.abs(np.linalg.eigvals(error.middle)).max())
    if radius >= 1.0:
        return inf, inf, radius
    powers = _powers(error.middle, radius)
    sums = np.abs(powers).sum(axis=0)
    loop = sums @ error.spread
    if float(np.abs(np.linalg.eigvals(loop)).max()) >= 1.0:
        return inf, inf, radius
    # The drag is that of the reading, the train's that of its speed: they part during a period.
    unlike = (
        abs(float(p.davis_c) / float(p.mass)) * float(p.schedule_max) * (float(p.acceleration_limit) * period + noise)
    )
    inputs = np.abs(powers @ error.noise).sum(axis=0) + sums @ error.noise_spread
    driven = noise * inputs + sums @ (curvature * error.curvature + unlike * error.drag)
    closed = np.linalg.inv(np.eye(3) - loop)
    steady = noise + float((closed @ driven)[0])
    left = _decay(powers, error.spread, corners)
    tail = float((closed @ np.abs(powers).max(axis=0) @ left[-1])[0])  # of all that comes after the last period
    if steady + tail >= small:
        return steady, inf, radius
    above = np.flatnonzero(left[:, 0] > small - steady)
    return steady, period * (int(above[-1]) + 1 if above.size else 0), radius


@dataclass(frozen=True)
class _PeriodError:
    """The error over a period, for any speed between the vertices.

    Attributes:
        middle: transition at the middle, shape (3, 3). spread: by how much it may differ, shape (3, 3).
        noise: effect of the reading's noise at the middle, shape (3,). noise_spread: by how much it may differ.
        curvature, drag: largest effects of the disturbance's second derivative and of an acceleration, shape (3,).
    """

    middle: np.ndarray
    spread: np.ndarray
    noise: np.ndarray
    noise_spread: np.ndarray
    curvature: np.ndarray
    drag: np.ndarray


def _over_a_period(drifts: np.ndarray, gains: np.ndarray, period: float) -> _PeriodError:
    """``e(+) = (Phi - Gamma K c) e``, with the speed held over the period and anything between the vertices.

    ``A(z)`` differs in its first element only, and all elements of ``Phi = e^{A h}`` and of its integral ``Gamma`` are
    monotone in that: their values at the vertices enclose them. K lies between those of the vertices.
    """
    flows, integrals = [], []
    for A in drifts:
        generator = np.zeros((6, 6))
        generator[:3, :3], generator[:3, 3:] = A, np.eye(3)
        flown = small_exponential(generator * period)
        flows.append(flown[:3, :3])
        integrals.append(flown[:3, 3:])
    flow, flow_spread = _enclosed(flows)
    integral, integral_spread = _enclosed(integrals)
    gain, gain_spread = _enclosed([K[:, 0] for K in gains])
    noise = integral @ gain
    noise_spread = integral_spread @ (np.abs(gain) + gain_spread) + np.abs(integral) @ gain_spread
    middle, spread = flow.copy(), flow_spread.copy()
    middle[:, 0] -= noise
    spread[:, 0] += noise_spread
    largest = np.abs(integral) + integral_spread
    return _PeriodError(middle, spread, noise, noise_spread, largest[:, 2], largest[:, 0])


def _enclosed(pair: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Middle of two, and half of their distance."""
    return 0.5 * (pair[0] + pair[1]), 0.5 * np.abs(pair[1] - pair[0])


def _powers(transition: np.ndarray, radius: float) -> np.ndarray:
    """``F^k`` for k = 0 .. until it has vanished, shape (count, 3, 3)."""
    count = min(int(log(_NEGLIGIBLE) / log(max(radius, 1e-3))) + 1, _LONGEST)
    return np.concatenate([np.eye(3)[None], matrix_powers(transition, count)])


def _decay(powers: np.ndarray, spread: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Bound of what is left of every start within the corners, shape (count, 3):
    ``b_k = |F^k| b_0 + sum_j |F^(k-1-j)| spread b_j``.
    """
    sizes = np.abs(powers)
    left = sizes @ corners
    for k in range(1, len(left)):
        left[k] += np.einsum("jab,jb->a", sizes[k - 1 :: -1], left[:k] @ spread.T)
    return np.asarray(left)
