"""Sensors that read what they measure behind a lag: the Doppler radar, and the pressure sensor of a brake cylinder.

Sensors as hybrid systems of their own; they know only the hybrid foundation.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from plant_models.hybrid import Array, HybridSystem, discrete_output, input_signal, memory, parameter, state
from plant_models.railway.sensors.sampling import sampling_event

BAR = 1e5  # [Pa]


class _LaggedSensor(HybridSystem):
    """What is measured, the only input, passes a first-order lag, the first state, and is read and held."""

    internal_step = 1e-2  # the lag is resolved
    lag_time: ClassVar[str]

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        lagged = self.states[0].name
        return {lagged: (getattr(u, self.inputs[0].name) - getattr(x, lagged)) / getattr(p, self.lag_time)}

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return {"reading": x.held_reading}


class DopplerRadar(_LaggedSensor):
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
    lag_time = "averaging_time"
    states = (
        state("averaged_speed", "m/s", 0.0, "Speed over ground, averaged over the dwell time"),
        memory("held_reading", "m/s", 0.0, "Last reading"),
    )
    inputs = (input_signal("speed", "m/s", 0.0, "Speed of the train over ground", display_unit="km/h"),)
    outputs = (discrete_output("reading", "m/s", "Radar speed, held between instants", display_unit="km/h"),)
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

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        speed = x.averaged_speed
        noise = (p.noise_share * np.abs(speed) + p.noise_std) * u.reading_noise
        return {"held_reading": np.where(np.abs(speed) < p.lowest_speed, 0.0, speed * (1.0 + p.scale_error) + noise)}


class BrakePressureSensor(_LaggedSensor):
    """Pressure in a brake cylinder, read every `sample_period` and held in between.

    ``reading = (1 + scale_error) pressure + offset + noise``, behind a lag of `response_time`, in steps of `resolution`
    and within 0 to `span`, as the converter has no more.

    Presets: `class_0_5` (default): 0.5 % of a span of 10 bar, a third of it each in offset, scale and (three standard
    deviations of) noise, and 12 bits; `ideal`.

    Source: ours; class 0.5 is usual for industrial transmitters, and the division of the error is a choice.
    """

    name = "brake_pressure_sensor"
    description = "Pressure sensor of a brake cylinder: lag, offset, scale error, noise and resolution"
    source = "Ours: an industrial transmitter of class 0.5 with 12 bits over 10 bar"
    lag_time = "response_time"
    states = (
        state("lagged_pressure", "Pa", 0.0, "Pressure behind the lag of the sensor"),
        memory("held_reading", "Pa", 0.0, "Last reading"),
    )
    inputs = (input_signal("pressure", "Pa", 0.0, "Pressure in the brake cylinder", display_unit="bar"),)
    outputs = (discrete_output("reading", "Pa", "Cylinder pressure, held between instants", display_unit="bar"),)
    parameters = (
        parameter("sample_period", "s", 0.1, "Time between two readings", min=1e-6),
        parameter("response_time", "s", 0.02, "Time constant of the sensor", min=1e-2),
        parameter("scale_error", "1", 1.7e-3, "Share by which the reading is too large", min=-1.0),
        parameter("offset", "Pa", 1700.0, "Reading without pressure"),
        parameter("noise_std", "Pa", 570.0, "Standard deviation of the noise", min=0.0),
        parameter("resolution", "Pa", 244.0, "Step of the converter; 0 for none", min=0.0),
        parameter("span", "Pa", 10.0 * BAR, "Largest reading", min=1.0, display_unit="bar"),
    )
    events = (sampling_event("The pressure is read"),)
    presets = {
        "class_0_5": {},
        "ideal": {"scale_error": 0.0, "offset": 0.0, "noise_std": 0.0, "resolution": 0.0},
    }
    default_preset = "class_0_5"

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        pressure = (1.0 + p.scale_error) * x.lagged_pressure + p.offset + p.noise_std * u.reading_noise
        seen = np.clip(pressure, 0.0, p.span)
        step = np.where(p.resolution > 0.0, p.resolution, 1.0)
        return {"held_reading": np.where(p.resolution > 0.0, np.floor(seen / step + 0.5) * step, seen)}
