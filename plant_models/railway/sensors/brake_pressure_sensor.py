"""The pressure sensor of a brake cylinder: a sampled pressure with lag, errors of offset and scale, noise and digits.

A sensor as a hybrid system of its own; knows only the hybrid foundation.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_models.hybrid import Array, HybridSystem, input_signal, memory, output_signal, parameter, state
from plant_models.railway.sensors.sampling import sampling_event

BAR = 1e5  # [Pa]


class BrakePressureSensor(HybridSystem):
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
    internal_step = 1e-2
    states = (
        state("lagged_pressure", "Pa", 0.0, "Pressure behind the lag of the sensor"),
        memory("held_reading", "Pa", 0.0, "Last reading"),
    )
    inputs = (input_signal("pressure", "Pa", 0.0, "Pressure in the brake cylinder", display_unit="bar"),)
    outputs = (
        output_signal(
            "reading", "Pa", "Cylinder pressure, held between instants", variability="discrete", display_unit="bar"
        ),
    )
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

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return {"lagged_pressure": (u.pressure - x.lagged_pressure) / p.response_time}

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        pressure = (1.0 + p.scale_error) * x.lagged_pressure + p.offset + p.noise_std * u.reading_noise
        seen = np.clip(pressure, 0.0, p.span)
        step = np.where(p.resolution > 0.0, p.resolution, 1.0)
        return {"held_reading": np.where(p.resolution > 0.0, np.floor(seen / step + 0.5) * step, seen)}

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return {"reading": x.held_reading}
