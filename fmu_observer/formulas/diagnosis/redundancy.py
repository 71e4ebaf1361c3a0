"""Which of several sensors of one quantity is at fault: hardware redundancy, beside the residual of a model for each.

Pure functions that trace. All of them rest on the assumption of a single fault at a time.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from plant_models.hybrid import Array


class Isolation(NamedTuple):
    """What two sensors and their residuals say; each 1 or 0, at most one of them is 1.

    Attributes:
        first: the first sensor is at fault. second: the second is. undecided: one of them is, not known which.
        system: the sensors agree, and both contradict the model: actuator or system.
    """

    first: Array
    second: Array
    undecided: Array
    system: Array


def disagreement(first: Array, second: Array) -> Array:
    """``|m1 - m2|`` of two sensors of one quantity: Omar 2012, (7.6.9), (7.6.13).

    Args:
        first: reading m1. second: reading m2.
    """
    return np.abs(first - second)


def larger(disagree: Array, first: Array, second: Array) -> Isolation:
    """A fault of a sensor or of the system: Omar 2012, 7.5.1 (i), (7.6.9), (7.6.13), from the sizes of the residuals.

    Where sensors disagree, the one with the larger residual is at fault. Sensors that agree decide, where both
    contradict the model, a fault of the actuator or of the system. A fault that moves the model's state moves the
    residuals of both sensors; their order still decides.

    Args:
        disagree: 1 where the sensors differ by more than their threshold, else 0.
        first: residual with the first sensor, divided by its threshold [1], not negative. second: with the second.
    """
    above = np.maximum(first, second) > 1.0
    system = np.where(np.minimum(first, second) > 1.0, 1.0 - disagree, 0.0)
    decided = np.where(above, disagree, 0.0)
    is_first = np.where(first > second, decided, 0.0)
    return Isolation(is_first, decided - is_first, disagree - decided, system)
