"""By when the repaired jam rules believe an odometer again, as numbers: the bounds of the theorem in
docs/jam_detection.md. NumPy only; knows the rules' parameters and the error equations of their observer.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, inf, log
from typing import Any

import numpy as np

from fmu_observer.certificates.exponential import small_exponential

SPEEDS = 9  # of the scheduling, at which the transition over a period is taken
NEGLIGIBLE, LONGEST = 1e-9, 5000  # of what is left of an error; periods until then at most


@dataclass(frozen=True)
class RecoveryBounds:
    """What is proven of `RepairedRules` on a wheel that rolls for good.

    Attributes:
        agrees: whether agreement is guaranteed: the error at the onset and the noise are within eps / M.
        agreement: from the instant at which the wheel rolls to the sample that believes it [s], where `agrees`, and the
            model's error grows by the disturbance bound at most, and the hold limit is not reached before.
        settles: whether the residual of a followed odometer stays below eps / 2 for ever, after `settle_time`.
        settle_time: from a restart to a residual below eps / 2 for ever [s]; infinite where it does not settle.
        any_state: from the instant at which the wheel rolls to trust for good, from whatever state and memory [s].
        steady_residual: bound of the residual of a settled estimate [m/s].
        contraction: largest factor by which the error falls in a period, after long [1].
    """

    agrees: bool
    agreement: float
    settles: bool
    settle_time: float
    any_state: float
    steady_residual: float
    contraction: float


def held_speed_error(held: np.ndarray | float, p: Any, onset_error: float) -> np.ndarray:
    """Bound of the speed error while the model runs alone [m/s]: ``e_0 + delta T``.

    Args:
        held: how long, T [s]. p: parameters of the rules. onset_error: bound e_0 at the onset [m/s].
    """
    return np.asarray(onset_error + p.disturbance_bound * np.asarray(held))


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
) -> RecoveryBounds:
    """The bounds for the gains and parameters in use, the innovation held between samples.

    Noise, curvature and start are taken at their worst (sums of absolute values), the speed of the scheduling as fixed
    at the worst of nine between the vertices: the printed gains differ by 1 % from vertex to vertex.

    Args:
        drifts: ``A_1``, ``A_2`` of speed, disturbance and its rate, shape (2, 3, 3). gains: ``K_1``, ``K_2``, shape (2,
            3, 1).
        p: parameters of the observer, as in `HybridSystem.flow`.
        onset_error: bound of the speed error at the onset of a fault, e_0 [m/s].
        disturbance_error: bound of the error of the disturbance when the speed is last set to the odometer [m/s2].
        rate_error: bound of the error of its rate then [m/s3].
        curvature: bound of the second derivative of the true disturbance [m/s4].
        aggregated: readings are means over a period, so that the first of a rolling wheel comes a period later.

    Returns:
        The bounds.
    """
    period, noise, theta = float(p.odometer_period), float(p.odometer_noise), float(p.threshold / p.residual_gain)
    samples, late = float(p.recover_samples), period if aggregated else 0.0
    F, G, H = _period(drifts, gains, period)
    radius = max(float(np.abs(np.linalg.eigvals(one)).max()) for one in F)
    steady, settle = inf, inf
    if radius < 1.0:
        seen = _seen(F, radius)
        on_noise, on_curvature = (
            max(float(np.abs(rows @ column).sum()) for rows, column in zip(seen, columns, strict=True))
            for columns in (G, H)
        )
        steady = noise * (1.0 + on_noise) + curvature * on_curvature
        corners = np.array([noise, disturbance_error, rate_error])
        left = np.max([np.abs(rows) @ corners for rows in seen], axis=0)  # of every start within the corners
        above = np.flatnonzero(left > 0.5 * theta - steady)
        if steady < 0.5 * theta:
            settle = period * (int(above[-1]) + 1 if above.size else 0)
    quiet = settle + float(p.settle_samples) * period
    hold = period * ceil(float(p.hold_limit) / period - 1e-9) + period
    trust = max(quiet, settle + float(p.trust_time) + period)
    return RecoveryBounds(
        agrees=onset_error + noise <= theta,
        agreement=samples * period + late,
        settles=settle < inf,
        settle_time=settle,
        any_state=late + float(p.fault_limit) * (hold + quiet) + hold + trust,
        steady_residual=steady * float(p.residual_gain),
        contraction=radius,
    )


def _period(
    drifts: np.ndarray, gains: np.ndarray, period: float
) -> tuple[list[np.ndarray], list[np.ndarray], list[np.ndarray]]:
    """Error over a period at speeds between the vertices: transition, and effects of noise and of curvature."""
    transitions, noises, curvatures = [], [], []
    for share in np.linspace(0.0, 1.0, SPEEDS):
        A, K = ((1.0 - share) * pair[0] + share * pair[1] for pair in (drifts, gains))
        generator = np.zeros((5, 5))
        generator[:3, :3], generator[:3, 3], generator[2, 4] = A, K[:, 0], 1.0
        flown = small_exponential(generator * period)
        # The estimate gets the held innovation: e(+) = Phi e - Gamma K e_1, and the noise of the reading with it.
        transition = flown[:3, :3].copy()
        transition[:, 0] -= flown[:3, 3]
        transitions.append(transition)
        noises.append(flown[:3, 3])
        curvatures.append(flown[:3, 4])
    return transitions, noises, curvatures


def _seen(transitions: list[np.ndarray], radius: float) -> list[np.ndarray]:
    """``c F^k``, c the speed, for k = 0 .. until it has vanished, shape (count, 3) for each transition."""
    count = min(int(log(NEGLIGIBLE) / log(max(radius, 1e-3))) + 1, LONGEST)
    found = []
    for F in transitions:
        rows = np.zeros((count, 3))
        rows[0, 0] = 1.0
        for k in range(1, count):
            rows[k] = rows[k - 1] @ F
        found.append(rows)
    return found
