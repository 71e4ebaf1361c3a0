"""The satellite positioning receiver: a sampled position with slow drift and white noise, as a train of events.

A sensor as a hybrid system of its own; knows only the hybrid foundation.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_models.hybrid import Array, HybridSystem, PeriodicEvent
from plant_models.hybrid.signal import discrete_output, input_signal, memory, parameter, standard_normal


class Gps(HybridSystem):
    """Fixes at the instants ``start + sample_offset + k * sample_period``: position plus drift plus white noise, held
    in between.

    The drift is a first-order Gauss-Markov process, stationary from the first fix on: with ``a = exp(-T / drift_time)``
    from fix to fix ``d+ = a d + sqrt(1 - a^2) drift_std n``. The published accuracy of 0.5 m cannot be white noise:
    with that, no observer of the thesis reaches its published speed errors (independently measured: 0.56 km/h against
    0.15). So the preset `half_metre` takes it as drift.

    Fixes are announced like balises: `gps_count` goes up by one, `gps_time` is the instant, `gps_position` the place.
    Wired to the inputs of the same names of an observer that is the event protocol of FMI 2; an observer with an event
    ``balise`` takes them at ``balise_count``, ``balise_time``, ``balise_position``. No latency: the fix is known at its
    instant. Let communication points fall on the fixes (`sample_period` a multiple of the step): between two points the
    position is a held one, off by what the train moves meanwhile. In a step longer than `sample_period` only the last
    of its fixes is seen.

    Presets: `half_metre` (default): drift 0.5 m over 60 s and white noise 0.05 m; `ideal`: no error; `white`: white
    noise of
    0.5 m alone, the literal reading.

    Source: Bouchama 2024, section 4.1 (10 Hz, 0.5 m); drift time and the division into drift and noise are ours.
    """

    name = "gps"
    description = "Satellite positioning: position of a train in, fixes with drift and noise out"
    source = "Bouchama 2024, section 4.1 (10 Hz, 0.5 m); the error model is ours"
    internal_step = 1e-2  # nothing flows
    states = (
        memory("fix_count", "1", 0.0, "Fixes so far"),
        memory("fix_time", "s", 0.0, "Instant of the last fix"),
        memory("fix_position", "m", 0.0, "Position of the last fix"),
        memory("fix_drift", "m", 0.0, "Slow part of the error at the last fix"),
    )
    inputs = (input_signal("position", "m", 0.0, "True position"),)
    outputs = (
        discrete_output("reading", "m", "Position of the last fix, held"),
        discrete_output("drift", "m", "Slow part of its error"),
        discrete_output("gps_count", "1", "Goes up by one with every fix", integer=True),
        discrete_output("gps_time", "s", "Instant of the last fix"),
        discrete_output("gps_position", "m", "Position of the last fix"),
    )
    parameters = (
        parameter("sample_period", "s", 0.1, "Time between two fixes", min=1e-6),
        parameter("sample_offset", "s", 0.0, "Time of the first fix after the start", min=0.0),
        parameter("drift_std", "m", 0.5, "Standard deviation of the drift", min=0.0),
        parameter("drift_time", "s", 60.0, "Time constant of the drift", min=1e-3),
        parameter("white_std", "m", 0.05, "Standard deviation of the white noise", min=0.0),
    )
    events = (
        PeriodicEvent(
            "fixing",
            "sample_period",
            "sample_offset",
            noises=(
                standard_normal("drift_noise", "Standard normal number of the drift"),
                standard_normal("white_noise", "Standard normal number of the white noise"),
            ),
            description="A fix is taken",
            counted_by="gps_count",
        ),
    )
    presets = {
        "half_metre": {},
        "ideal": {"drift_std": 0.0, "white_std": 0.0},
        "white": {"drift_std": 0.0, "white_std": 0.5},
    }
    default_preset = "half_metre"

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """Take a fix: its count, instant, position and drift."""
        kept = np.where(x.fix_count > 0.0, np.exp(-p.sample_period / p.drift_time), 0.0)  # the first is drawn afresh
        drift = kept * x.fix_drift + np.sqrt(1.0 - kept * kept) * p.drift_std * u.drift_noise
        position = u.position + drift + p.white_std * u.white_noise
        return {"fix_count": x.fix_count + 1.0, "fix_time": t, "fix_position": position, "fix_drift": drift}

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        announced = {"gps_count": x.fix_count, "gps_time": x.fix_time, "gps_position": x.fix_position}
        return {"reading": x.fix_position, "drift": x.fix_drift, **announced}
