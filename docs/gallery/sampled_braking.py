"""A braking on set C seen by an observer that reads the odometer at a period: section 4.3.4 of Aguiar Cota 2019."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from fmu_observer.certificates.bounds import improved_dmo_bound
from fmu_observer.observers.train.held_odometer_observer import HeldOdometerObserver
from plant_models.hybrid import Runtime, scalar_names

W0, W1, W2 = 0.0852, 0.04, -5e-5  # set C
XI, SLOWEST = 1.7, 1.0  # [m/s2], [m/s]


@dataclass(frozen=True)
class Braking:
    """What is seen at the samples, each array of shape (samples,).

    Attributes:
        instants: [s]. bounds: i-DMO bound just before the next sample, from the error of this one. errors: norm of the
            error of speed, disturbance and its rate. speed, disturbance: relative errors [1].
    """

    instants: np.ndarray
    bounds: np.ndarray
    errors: np.ndarray
    speed: np.ndarray
    disturbance: np.ndarray


def braking(observer: HeldOdometerObserver, preset: str, period: float = 0.2, brake: float = -1.0) -> Braking:
    """From 14 m/s down to 1 m/s; the brake begins at the first sample.

    Args:
        observer: DMO or CDO. preset: of it, for set C. period: of the odometer [s]. brake: effort by mass [m/s2].
    """

    def slowing(_: float, v: float) -> float:
        return brake - W0 - W1 * v - W2 * v * v

    numbers = observer.error_bounds({"odometer_period": period}, preset=preset)
    runtime = Runtime(observer)
    runtime.p[:] = observer.start_parameters(preset)
    runtime.p[scalar_names(observer.parameters).index("odometer_period")] = period
    names = scalar_names(observer.input_signals)
    motion = solve_ivp(slowing, (0.0, 20.0), [14.0], rtol=1e-9, atol=1e-10, dense_output=True)
    runtime.x[1:4] = 14.1, 0.0, 0.0
    runtime.u[names.index("effort")] = brake
    rows = []
    for k in range(int(20.0 / period)):
        v = float(motion.sol(period * k)[0])
        if v < SLOWEST:
            break
        runtime.u[names.index("odometer")] = v
        if k:
            runtime.advance(period * k)
        else:
            runtime.start(0.0)
        true = np.array([v, W0 + W2 * v * v, 2.0 * W2 * v * slowing(0.0, v)])
        wrong = np.abs(true - runtime.x[1:4])
        norm = float(np.linalg.norm(wrong))
        bound = float(improved_dmo_bound(period, norm, numbers.beta, numbers.m, numbers.gain, XI))
        rows.append((period * k, bound, norm, wrong[0] / v, wrong[1] / abs(true[1])))
    return Braking(*np.transpose(rows))
