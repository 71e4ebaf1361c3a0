"""Limits of a locomotive's effort, magnitude, power and rate, and its blending with the air brake. Pure functions on
numbers, batches and traced symbols.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from plant_models.hybrid import Array, input_signal, parameter

ODOMETER = input_signal("odometer", "m/s", 0.0, "Odometer speed", display_unit="km/h")
TRAIN_MASS = parameter("mass", "kg", 166e3, "Mass of the train M", min=1.0)
EFFORT_RATE = parameter("effort_rate", "N/s", 68e3, "Largest rate of the effort", min=1.0)
SERVICE_DECELERATION = parameter(
    "service_deceleration", "m/s2", 0.2, "Deceleration of the reference from which air is used", min=0.0
)
HOLDING_EFFORT = parameter("holding_effort", "N", 60e3, "Brake force that holds the train at standstill", min=0.0)
DRIVE_AND_BRAKES = (
    parameter("effort_limit", "N", 350e3, "Largest traction effort", min=1.0),
    parameter("power_limit", "W", 4.2e6, "Largest traction power", min=1.0),
    parameter("electric_brake_limit", "N", 150e3, "Largest electric brake effort", min=0.0),
    parameter(
        "electric_fade_start", "m/s", 2.0, "Speed below which the electric brake fades", min=0.0, display_unit="km/h"
    ),
    parameter("electric_fade_end", "m/s", 0.5, "Speed below which it is gone", display_unit="km/h"),
    parameter("full_brake_force", "N", 164e3, "Air brake force of the whole train at demand 1; 0 for none", min=0.0),
    parameter("brake_build_up_time", "s", 1.5, "Time constant with which the air brake builds up", min=0.01),
    parameter("brake_release_time", "s", 8.0, "Time constant with which it is released", min=0.01),
)
"""Limits of the BB27000 (Bouchama 2024, section 4.1); the brakes are ours, the air brake that of `train` with 4
wagons.
"""
FOLLOWED = (
    input_signal("speed_reference", "m/s", 0.0, "Speed to be driven", display_unit="km/h"),
    input_signal("acceleration_reference", "m/s2", 0.0, "Acceleration of the reference"),
)
"""The reference that a controller of the train follows."""
PRESETS: Mapping[str, Mapping[str, Any]] = {
    "train": {},
    "single_mass": {
        "mass": 90e3,
        "full_brake_force": 0.0,
        "electric_brake_limit": 350e3,
        "electric_fade_start": 0.0,
        "electric_fade_end": -1.0,
    },
}
"""`train` for the plant of that name, 166 t; `single_mass` for `locomotive`: 90 t, no air brake, the electric one stops
it.
"""


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


def air_brake_demand(force: Array, capacity: Array, full_brake_force: Array) -> Array:
    """Demand to the air brake, 0..1, for a wanted force [N] (brake < 0); 0 where the train has no air brake.

    Args:
        force: wanted force [N]. capacity: brake force over which it is shared in proportion [N]: `full_brake_force`
            where air brakes alone, more where the electric brake takes its part.
        full_brake_force: force of the whole train's air brake at demand 1 [N], 0 for none.
    """
    demand = np.clip(-force / np.maximum(capacity, 1.0), 0.0, 1.0)
    return np.where(full_brake_force > 0.0, demand, 0.0)


def electric_part(force: Array, built_up: Array, brake_limit: Array) -> Array:
    """Electric brake effort [N] (<= 0): what the air brake has not built up yet, within the electric limit.

    So the electric brake bridges the seconds that air needs, and gives way to it.

    Args:
        force: wanted brake force [N], < 0. built_up: force of the air brake by now [N], >= 0. brake_limit: [N], >= 0.
    """
    return np.maximum(np.minimum(force + built_up, 0.0), -brake_limit)
