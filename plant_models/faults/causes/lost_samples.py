"""Samples that are lost, beside faults by gain and offset: the last one stays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from plant_models.faults.causes.gain_and_offset import GainAndOffset
from plant_models.faults.fault_cause import Carrier, one_where
from plant_models.hybrid import Array, standard_normal, vector
from plant_models.hybrid.event import PeriodicEvent
from plant_models.hybrid.signal import memory, parameter


class LostSamples(GainAndOffset):
    """The signal is sampled each `sample_period` and held; a sample in ``[fault_onset, fault_onset + fault_rise +
    fault_length)`` is lost with probability `fault_loss`, and the last one stays: 1 freezes the signal.

    Args:
        carrier: what the cause acts on.
    """

    name = "lost_samples"
    description = "Frozen, or a share of the samples lost, by onset and length"
    ranges = (("fault_loss", 0.05, 1.0),)
    events = (
        PeriodicEvent(
            "sampling",
            "sample_period",
            None,
            (standard_normal("chance_normal", "Standard normal numbers", size=2),),
            "A sample is taken, or lost",
        ),
    )

    def __init__(self, carrier: Carrier) -> None:
        super().__init__(carrier)
        n, channels = self.count, carrier.channels
        self.parameters = (
            *self.parameters,
            parameter("fault_loss", "1", 0.0, "Share of the samples that each fault loses", min=0.0, max=1.0, size=n),
            parameter("sample_period", "s", 0.01, "Time between two samples", min=1e-6),
        )
        size = None if channels == 1 else channels
        self.states = (memory("held", carrier.unit, 0.0, "Last sample that was not lost", size=size),)

    def carried(self, x: Any, values: Sequence[Array]) -> Sequence[Array]:
        return [x.held] if self.carrier.channels == 1 else [x.held[channel] for channel in range(len(values))]

    def jump(self, t: Array, x: Any, u: Any, p: Any, values: Sequence[Array]) -> dict[str, Array]:
        a, b = u.chance_normal[0], u.chance_normal[1]
        share = np.exp(-0.5 * (a * a + b * b))  # of the uniform distribution: the same in Python and in C
        taken = []
        for channel, (held, value) in enumerate(zip(self.carried(x, values), values, strict=True)):
            lost: Array = 0.0
            for i in range(self.count):
                end = p.fault_onset[i] + (p.fault_rise[i] + p.fault_length[i])
                within = one_where(t >= p.fault_onset[i]) * one_where(t < end)
                lost = np.maximum(lost, within * self.concerns(i, channel, p) * one_where(share < p.fault_loss[i]))
            taken.append(np.where(lost > 0.0, held, value))
        return {"held": taken[0] if self.carrier.channels == 1 else vector(*taken)}
