"""Speed of the wind at the turbine: a course of the mean, a sine, and turbulence. Knows only the hybrid foundation."""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_models.hybrid import Array, HybridSystem, PeriodicEvent, memory, output_signal, parameter, standard_normal


class Wind(HybridSystem):
    """Wind speed ``m(t) + a sin(w t) + d``, never below zero; m goes linearly from `mean_from` to `mean_to`.

    The turbulence d is a first-order Gauss-Markov process, stationary from the first instant on. The recorded wind of
    the benchmark (Fig. 7.2 of the thesis) is not available: **both presets are stand-ins**.

    Presets: `benchmark_script` (default), ``9 + 4 sin(0.01 t)``, which the script of the benchmark has in place of the
    recording; `synthetic`, from 9 to 14 m/s in 4400 s with a sine of 3 m/s and turbulence of 1.2 m/s over 20 s [ours].

    Source: Omar 2012, section 7.2.1; the stand-ins are not from the thesis.
    """

    name = "wind"
    description = "Wind speed, stand-in for a recording: mean, sine and turbulence"
    source = "stand-in for Omar 2012, Fig. 7.2"
    internal_step = 1e-2  # nothing flows
    states = (
        memory("turbulence", "m/s", 0.0, "Turbulent part of the wind at the last instant"),
        memory("gusts", "1", 0.0, "Instants so far"),
    )
    outputs = (output_signal("wind_speed", "m/s", "Speed of the wind at the hub", display_unit="km/h"),)
    parameters = (
        parameter("mean_from", "m/s", 9.0, "Mean at the start", min=0.0, display_unit="km/h"),
        parameter("mean_to", "m/s", 9.0, "Mean after `mean_time`", min=0.0, display_unit="km/h"),
        parameter("mean_time", "s", 4400.0, "Time in which the mean changes", min=1e-3),
        parameter("sine_amplitude", "m/s", 4.0, "Amplitude a of the sine", display_unit="km/h"),
        parameter("sine_frequency", "rad/s", 0.01, "Angular frequency w of the sine", min=0.0),
        parameter("turbulence_std", "m/s", 0.0, "Standard deviation of the turbulence", min=0.0, display_unit="km/h"),
        parameter("turbulence_time", "s", 20.0, "Time constant of the turbulence", min=1e-3),
        parameter("sample_period", "s", 0.01, "Time between two changes of the turbulence", min=1e-6),
    )
    events = (
        PeriodicEvent(
            "gust",
            "sample_period",
            noises=(standard_normal("gust_noise", "Standard normal number of this gust"),),
            description="The turbulence changes",
        ),
    )
    presets = {
        "benchmark_script": {},
        "synthetic": {"mean_to": 14.0, "sine_amplitude": 3.0, "turbulence_std": 1.2},
    }
    default_preset = "benchmark_script"

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """The next value of the turbulence, and one instant more."""
        kept = np.where(x.gusts > 0.0, np.exp(-p.sample_period / p.turbulence_time), 0.0)  # the first is drawn afresh
        turbulence = kept * x.turbulence + np.sqrt(1.0 - kept * kept) * p.turbulence_std * u.gust_noise
        return {"turbulence": turbulence, "gusts": x.gusts + 1.0}

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        mean = p.mean_from + (p.mean_to - p.mean_from) * np.clip(t / p.mean_time, 0.0, 1.0)
        swinging = mean + p.sine_amplitude * np.sin(p.sine_frequency * t)
        return {"wind_speed": np.maximum(swinging + x.turbulence, 0.0)}
