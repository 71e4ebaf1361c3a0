"""Limits of a locomotive's effort: magnitude, power, rate. Pure functions on numbers, batches and traced symbols."""

from __future__ import annotations

import numpy as np

from plant_models.hybrid import Array


def traction_limit(speed: Array, effort_limit: Array, power_limit: Array) -> Array:
    """Largest traction effort, ``min(effort_limit, power_limit / |speed|)`` [N].

    Args:
        speed: speed of the wheel's rim [m/s]. effort_limit: [N], > 0. power_limit: [W], > 0.

    Source: 350 kN and 4.2 MW of the BB27000, Bouchama 2024, section 4.1; that they form the envelope is ours.
    """
    # Above power_limit / effort_limit the hyperbola of constant power is lower than the effort limit, below it is never
    # reached.
    return power_limit / np.maximum(np.abs(speed), power_limit / effort_limit)


def electric_brake_limit(speed: Array, brake_limit: Array, fade_start: Array, fade_end: Array) -> Array:
    """Largest electric brake effort [N], positive: constant, and fading linearly to nothing at low speed.

    Args:
        speed: [m/s]. brake_limit: [N]. fade_start: speed at which it begins to fade [m/s]. fade_end: speed at and below
            which there is none [m/s]; with ``fade_start <= fade_end`` the brake breaks off there.
    """
    width = np.maximum(fade_start - fade_end, 1e-9)
    return brake_limit * np.clip((np.abs(speed) - fade_end) / width, 0.0, 1.0)
