"""Faults of any signal: stuck, gain, offset, drift, ramped, lost samples. Knows only the hybrid foundation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from plant_models.hybrid import (
    HybridSystem,
    OutputWarning,
    PeriodicEvent,
    Signal,
    input_signal,
    memory,
    output_signal,
    parameter,
    vector,
)
from plant_models.hybrid.noise import Purpose
from plant_models.hybrid.option import require_whole
from plant_models.hybrid.requirements import within_bounds
from plant_models.hybrid.system import Array
from plant_models.hybrid.units import parse_unit


class SignalFault(HybridSystem):
    """A signal on its way, with faults: ``output = input + sum_i w_i ((gain_i - 1) input + offset_i)``.

    It stands between a sensor and who reads it, or between a controller and its actuator; with nothing connected to
    `healthy`, whose start value then counts, it is a parameter that changes on schedule. ``w_i`` is 0, rises linearly
    to 1 in `fault_rise` from `fault_onset` on, holds for `fault_length`, and falls back in `fault_fall`.

    ========================  ==============================================================
    stuck at c                ``fault_gain = 0``, ``fault_offset = c``
    gain g                    ``fault_gain = g``; noise in `healthy` is amplified as well
    offset d                  ``fault_offset = d``
    drift of r a second       ``fault_offset = r T``, ``fault_rise = T``
    frozen, or lost samples   option `losses`: ``fault_loss`` = 1, or the share that is lost
    ========================  ==============================================================

    With `losses` the signal is sampled each `sample_period` and held; a sample in ``[fault_onset, fault_onset +
    fault_rise + fault_length)`` is lost with probability `fault_loss`, and the last one stays.

    Args:
        channels: number of signals; with more than one, `healthy` and `reading` are vectors, and `fault_channel`
            says which of them a fault concerns.
        fault_count: number of faults; they add up where they overlap.
        unit: of the signals, as FMI writes units.
        losses: whether samples can be lost.

    Raises:
        ValueError: channels or faults below one, or a unit that cannot be read.

    Source: Omar 2012, section 7.4 and (7.6.12); the wheel of a train has faults of its own, see `WheelFault`.
    """

    name = "signal_fault"
    description = "Faults of any signal: stuck, gain, offset, drift, ramped, lost samples"
    source = "Omar 2012, section 7.4, (7.6.12)"
    internal_step = 1e-2  # nothing flows
    purpose = Purpose.FAULTS
    option_choices: ClassVar[Mapping[str, Sequence[Any]]] = {
        "channels": range(1, 65),
        "fault_count": range(1, 65),
        "unit": (),
        "losses": (False, True),
    }

    def __init__(self, *, channels: int = 1, fault_count: int = 1, unit: str = "1", losses: bool = False) -> None:
        require_whole("signal_fault", channels=channels, fault_count=fault_count)
        parse_unit(unit)
        self.channels, self.fault_count, self.losses = channels, fault_count, losses
        size = None if channels == 1 else channels
        self.inputs = (input_signal("healthy", unit, 0.0, "The signal without its faults", size=size, optional=True),)
        self.outputs = (
            output_signal("reading", unit, "The signal with its faults", size=size),
            output_signal("active", "1", "1 while a fault acts"),
            output_signal(
                "faults_unfinished",
                "1",
                "Number of faults that are not over yet",
                warning=OutputWarning(
                    "a fault is not over when the run ends: a fault_length goes beyond the end, or a fault_onset lies "
                    "there; shorten the fault, or let the run go on",
                    ("faults_unfinished",),
                    at_end=True,
                ),
            ),
        )
        self.parameters = _parameters(unit, channels, fault_count, losses)
        if losses:
            self.states = (memory("held", unit, 0.0, "Last sample that was not lost", size=size),)
            chance = input_signal("chance_normal", "1", 0.0, "Standard normal numbers", variability="discrete", size=2)
            self.events = (PeriodicEvent("sampling", "sample_period", None, (chance,), "A sample is taken, or lost"),)
        super().__init__(channels=channels, fault_count=fault_count, unit=unit, losses=losses)

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """A sample is taken, or lost."""
        a, b = u.chance_normal[0], u.chance_normal[1]
        share = np.exp(-0.5 * (a * a + b * b))  # of the uniform distribution: the same in Python and in C
        values = []
        for channel in range(self.channels):
            lost: Array = 0.0
            for i in range(self.fault_count):
                within = self._within(i, t, p, p.fault_rise[i] + p.fault_length[i]) * self._concerns(i, channel, p)
                lost = np.maximum(lost, within * np.where(share < p.fault_loss[i], 1.0, 0.0))
            values.append(np.where(lost > 0.0, self._of(channel, x.held), self._of(channel, u.healthy)))
        return {"held": self._together(values)}

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """The signals with their faults, whether one acts, and how many are not over."""
        weights = [self._weight(i, t, p) for i in range(self.fault_count)]
        readings = []
        for channel in range(self.channels):
            value = self._of(channel, x.held if self.losses else u.healthy)
            wrong: Array = 0.0 * value
            for i, weight in enumerate(weights):
                change = (p.fault_gain[i] - 1.0) * value + p.fault_offset[i]
                wrong = wrong + self._concerns(i, channel, p) * weight * change
            readings.append(value + wrong)
        lengths = [p.fault_rise[i] + p.fault_length[i] + p.fault_fall[i] for i in range(self.fault_count)]
        acting, unfinished = 0.0 * t, 0.0 * t
        for i, length in enumerate(lengths):
            acting = np.maximum(acting, self._within(i, t, p, length))
            unfinished = unfinished + np.where(length > 0.0, np.where(t < p.fault_onset[i] + length, 1.0, 0.0), 0.0)
        return {"reading": self._together(readings), "active": acting, "faults_unfinished": unfinished}

    def requirements(self, p: Any) -> dict[str, Array]:
        """Parameters keep their bounds."""
        return within_bounds(self.parameters, p)

    def _of(self, channel: int, values: Array) -> Array:
        return values if self.channels == 1 else values[channel]

    def _together(self, values: list[Array]) -> Array:
        return values[0] if self.channels == 1 else vector(*values)

    def _concerns(self, i: int, channel: int, p: Any) -> Array:
        return 1.0 if self.channels == 1 else np.where(np.abs(p.fault_channel[i] - (channel + 1.0)) < 0.5, 1.0, 0.0)

    @staticmethod
    def _within(i: int, t: Array, p: Any, length: Array) -> Array:
        """1 from the onset of fault i on, for `length` [s], else 0."""
        return np.where(t >= p.fault_onset[i], np.where(t < p.fault_onset[i] + length, 1.0, 0.0), 0.0)

    def _weight(self, i: int, t: Array, p: Any) -> Array:
        """Share of fault i that acts now [1]."""
        since = t - p.fault_onset[i]
        rise, fall = p.fault_rise[i], p.fault_fall[i]
        end = rise + p.fault_length[i]
        rising = np.where(since < rise, since / np.maximum(rise, 1e-300), 1.0)
        falling = np.where(since < end, 1.0, 1.0 - (since - end) / np.maximum(fall, 1e-300))
        return self._within(i, t, p, end + fall) * np.minimum(rising, falling)


def _parameters(unit: str, channels: int, count: int, losses: bool) -> tuple[Signal, ...]:
    """Parameters of the faults, one element each."""
    several = (
        parameter("fault_channel", "1", 1.0, "Which signal each fault concerns", min=1.0, max=channels, size=count),
    )
    lost = (
        parameter("fault_loss", "1", 0.0, "Share of the samples that each fault loses", min=0.0, max=1.0, size=count),
        parameter("sample_period", "s", 0.01, "Time between two samples", min=1e-6),
    )
    return (
        parameter("fault_onset", "s", 0.0, "Instant at which each fault begins", size=count),
        parameter("fault_length", "s", 0.0, "Time for which each holds; 0 where it is not used", min=0.0, size=count),
        parameter("fault_rise", "s", 0.0, "Time in which each fault rises before it holds", min=0.0, size=count),
        parameter("fault_fall", "s", 0.0, "Time in which each fault falls after it held", min=0.0, size=count),
        parameter("fault_gain", "1", 1.0, "Factor of each fault; 0 where the signal is stuck", size=count),
        parameter("fault_offset", unit, 0.0, "What each fault adds; the value where it is stuck", size=count),
        *(several if channels > 1 else ()),
        *(lost if losses else ()),
    )
