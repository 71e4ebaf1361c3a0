"""Faults by their instants that multiply a signal and add to it, ramped where they are to be."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from plant_models.faults.fault_cause import Carrier, Fault, TimedFaults
from plant_models.hybrid import Array
from plant_models.hybrid.signal import parameter


class GainAndOffset(TimedFaults):
    """``sum_i w_i ((gain_i - 1) value + offset_i)`` is added to a signal.

    ``w_i`` is 0, rises linearly to 1 in `fault_rise` from `fault_onset` on, holds for `fault_length`, and falls back in
    `fault_fall`. Faults add up where they overlap.

    Args:
        carrier: what the cause acts on; of several signals `fault_channel` says which one a fault concerns.
    """

    name = "gain_and_offset"
    description = "Stuck, gain, offset or drift by onset and length, ramped"
    ranges = (("fault_gain", 0.8, 1.2),)
    EDGES = ("from", "to", "risen", "falling")

    def __init__(self, carrier: Carrier) -> None:
        super().__init__(carrier)
        n, channels = self.count, carrier.channels
        which = parameter("fault_channel", "1", 1.0, "Which signal each fault concerns", min=1.0, max=channels, size=n)
        self.parameters = (
            parameter("fault_onset", "s", 0.0, "Instant at which each fault begins", size=n),
            parameter("fault_length", "s", 0.0, "Time for which each holds; 0 where it is not used", min=0.0, size=n),
            parameter("fault_rise", "s", 0.0, "Time in which each fault rises before it holds", min=0.0, size=n),
            parameter("fault_fall", "s", 0.0, "Time in which each fault falls after it held", min=0.0, size=n),
            parameter("fault_gain", "1", 1.0, "Factor of each fault; 0 where the signal is stuck", size=n),
            parameter("fault_offset", carrier.unit, 0.0, "What each fault adds; the value where it is stuck", size=n),
            *((which,) if channels > 1 else ()),
        )

    def lasting(self, i: int, p: Any) -> Array:
        """Rise, hold and fall of fault i [s]."""
        return p.fault_rise[i] + p.fault_length[i] + p.fault_fall[i]

    def fault(self, t: Array, x: Any, u: Any, p: Any, passed: Array, values: Sequence[Array]) -> Fault:
        """What the faults that act now add to each signal."""
        weights = [self._weight(i, t, p, passed) for i in range(self.count)]
        added, acting = [], 0.0 * t
        for channel, value in enumerate(values):
            wrong: Array = 0.0 * value
            for i, weight in enumerate(weights):
                change = (p.fault_gain[i] - 1.0) * value + p.fault_offset[i]
                wrong = wrong + self.concerns(i, channel, p) * weight * change
            added.append(wrong)
        for i in range(self.count):
            acting = np.maximum(acting, self.window(i, passed))
        return Fault(added=added, acting=acting, unfinished=0.0 * t + self.unfinished(p, passed))

    def concerns(self, i: int, channel: int, p: Any) -> Array:
        """1 where fault i is one of that signal, else 0 [1].

        Args:
            i: number of the fault. channel: number of the signal. p: parameters by name.
        """
        if self.carrier.channels == 1:
            return 1.0
        return np.where(np.abs(p.fault_channel[i] - (channel + 1.0)) < 0.5, 1.0, 0.0)

    def switching(self, t: Array, x: Any, u: Any, p: Any) -> Sequence[Array]:
        """Onsets, ends, and where faults have risen and begin to fall."""
        since = [t - p.fault_onset[i] for i in range(self.count)]
        risen = [since[i] - p.fault_rise[i] for i in range(self.count)]
        falling = [since[i] - (p.fault_rise[i] + p.fault_length[i]) for i in range(self.count)]
        return [*super().switching(t, x, u, p), *risen, *falling]

    def turned(self, p: Any) -> dict[str, Array]:
        """What reads too low reads too high by as much."""
        return {"fault_gain": 2.0 - np.asarray(p.fault_gain), "fault_offset": -np.asarray(p.fault_offset)}

    def _weight(self, i: int, t: Array, p: Any, passed: Array) -> Array:
        """Share of fault i that acts now [1]."""
        since, end = t - p.fault_onset[i], p.fault_rise[i] + p.fault_length[i]
        risen, falls = passed[2 * self.count + i], passed[3 * self.count + i]
        # Where nothing rises or falls the quotient is not used, and its derivative is finite.
        rise, fall = (np.where(duration > 0.0, duration, 1.0) for duration in (p.fault_rise[i], p.fault_fall[i]))
        rising = np.where(risen > 0.0, 1.0, since / rise)
        falling = np.where(falls > 0.0, 1.0 - (since - end) / fall, 1.0)
        return self.window(i, passed) * np.minimum(rising, falling)
