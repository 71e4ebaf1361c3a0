"""What controllers must know of the drive and the brakes they command: parameters, and presets for the two plants. Data
only.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from plant_models.hybrid import parameter

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
