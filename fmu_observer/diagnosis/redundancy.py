"""Which of several sensors of one quantity is at fault: hardware redundancy, beside the residual of a model for each.

Pure functions that trace. All of them rest on the assumption of a single fault at a time.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from plant_models.hybrid.system import Array


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


def isolate(disagree: Array, first: Array, second: Array) -> Isolation:
    """A fault of a sensor or of the system: Omar 2012, 7.5.1 (i), (7.6.9), (7.6.13).

    Sensors that disagree tell a fault of a sensor, and the model tells which. Sensors that agree tell, where both
    contradict the model, a fault of the actuator or of the system.

    Args:
        disagree: 1 where the sensors differ by more than their threshold, else 0.
        first: 1 where the residual of the model with the first sensor is above its threshold, else 0.
        second: the same with the second sensor.
    """
    both = first * second
    return Isolation(
        first * (1.0 - second) * disagree,
        second * (1.0 - first) * disagree,
        np.where(first == second, disagree, 0.0),
        both * (1.0 - disagree),
    )


def larger(disagree: Array, first: Array, second: Array) -> Isolation:
    """Like `isolate`, from the sizes of the residuals: where sensors disagree, the one with the larger residual is it.

    A fault that moves the model's state moves the residuals of both sensors; their order still tells.

    Args:
        disagree: 1 where the sensors differ by more than their threshold, else 0.
        first: residual with the first sensor, divided by its threshold [1], not negative. second: with the second.
    """
    above = np.maximum(first, second) > 1.0
    system = np.where(np.minimum(first, second) > 1.0, 1.0 - disagree, 0.0)
    decided = np.where(above, disagree, 0.0)
    is_first = np.where(first > second, decided, 0.0)
    return Isolation(is_first, decided - is_first, disagree - decided, system)


def outvoted(readings: Sequence[Array], thresholds: Sequence[Sequence[Array]]) -> list[Array]:
    """Which of three or more sensors is contradicted by all others, which agree with one another.

    Args:
        readings: of n sensors of one quantity, n at least 3.
        thresholds: n rows of n, the most that sensors i and j may differ without a fault; those with i < j count.

    Returns:
        For each sensor 1 where it alone is at fault, else 0.

    Raises:
        ValueError: there are fewer than three sensors.
    """
    n = len(readings)
    if n < 3:
        raise ValueError(f"A vote needs at least three sensors, got {n}; use isolate() or larger() with a model.")
    differ = {
        (i, j): np.where(np.abs(readings[i] - readings[j]) > thresholds[i][j], 1.0, 0.0)
        for i in range(n)
        for j in range(i + 1, n)
    }
    found = []
    for k in range(n):
        vote: Array = 1.0
        for pair, value in differ.items():
            vote = vote * (value if k in pair else 1.0 - value)
        found.append(vote)
    return found
