"""Slip ratios: the same sliding speed over two different denominators. Pure functions, no state."""

from __future__ import annotations

import numpy as np

from plant_models.hybrid import Array


def speed_slip(odometer: Array, speed: Array, floor: Array) -> Array:
    """Slip relative to the train speed, ``(r w - v) / max(|v|, floor)``: Bouchama 2024, (3.13), guarded.

    Args:
        odometer: wheel circumferential speed r w [m/s]. speed: train speed v [m/s].
        floor: smallest denominator [m/s], > 0; at and below it the slip is relative to the floor.

    Returns:
        Slip ratio [1]; positive when the wheel runs ahead of a train that moves forward.
    """
    return (odometer - speed) / np.maximum(np.abs(speed), floor)


def odometer_slip(odometer: Array, speed: Array, floor: Array) -> Array:
    """Slip relative to the odometer speed, ``(y - v) / max(|y|, floor)``: Bouchama 2024, (3.49) and (4.14), guarded.

    Without the guard it diverges at wheel lock (y = 0). A slip of 35 % here is 54 % by (3.13).

    Args:
        odometer: odometer speed y = r w [m/s]. speed: train speed, true or estimated [m/s].
        floor: smallest denominator [m/s], > 0.

    Returns:
        Slip ratio [1]; at wheel lock ``-v / floor``.
    """
    return (odometer - speed) / np.maximum(np.abs(odometer), floor)


def odometer_slip_from_speed_slip(speed_slip_ratio: Array) -> Array:
    """(3.49) from (3.13): ``l / (1 + l)`` [1], for a turning wheel (l > -1) and speeds above the guards.

    Args:
        speed_slip_ratio: ``(r w - v) / v`` [1].
    """
    return speed_slip_ratio / (1.0 + speed_slip_ratio)


def speed_slip_from_odometer_slip(odometer_slip_ratio: Array) -> Array:
    """(3.13) from (3.49): ``l / (1 - l)`` [1], for a moving train (l < 1) and speeds above the guards.

    Args:
        odometer_slip_ratio: ``(r w - v) / (r w)`` [1].
    """
    return odometer_slip_ratio / (1.0 - odometer_slip_ratio)
