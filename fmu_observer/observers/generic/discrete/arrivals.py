"""How the measurements of a filter arrive, at its own period or by events from outside, and the step to a sample."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from fmu_observer.models.filter_models import FilterModel
from fmu_observer.models.observer_model import stacked_of
from fmu_observer.observers.gated_observer import GATED_EVENT
from fmu_observer.observers.model_signals import arrival_event, measured_inputs, sampling_event
from plant_models.hybrid import Array, Event, Signal, memory

Update = Callable[[Any], dict[str, Array]]  # named tuple of the memory -> what of it changes, by name
INITIALISED = memory("primed", "1", 0.0, "1 after the first sample")


PERIODIC = "periodic"
SAMPLING = "sampling"


class Arrivals:
    """Which measurement arrives at which event.

    Args:
        who: name of the filter, for messages. model: whose measurements they are.
        arrival: ``periodic``, or the name of an event, for all measurements or for each in a list.

    Attributes:
        names: of the events, one a measurement. timed: whether one arrives by an event from outside.
        several: whether an innovation may have more or fewer numbers: there are several measurements.

    Raises:
        ValueError: a list has another length, a name is no identifier, or the model moves at its own period only.
    """

    def __init__(self, who: str, model: FilterModel, arrival: str | Sequence[str]) -> None:
        measured = [s.name for s in model.measurements]
        names = [arrival] * len(measured) if isinstance(arrival, str) else list(arrival)
        if len(names) != len(measured):
            raise ValueError(
                f"{who}: arrival = {list(arrival)!r}; expected one name for each of {', '.join(measured)}, or one for "
                "all."
            )
        wrong = [n for n in names if not isinstance(n, str) or not n.isidentifier() or n == SAMPLING]
        if wrong:
            raise ValueError(
                f"{who}: arrival {wrong[0]!r} is no legal name of an event; use {PERIODIC!r}, or letters, digits and "
                f"'_', but not {SAMPLING!r}."
            )
        self.names = tuple(names)
        self.signals = model.measurements
        self.several = len(names) > 1
        self.timed = any(name != PERIODIC for name in names)
        if self.timed and not model.any_period:
            raise ValueError(
                f"{who}: {model.name!r} moves at its own period, so its measurements arrive at that period: leave out "
                "`arrival`, or use a system that flows."
            )

    @property
    def inputs(self) -> tuple[Signal, ...]:
        """Inputs that are read at the filter's own period."""
        return measured_inputs(s for s, name in zip(self.signals, self.names, strict=True) if name == PERIODIC)

    @property
    def events(self) -> tuple[Event, ...]:
        """The periodic event, then those from outside with their payloads."""
        text = "The measurements are read" if not self.timed else "The estimate is predicted"
        found: list[Event] = [sampling_event([s.name for s in self.inputs], text, leaves_out=True)]
        for name in dict.fromkeys(self.names):
            if name != PERIODIC:
                arrives = arrival_event(name, [self.signals[i] for i in self.rows(name)], leaves_out=True)
                found.append(replace(arrives, samples=()) if name == GATED_EVENT else arrives)  # telegrams are whole
        return tuple(found)

    def rows(self, event: str) -> tuple[int, ...]:
        """Which measurements arrive at an event.

        Args:
            event: its name.
        """
        name = PERIODIC if event == SAMPLING else event
        return tuple(i for i, stated in enumerate(self.names) if stated == name)

    def measured(self, event: str, u: Any) -> Array:
        """The measurements that arrive at an event, shape (len(rows),).

        Args:
            event: its name. u: inputs of the filter, payload included.
        """
        prefix = "measured" if event == SAMPLING else event
        return stacked_of(u, [self.signals[i] for i in self.rows(event)], f"{prefix}_")


def initialised_memory(*signals: Signal) -> tuple[Signal, ...]:
    """Memory of an observer, with the mark of the first sample behind it.

    Args:
        signals: memory of the observer itself.
    """
    return (*signals, INITIALISED)


def at_sample(x: Any, advance: Update, correct: Update) -> dict[str, Array]:
    """What a sample changes: the memory is advanced over the period since the last one (not at the first), then
    corrected.

    Args:
        x: named tuple of the memory, `INITIALISED` among it.
        advance: over one period. correct: by the measurement at hand.
    """
    moved = {name: np.where(x.primed > 0.5, value, getattr(x, name)) for name, value in advance(x).items()}
    return moved | correct(x._replace(**moved)) | {INITIALISED.name: 1.0}
