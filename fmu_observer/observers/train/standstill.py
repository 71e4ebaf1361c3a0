"""What a train observer may learn while the train stands: nothing. Pure functions, the one place for all of them.

Dry friction takes up any force that is smaller: a train that stands shows an interval of forces and no force, and an
innovation of zero shows nothing of the integrators behind it. So a disturbance keeps its value, its rate fades, and
neither a covariance nor a gain grows by the time that passes, until the estimate or the reading moves.
"""

from __future__ import annotations

import numpy as np

from plant_models.hybrid import Array, warning_output

_ROLL_BACK = 0.3  # [m/s] [ours]: what a wheel must turn backwards for to be no noise: six deviations of 0.05 m/s
_FADING = 1.0  # [1/s] [ours]: of a disturbance's rate at standstill, where an observer has no rate of its own for it

ROLLS_BACK = warning_output(
    "rolls_back",
    "1 while the odometer says that the train rolls back",
    "the train rolls back: an observer whose speed follows its model alone does not, for nothing that it is told "
    "drives a train backwards; compare position and speed with the odometer's",
    ("position", "speed"),
    variability="continuous",
)


def rolls_back(reading: Array) -> Array:
    """Value of `ROLLS_BACK`.

    Args:
        reading: of the odometer, negative where its wheel turns backwards [m/s].
    """
    return np.where(reading < -_ROLL_BACK, 1.0, 0.0)


def stands(speed: Array, reading: Array = 0.0, tolerance: Array = 0.0) -> Array:
    """1 where the observed train is held by its friction and its odometer shows no motion either.

    Both are asked: an estimate that a wrong disturbance holds beside a wheel that turns must learn, and so must one
    that moves beside a wheel that stands.

    Args:
        speed: estimate, exactly zero where dry friction holds it [m/s]. reading: of the odometer [m/s].
        tolerance: what a wheel that stands may read [m/s].
    """
    return np.where(speed == 0.0, np.where(np.abs(reading) <= tolerance, 1.0, 0.0), 0.0)


def held_disturbance(
    standing: Array, drift: Array, rate_drift: Array, rate: Array, fading: Array = _FADING
) -> tuple[Array, Array]:
    """Derivatives of a disturbance [m/s3] and of its rate [m/s4]: their own, or those at standstill.

    Args:
        standing: from `stands`. drift, rate_drift: of a train that moves. rate: of the disturbance [m/s3].
        fading: how fast it fades at standstill [1/s].
    """
    return np.where(standing > 0.0, 0.0, drift), np.where(standing > 0.0, -fading * rate, rate_drift)
