"""Faults of any signal: stuck, gain, offset, drift, ramped, lost samples; or those of any other cause."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from plant_models.faults.fault_cause import Carrier
from plant_models.faults.fault_system import CAUSES, FaultSystem, active, unfinished_output
from plant_models.hybrid import Array, input_signal, output_signal, vector
from plant_models.hybrid.option import require_whole
from plant_models.hybrid.units import parse_unit

LOST_SAMPLES = "lost_samples"


class SignalFault(FaultSystem):
    """A signal on its way, with the faults of a cause, by default those of `GainAndOffset`.

    It stands between a sensor and who reads it, or between a controller and its actuator; with nothing connected to
    `healthy`, whose start value then counts, it is a parameter that changes on schedule.

    ========================  ==============================================================
    stuck at c                ``fault_gain = 0``, ``fault_offset = c``
    gain g                    ``fault_gain = g``; noise in `healthy` is amplified as well
    offset d                  ``fault_offset = d``
    drift of r a second       ``fault_offset = r T``, ``fault_rise = T``
    frozen, or lost samples   option `losses`: ``fault_loss`` = 1, or the share that is lost
    ========================  ==============================================================

    Args:
        channels: number of signals; with more than one, `healthy` and `reading` are vectors, and `fault_channel`
            says which of them a fault concerns.
        fault_count: number of faults; they add up where they overlap.
        unit: of the signals, as FMI writes units.
        losses: whether samples can be lost: the cause `LostSamples`.
        cause: see `CAUSES`; empty for `gain_and_offset`, or what `losses` says.

    Raises:
        ValueError: channels or faults below one, an unknown cause, losses with another one, or a unit that cannot be
            read.

    Source: Omar 2012, section 7.4 and (7.6.12); the wheel of a train has faults of its own, see `WheelFault`.
    """

    name = "signal_fault"
    description = "Faults of any signal: stuck, gain, offset, drift, ramped, lost samples"
    source = "Omar 2012, section 7.4, (7.6.12)"
    option_choices = {
        "channels": range(1, 65),
        "fault_count": range(1, 65),
        "unit": (),
        "losses": (False, True),
        "cause": CAUSES,
    }

    def __init__(
        self, *, channels: int = 1, fault_count: int = 1, unit: str = "1", losses: bool = False, cause: str = ""
    ) -> None:
        require_whole(self.name, channels=channels)
        parse_unit(unit)
        if losses and cause not in ("", LOST_SAMPLES):
            raise ValueError(
                f"losses belong to the cause {LOST_SAMPLES!r}, got cause {cause!r}; leave one of them out."
            )
        self.channels = channels
        size = None if channels == 1 else channels
        self.inputs = (input_signal("healthy", unit, 0.0, "The signal without its faults", size=size, optional=True),)
        self.outputs = (
            output_signal("reading", unit, "The signal with its faults", size=size),
            output_signal("active", "1", "1 while a fault acts"),
            unfinished_output("fault"),
        )
        chosen = cause or (LOST_SAMPLES if losses else "gain_and_offset")
        options = {"channels": channels, "fault_count": fault_count, "unit": unit, "losses": losses}
        super().__init__(Carrier(unit, channels, fault_count), **options, cause=chosen)

    def healthy(self, u: Any) -> Sequence[Array]:
        """The signals without their faults, one each."""
        return [u.healthy] if self.channels == 1 else [u.healthy[channel] for channel in range(self.channels)]

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        values, fault = self.faulty(t, x, u, p)
        readings = [v * (1.0 + fault.depth) + a for v, a in zip(values, fault.added, strict=True)]
        return {
            "reading": readings[0] if self.channels == 1 else vector(*readings),
            "active": active(fault),
            "faults_unfinished": fault.unfinished,
        }
