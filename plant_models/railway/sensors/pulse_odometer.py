"""The pulse odometer: a toothed wheel whose pulses are counted, sampled, and handed on in aggregates.

A sensor as a hybrid system of its own; knows the hybrid foundation and the counting of pulses.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal

import numpy as np

from plant_models.hybrid import Array, HybridSystem, PeriodicEvent
from plant_models.hybrid.option import require_chosen
from plant_models.hybrid.signal import discrete_output, input_signal, memory, parameter, standard_normal, state
from plant_models.railway.sensors.pulses import counted_pulses, pulse_length, pulses_in_window, reading_bound

CountFrom = Literal["wheel_speed", "wheel_distance"]


class PulseOdometer(HybridSystem):
    """Speed ``(c_i - c_{i-1}) 2 pi r / (N_p Dt)`` from pulses counted, sampled every 50 ms, aggregated every 200 ms.

    `sampled_reading` is the speed over the last sampling period, `reading` over the last aggregation period: what the
    layers above the odometer are given. Both are held between their instants, which are ``start + k * period``. The
    quantisation is that of counting: a reading is a whole number of pulses, one of which is a speed of ``2 pi r /
    (N_p period)``, 0.145 m/s in the aggregate. Differences of counts telescope: the sum of all readings is the distance
    counted, within one pulse for ever.

    While the wheel is locked there are no pulses, so a jam of length T in a window of length Dt gives
    ``v (1 - T / Dt)`` within one pulse; a skid gives more than v. The count goes down where the wheel turns backwards.

    Args:
        count_from: ``wheel_speed``: the odometer integrates that input, which is held between communication points;
            ``wheel_distance``: it counts that input, the distance of the rim from `wheel_fault`, in which faults within
            a communication step are exact, where the period is a whole number of communication steps: between
            communication points the input is that of the point before. `wheel_speed` then serves the first reading
            only, which has no window behind it and is that of a wheel that had turned steadily.

    Raises:
        ValueError: `count_from` is unknown.

    Source: Aguiar Cota 2019, section 2.1.2 and Figs. 2-7, 2-13, 2-14; teeth and radius are ours.
    """

    name = "pulse_odometer"
    description = "Toothed wheel odometer: counted pulses, sampled at 50 ms and aggregated at 200 ms"
    source = "Aguiar Cota 2019, section 2.1.2; teeth and radius are ours"
    internal_step = 1e-2  # the flow is exact for a held input, whatever the step
    bounded_parameters = "all"
    outputs = (
        discrete_output("reading", "m/s", "Speed over the last aggregation period", display_unit="km/h"),
        discrete_output("sampled_reading", "m/s", "Speed over the last sampling period", display_unit="km/h"),
        discrete_output("distance", "m", "Distance counted up to the last sample"),
    )
    parameters = (
        parameter("sample_period", "s", 0.05, "Time between two samples", min=1e-6),
        parameter("aggregation_period", "s", 0.2, "Time between two aggregates, whole samples", min=1e-6),
        parameter("teeth", "1", 100.0, "Pulses in one revolution", min=1.0),
        parameter("wheel_radius", "m", 0.46, "Radius of the wheel", min=1e-3),
        parameter("noise_std", "m/s", 0.0, "Standard deviation of a reading's noise", min=0.0, display_unit="km/h"),
    )
    events = (
        PeriodicEvent(
            "sampling",
            "sample_period",
            None,
            (standard_normal("sample_noise", "Standard normal number of a sample"),),
            "The pulses are counted",
        ),
        PeriodicEvent(
            "aggregation",
            "aggregation_period",
            None,
            (standard_normal("reading_noise", "Standard normal number of a reading"),),
            "The samples are aggregated",
        ),
    )
    option_choices = {"count_from": ("wheel_speed", "wheel_distance")}

    def __init__(self, *, count_from: CountFrom = "wheel_speed") -> None:
        require_chosen(self.name, self.option_choices, count_from=count_from)
        self.count_from = count_from
        self.inputs = (_SPEED,) if count_from == "wheel_speed" else (_FIRST_SPEED, _DISTANCE)
        late = {"reading": "aggregation_period", "sampled_reading": "sample_period"}
        distance = count_from == "wheel_distance"
        self.differences = {output: (_DISTANCE.name, period) for output, period in late.items() if distance}
        self.states = (*((_INTEGRAL,) if count_from == "wheel_speed" else ()), *_MEMORY)
        super().__init__(count_from=count_from)

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """Derivative of the rim's distance; nothing flows where it is an input."""
        return {"rim_distance": u.wheel_speed} if self.count_from == "wheel_speed" else {}

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """Count the pulses, or hand on what was counted since the last aggregate."""
        pulse, count, last = pulse_length(p.teeth, p.wheel_radius), x.counted_pulses, x.aggregated_pulses
        if event == "sampling":
            now = counted_pulses(x.rim_distance if self.count_from == "wheel_speed" else u.wheel_distance, pulse)
            window = pulses_in_window(now, count, x.sampled_once, u.wheel_speed, p.sample_period, pulse)
            speed = window * pulse / p.sample_period + p.noise_std * u.sample_noise
            begin = np.where(x.aggregated_once == 0.0, now, last)
            return {"held_sample": speed, "counted_pulses": now, "aggregated_pulses": begin, "sampled_once": 1.0}
        window = pulses_in_window(count, last, x.aggregated_once, u.wheel_speed, p.aggregation_period, pulse)
        speed = window * pulse / p.aggregation_period + p.noise_std * u.reading_noise
        return {"held_reading": speed, "aggregated_pulses": count, "aggregated_once": 1.0}

    def reading_bound(self, output: str, p: Any) -> Array:
        """How far a reading is from the mean speed of the wheel at most, see `pulses.reading_bound` [m/s].

        Args:
            output: its name; the distance has no such bound.
        """
        period = {"reading": p.aggregation_period, "sampled_reading": p.sample_period}.get(output, np.inf)
        return np.where(output == "distance", 0.0, reading_bound(p.noise_std, p.teeth, p.wheel_radius, period))

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        distance = x.counted_pulses * pulse_length(p.teeth, p.wheel_radius)
        return {"reading": x.held_reading, "sampled_reading": x.held_sample, "distance": distance}

    def requirements(self, p: Any) -> dict[str, Array]:
        """Parameters keep their bounds; an aggregate is made of whole samples."""
        samples = p.aggregation_period / p.sample_period
        off = np.abs(samples - np.floor(samples + 0.5))
        whole = "aggregation_period must be a whole multiple of sample_period"
        return {
            **super().requirements(p),
            whole: np.where(samples > 0.5, np.where(off < 1e-6, 1.0, 0.0), 0.0),
        }


_SPEED = input_signal("wheel_speed", "m/s", 0.0, "Circumferential speed of the wheel", display_unit="km/h")
_FIRST_SPEED = replace(_SPEED, optional=True)  # of the first reading only; a train mostly starts from rest
_DISTANCE = input_signal("wheel_distance", "m", 0.0, "Distance run by the wheel's rim")
_INTEGRAL = state("rim_distance", "m", 0.0, "Distance run by the wheel's rim at start")
_MEMORY = (
    memory("held_reading", "m/s", 0.0, "Last aggregated reading"),
    memory("held_sample", "m/s", 0.0, "Last sampled reading"),
    memory("counted_pulses", "1", 0.0, "Pulses counted up to the last sample"),
    memory("aggregated_pulses", "1", 0.0, "Pulses counted up to the last aggregate"),
    memory("sampled_once", "1", 0.0, "1 after the first sample"),
    memory("aggregated_once", "1", 0.0, "1 after the first aggregate"),
)
