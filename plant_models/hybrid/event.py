"""Events: the declared instants at which a hybrid system jumps.

Triggered events come from outside with a payload (a balise). Periodic events happen at instants given by parameters
(a sampled odometer) and may draw noise. Communication events end every communication step. This file imports only the
signal vocabulary.
"""

from __future__ import annotations

from dataclasses import dataclass

from plant_models.hybrid.signal import Signal

USED, DOUBTED, IGNORED = 0, 1, 2
"""Verdicts of a system on a triggered event: it took effect; so it did, although it was doubted; it was doubted and did
not.
"""


@dataclass(frozen=True, slots=True)
class TriggeredEvent:
    """An event that arrives from outside, at any time.

    Args:
        name: identifier; in FMI 3 the name of a triggered input clock, in FMI 2 the stem of ``<name>_count`` and
            ``<name>_time``.
        payload: discrete inputs that arrive with the event; each name starts with ``<name>_``. Only the jump at this
            event may read them: before it they are not known. What is needed later belongs into memory.
        description: one line for the user.
        verdict: name of the memory that holds, after the jump, what the system made of the event (`USED`, `DOUBTED`,
            `IGNORED`); empty where it uses every one.
        samples: names of payloads that are measurements read at this event, each of which can be missing (NaN). Where
            one is, the event does not occur, unless `leaves_out` says otherwise; the system counts what was missing.
        leaves_out: whether `jump` is called with NaN and leaves out each of the samples itself (`hybrid.missing`).

    Raises:
        ValueError: a payload has another prefix, is not a discrete input, or takes the name of the count or the stamp.
    """

    name: str
    payload: tuple[Signal, ...] = ()
    description: str = ""
    verdict: str = ""
    samples: tuple[str, ...] = ()
    leaves_out: bool = False

    def __post_init__(self) -> None:
        for signal in self.payload:
            if not signal.name.startswith(f"{self.name}_"):
                raise ValueError(f"Payload {signal.name!r} of event {self.name!r} must be named '{self.name}_...'.")
            if signal.causality != "input" or signal.variability != "discrete":
                raise ValueError(f"Payload {signal.name!r} of event {self.name!r} must be a discrete input.")
            if signal.name in self.implied_names:
                raise ValueError(
                    f"Payload {signal.name!r} of event {self.name!r} takes a name that every event has itself."
                )

    @property
    def implied_names(self) -> tuple[str, str]:
        """Names of the count and of the stamp that every triggered event has in an FMU."""
        return f"{self.name}_count", f"{self.name}_time"


@dataclass(frozen=True, slots=True)
class PeriodicEvent:
    """An event at the instants ``start_time + offset + k * period``, k = 0, 1, 2, ...

    Args:
        name: identifier.
        period: name of the parameter that holds the period [s].
        offset: name of the parameter that holds the offset [s], or None for zero.
        noises: standard normal numbers drawn afresh at every instant and handed to `jump` as inputs.
        description: one line for the user.
        samples: names of inputs that are measurements read at this event, each of which can be missing (NaN). Where
            one is, the event does not occur, unless `leaves_out` says otherwise; the system counts what was missing.
        leaves_out: whether `jump` is called with NaN and leaves out each of the samples itself (`hybrid.missing`).
        counted_by: name of the output that goes up by one at every instant, for others to be triggered by; or empty.
    """

    name: str
    period: str
    offset: str | None = None
    noises: tuple[Signal, ...] = ()
    description: str = ""
    samples: tuple[str, ...] = ()
    leaves_out: bool = False
    counted_by: str = ""


@dataclass(frozen=True, slots=True)
class CommunicationEvent:
    """An event at the start, and at the end of every communication step, after all others due there.

    For a system that works on what a master hands over from step to step and on nothing in between (the balise reader).
    How such a system moves depends on the communication steps; it has no place in model exchange.

    Args:
        name: identifier.
        description: one line for the user.
    """

    name: str
    description: str = ""


Event = TriggeredEvent | PeriodicEvent | CommunicationEvent
