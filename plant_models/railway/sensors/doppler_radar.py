"""The Doppler radar: a sampled speed over ground, with the errors of its mounting and of the ground.

A sensor as a hybrid system of its own; knows only the hybrid foundation.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_models.hybrid import Array, HybridSystem, input_signal, memory, output_signal, parameter, state
from plant_models.railway.sensors.sampling import sampling_event


class DopplerRadar(HybridSystem):
    """Speed over ground, read every `sample_period` and held in between; wheels have no part in it.

    The radar measures the mean over its dwell time, here a lag of `averaging_time`. The mounting angle makes a constant
    share `scale_error`; the ground makes noise, ``noise_share |v| + noise_std`` as standard deviation, white from
    reading to reading. Below `lowest_speed` there is too little Doppler shift and the reading is zero.

    Measured on a railway were about 1 % for the speed and 2 m in 1000 m for the distance. The 0.2 % of the distance are
    taken for the scale error, and the 1 % of the speed for two standard deviations of the noise; dwell time, floor and
    lowest speed are ours.

    Presets: `measured` (default), `ideal` (no error, read as it is but for the lag).

    Source: Schubert, Heide and Magori 1995, Microwave Doppler sensors measuring vehicle speed and travelled distance.
    """

    name = "doppler_radar"
    description = "Doppler radar: speed over ground with scale error, noise of the ground and a lowest speed"
    source = "Schubert, Heide, Magori 1995 (1 % of speed, 2 m in 1000 m); dwell time and floor are ours"
    internal_step = 1e-2  # the lag is resolved
    states = (
        state("averaged_speed", "m/s", 0.0, "Speed over ground, averaged over the dwell time"),
        memory("held_reading", "m/s", 0.0, "Last reading"),
    )
    inputs = (input_signal("speed", "m/s", 0.0, "Speed of the train over ground", display_unit="km/h"),)
    outputs = (
        output_signal(
            "reading", "m/s", "Radar speed, held between instants", variability="discrete", display_unit="km/h"
        ),
    )
    parameters = (
        parameter("sample_period", "s", 0.1, "Time between two readings", min=1e-6),
        parameter("averaging_time", "s", 0.05, "Time constant of the dwell time", min=1e-2),
        parameter("scale_error", "1", 0.002, "Share by which the mounting angle makes the reading too large", min=-1.0),
        parameter("noise_share", "1", 0.005, "Standard deviation of the noise as a share of the speed", min=0.0),
        parameter(
            "noise_std", "m/s", 0.01, "Standard deviation of the noise at standstill", min=0.0, display_unit="km/h"
        ),
        parameter("lowest_speed", "m/s", 0.1, "Speed below which the reading is zero", min=0.0, display_unit="km/h"),
    )
    events = (sampling_event("The radar is read"),)
    presets = {
        "measured": {},
        "ideal": {"scale_error": 0.0, "noise_share": 0.0, "noise_std": 0.0, "lowest_speed": 0.0},
    }
    default_preset = "measured"

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return {"averaged_speed": (u.speed - x.averaged_speed) / p.averaging_time}

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        speed = x.averaged_speed
        noise = (p.noise_share * np.abs(speed) + p.noise_std) * u.reading_noise
        return {"held_reading": np.where(np.abs(speed) < p.lowest_speed, 0.0, speed * (1.0 + p.scale_error) + noise)}

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return {"reading": x.held_reading}
