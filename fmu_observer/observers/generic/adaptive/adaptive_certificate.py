"""What is left of the errors of an adaptive observer after a while, exactly, by the covariance that it carries itself.

Its errors obey a linear equation that no measurement enters, so one run without measurements tells it for all of them.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from plant_models.hybrid import HybridSystem, Runtime, scalar_names

HORIZON = 40.0  # [s]; the second regressor of the printed example has faded long before
COARSE = 0.01  # [s], internal step: RK4 of frequencies of 20 rad/s to 1e-5
LEFT = 0.02  # share of the first error that may be left in the states
LAST_PART = 0.8  # of the horizon; what is left after it counts


class Left(NamedTuple):
    """Shares of the first error that are left, as root mean squares over errors that are equally likely at the start.

    Args:
        states: largest over the last fifth of the horizon. constants: of each unknown constant, at its end.
    """

    states: float
    constants: tuple[float, ...]


def errors_left(observer: Any, parameters: np.ndarray, period: float) -> Left:
    """Errors after `HORIZON`, samples coming each `period`, inputs at their starts, no noise.

    Args:
        observer: an `AdaptiveObserver`. parameters: shape (k,). period: between two samples [s].
    """
    system: HybridSystem = observer
    n, m = observer.sizes[:2]
    runtime = Runtime(system)
    runtime.p[:] = parameters
    names = scalar_names(system.parameter_signals)
    runtime.p[names.index("noise_deviation")] = 0.0
    runtime.p[names.index("internal_step")] = max(runtime.p[names.index("internal_step")], COARSE)
    places = [i for i, name in enumerate(scalar_names(system.states)) if name.startswith("error_covariance")]
    size = observer.sizes.error
    diagonal = [places[i * size - i * (i - 1) // 2] for i in range(n + m)]
    first = float(np.sqrt(np.mean(runtime.x[diagonal])))
    runtime.start(0.0)
    count = max(int(HORIZON / period), 1)
    largest = 0.0
    with np.errstate(over="ignore", invalid="ignore"):
        for k in range(1, count + 1):
            runtime.advance(k * period)
            variances = runtime.x[diagonal]
            if not np.all(np.isfinite(runtime.x)):
                return Left(np.inf, (np.inf,) * m)
            if k > LAST_PART * count:
                largest = max(largest, float(np.mean(np.maximum(variances[:n], 0.0))))
            runtime.trigger(observer.model.event)
        constants = np.sqrt(np.maximum(runtime.x[diagonal][n:], 0.0)) / first
    return Left(float(np.sqrt(largest)) / first, tuple(map(float, constants)))
