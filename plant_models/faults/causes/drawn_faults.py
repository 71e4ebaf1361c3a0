"""Faults drawn from a seed: jams while the train brakes, skids while it pulls."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from plant_models.faults.fault_cause import BRAKE_RELEASED, EFFORT, RELEASE_TIME, Fault, FaultCause, one_where
from plant_models.hybrid import Array, standard_normal
from plant_models.hybrid.event import PeriodicEvent
from plant_models.hybrid.signal import memory, parameter, state

_NOISES = tuple(
    standard_normal(f"{what}_noise_{part}", f"Standard normal number for {text}")
    for what, text in (
        ("onset", "the onset of a fault"),
        ("length", "the length of a fault"),
        ("depth", "its depth"),
    )
    for part in ("a", "b")
)


class DrawnFaults(FaultCause):
    """Faults of a Poisson process, jams at `jam_rate` while `effort` brakes, skids at `skid_rate` while it pulls; their
    length has an exponential, their depth a uniform distribution. One at a time, and at most one begins in a
    `draw_period`. A fault does nothing while the effort that causes it is taken back.

    Half the sum of two squared standard normal numbers is a number of the exponential distribution with mean 1, and
    ``exp`` of its negative one of the uniform distribution: the same in Python and in C.
    """

    name = "drawn"
    description = "Jams of a braked and skids of a driven wheel, drawn from a seed"
    ranges = (("jam_rate", 0.02, 0.2), ("skid_rate", 0.02, 0.2), ("mean_length", 0.1, 2.0))
    inputs = (EFFORT, BRAKE_RELEASED)
    parameters = (
        RELEASE_TIME,
        parameter("jam_rate", "1/s", 0.1, "Mean number of jams in a second of braking", min=0.0),
        parameter("skid_rate", "1/s", 0.1, "Mean number of skids in a second of pulling", min=0.0),
        parameter("mean_length", "s", 0.5, "Mean length of a fault, exponentially distributed", min=0.0),
        parameter("longest_length", "s", 5.0, "Longer faults are cut to this", min=0.0),
        parameter("least_depth", "1", 0.2, "Lower end of the uniform distribution of the depth", min=0.0, max=1.0),
        parameter("most_depth", "1", 1.0, "Upper end of the uniform distribution of the depth", min=0.0, max=1.0),
        parameter("draw_period", "s", 0.1, "Time between two draws: at most one fault begins in it", min=1e-6),
    )
    states = (
        state("released_for", "s", 0.0, "For how long there was no effort that keeps the fault up"),
        memory("drawn_onset", "s", -1.0, "Onset of the last fault drawn"),
        memory("drawn_end", "s", -1.0, "End of the last fault drawn"),
        memory("drawn_sign", "1", -1.0, "Its kind: -1 jam, 1 skid"),
        memory("drawn_depth", "1", 0.0, "Its depth"),
    )
    switchings = ("fault_from", "fault_to", "fault_freed")
    events = (PeriodicEvent("drawing", "draw_period", None, _NOISES, "A fault may be drawn"),)

    def fault(self, t: Array, x: Any, u: Any, p: Any, passed: Array, values: Sequence[Array]) -> Fault:
        """The fault drawn last, while its effort keeps it up."""
        kept = one_where(x.drawn_sign * u.effort > 0.0)
        return Fault(_window(passed) * kept * x.drawn_sign * x.drawn_depth)

    def rates(self, t: Array, x: Any, u: Any, p: Any, passed: Array) -> dict[str, Array]:
        """The clock of the fault runs while its effort is taken back, or the brake released in a jam."""
        let_go = 1.0 - one_where(x.drawn_sign * u.effort > 0.0)
        released = np.where(x.drawn_sign < 0.0, one_where(u.brake_released > 0.5), 0.0)
        return {"released_for": _window(passed) * np.maximum(let_go, released)}

    def switching(self, t: Array, x: Any, u: Any, p: Any) -> Sequence[Array]:
        """Onset, end, and where the wheel is freed."""
        return [t - x.drawn_onset, t - x.drawn_end, x.released_for - p.release_time]

    def jump(self, t: Array, x: Any, u: Any, p: Any, values: Sequence[Array]) -> dict[str, Array]:
        """The next fault, where none is on and one begins before the next draw."""
        rate = np.where(u.effort < 0.0, p.jam_rate, np.where(u.effort > 0.0, p.skid_rate, 0.0))
        chance = _exponential(u.onset_noise_a, u.onset_noise_b)
        idle = np.maximum(one_where(t >= x.drawn_end), one_where(x.released_for >= p.release_time))
        drawn = idle * one_where(chance < rate * p.draw_period)
        onset = t + chance / np.maximum(rate, 1e-300)
        length = np.minimum(p.mean_length * _exponential(u.length_noise_a, u.length_noise_b), p.longest_length)
        share = np.exp(-_exponential(u.depth_noise_a, u.depth_noise_b))
        depth = p.least_depth + (p.most_depth - p.least_depth) * share
        new = {
            "released_for": 0.0,
            "drawn_onset": onset,
            "drawn_end": onset + length,
            "drawn_sign": np.where(u.effort < 0.0, -1.0, 1.0),
            "drawn_depth": depth,
        }
        return {name: np.where(drawn > 0.0, fresh, getattr(x, name)) for name, fresh in new.items()}

    def requirements(self, p: Any) -> dict[str, Array]:
        """The depths are in order."""
        return {"most_depth must not lie below least_depth": one_where(p.most_depth >= p.least_depth)}


def _window(passed: Array) -> Array:
    """1 between onset and end unless the wheel has been freed, else 0."""
    return passed[0] * (1.0 - passed[1]) * (1.0 - passed[2])


def _exponential(a: Array, b: Array) -> Array:
    """A number of the exponential distribution with mean 1 from two standard normal ones."""
    return 0.5 * (a * a + b * b)
