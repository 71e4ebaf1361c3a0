"""The wheel odometer: a sampled reading of the wheel's speed, with noise and tooth quantisation.

A sensor as a hybrid system of its own; knows only the hybrid foundation.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_models.hybrid import Array, HybridSystem
from plant_models.hybrid.signal import discrete_output, input_signal, memory, output_signal, parameter, state
from plant_models.railway.sensors.pulses import counted_pulses, pulse_length, pulses_in_window, reading_bound
from plant_models.railway.sensors.sampling import sampling_event


class Odometer(HybridSystem):
    """Reading of the wheel speed at the instants ``start + sample_offset + k * sample_period``, held in between.

    Without noise and teeth the reading is exactly `wheel_speed` at the instant. With `teeth` pulses a revolution it is
    the number of pulses counted since the last instant, times the length of a pulse, over the period; the first
    reading, which has no window behind it, is that of a wheel that had turned steadily. `noise_std` times a standard
    normal number, drawn afresh at every instant, is added to it: the disturbance ``d`` of (3.16).

    One pulse in one period is a speed of ``2 pi r / (teeth sample_period)``: 0.36 m/s for 100 teeth at 10 Hz, ten times
    that at 100 Hz. The input is held between communication points, so the counted distance is the sum of wheel speed
    times communication step. In slip, reading and distance are those of the wheel, not of the train.

    Presets: `ideal` (default), `10_hz` (the sampled odometer of (3.50)), `pulses` (100 teeth at 10 Hz).

    Source: Bouchama 2024, (3.16) and (3.50); the quantisation is ours.
    """

    name = "odometer"
    description = "Wheel odometer: sampled wheel speed with noise and tooth quantisation"
    source = "Bouchama 2024, (3.16), (3.50)"
    internal_step = 1e-2  # the flow is exact for a held input, whatever the step
    states = (
        state("wheel_distance", "m", 0.0, "Distance run by the wheel's rim"),
        memory("held_reading", "m/s", 0.0, "Last reading"),
        memory("counted_pulses", "1", 0.0, "Pulses counted up to the last instant"),
        memory("primed", "1", 0.0, "1 after the first instant"),
    )
    inputs = (input_signal("wheel_speed", "m/s", 0.0, "Circumferential speed of the wheel", display_unit="km/h"),)
    outputs = (
        discrete_output("reading", "m/s", "Odometer speed, held between instants", display_unit="km/h"),
        output_signal("distance", "m", "Odometer distance since the start, in whole pulses where there are teeth"),
    )
    parameters = (
        parameter("sample_period", "s", 0.01, "Time between two readings", min=1e-6),
        parameter("sample_offset", "s", 0.0, "Time of the first reading after the start", min=0.0),
        parameter("noise_std", "m/s", 0.0, "Standard deviation of the reading's noise", min=0.0, display_unit="km/h"),
        parameter("teeth", "1", 0.0, "Pulses in one revolution; 0 for no quantisation", min=0.0),
        parameter("wheel_radius", "m", 0.575, "Radius of the wheel", min=1e-3),
    )
    events = (sampling_event("The odometer is read", "sample_offset"),)
    presets = {
        "ideal": {},
        "10_hz": {"sample_period": 0.1},
        "pulses": {"sample_period": 0.1, "teeth": 100.0},
    }
    default_preset = "ideal"

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return {"wheel_distance": u.wheel_speed}

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """Take a reading: new held reading and pulse count."""
        pulse = pulse_length(p.teeth, p.wheel_radius)
        count = counted_pulses(x.wheel_distance, pulse)
        # The first window is the one that a wheel of the present speed would have left behind.
        window = pulses_in_window(count, x.counted_pulses, x.primed, u.wheel_speed, p.sample_period, pulse)
        speed = np.where(p.teeth > 0.0, window * pulse / p.sample_period, u.wheel_speed)
        reading = speed + p.noise_std * u.reading_noise
        return {"held_reading": reading, "counted_pulses": count, "primed": 1.0}

    def reading_bound(self, output: str, p: Any) -> Array:
        """How far a reading is from the wheel's speed at most, see `pulses.reading_bound` [m/s].

        Args:
            output: its name; the distance has no such bound.
        """
        bound = reading_bound(p.noise_std, p.teeth, p.wheel_radius, p.sample_period)
        return np.where(output == "reading", bound, 0.0)

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        pulse, distance = pulse_length(p.teeth, p.wheel_radius), x.wheel_distance
        counted = np.where(p.teeth > 0.0, counted_pulses(distance, pulse) * pulse, distance)
        return {"reading": x.held_reading, "distance": counted}
