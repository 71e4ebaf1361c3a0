"""Variables: what each value reference of a block stands for, and in which modes it may be set.

The same rules as in the exported FMU, so that a master which works with the block works with the FMU.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from fmu_observer.description import VariableTable, exposed_inputs
from plant_models.hybrid import HybridSystem, Runtime, Signal

Mode = Literal["instantiated", "initialization", "event", "step", "terminated", "freed"]
Role = Literal["time", "input", "payload", "output", "state", "fixed", "tunable", "trigger", "stamp"]

BEFORE_TIME: tuple[Mode, ...] = ("instantiated", "initialization")


class BlockError(ValueError):
    """Something a block cannot do: what was asked, and what was expected."""


@dataclass(frozen=True, slots=True)
class Place:
    """Where the value of a variable is kept.

    Args:
        name: FMI name.
        role: what it is for.
        values: array or list that holds it; of no meaning for time.
        index: its position there.
    """

    name: str
    role: Role
    values: Any
    index: int


class Variables:
    """The variables of one runtime by value reference.

    Args:
        system: the hybrid system. runtime: its runtime. stamps: one stamp for each triggered event [s].
        counts_events: whether events are announced by counts (FMI 2) or by clocks (FMI 3).
    """

    def __init__(self, system: HybridSystem, runtime: Runtime, stamps: list[float], counts_events: bool) -> None:
        self.table = VariableTable.of(system)
        self._places = [Place("time", "time", None, 0), *_system_places(system, runtime)]
        for number, event in enumerate(system.triggered_events):
            count, stamp = event.implied_names
            self._places.append(Place(count if counts_events else event.name, "trigger", None, number))
            self._places.append(Place(stamp, "stamp", stamps, number))
        self._settable = _settable_modes(counts_events)

    def place(self, reference: int) -> Place:
        """Where the variable with this value reference is kept.

        Raises:
            BlockError: there is none.
        """
        if not 0 <= reference < len(self._places):
            raise BlockError(f"there is no variable with value reference {reference}; the last one is {len(self._places) - 1}.")
        return self._places[reference]

    def readable(self, reference: int) -> Place:
        """The place of a real variable.

        Raises:
            BlockError: there is no such variable, or it is a clock or a count.
        """
        place = self.place(reference)
        if place.role == "trigger":
            raise BlockError(f"{place.name} (value reference {reference}) is not a real variable but announces an event.")
        return place

    def settable(self, reference: int, mode: Mode) -> Place:
        """The place of a real variable that may be set in this mode.

        Raises:
            BlockError: there is no such variable, or it cannot be set, or not now.
        """
        place = self.readable(reference)
        modes = self._settable.get(place.role, ())
        if mode not in modes:
            which = f"{place.name} (value reference {reference})"
            if not modes:
                raise BlockError(f"{which} is computed and cannot be set.")
            what = "is a fixed parameter and cannot" if place.role == "fixed" else "cannot"
            raise BlockError(f"{which} {what} be set in mode '{mode}', only in: {', '.join(modes)}.")
        return place

    def event_number(self, reference: int) -> int:
        """Number of the triggered event whose clock or count has this value reference.

        Raises:
            BlockError: it is not a clock or count.
        """
        place = self.place(reference)
        if place.role != "trigger":
            raise BlockError(f"{place.name} (value reference {reference}) is not the clock or count of an event.")
        return place.index

    def have_role(self, references: Sequence[int], role: Role) -> bool:
        """Whether all these variables have one role."""
        return all(self.place(reference).role == role for reference in references)


def _system_places(system: HybridSystem, runtime: Runtime) -> list[Place]:
    own = len(system.inputs)
    return [
        *_places(exposed_inputs(system), runtime.u, lambda i: "input" if i < own else "payload"),
        *_places(system.outputs, runtime.y, lambda _: "output"),
        *_places(system.states, runtime.x, lambda _: "state"),
        *_places(
            system.parameter_signals,
            runtime.p,
            lambda i: "tunable" if system.parameter_signals[i].variability == "tunable" else "fixed",
        ),
    ]


def _places(signals: Sequence[Signal], values: Any, role: Callable[[int], Role]) -> list[Place]:
    """Places of signals that stand one after the other in `values`; `role` takes the number of the signal."""
    named = [(name, role(i)) for i, signal in enumerate(signals) for name in signal.scalar_names]
    return [Place(name, kind, values, index) for index, (name, kind) in enumerate(named)]


def _settable_modes(counts_events: bool) -> dict[Role, tuple[Mode, ...]]:
    """In FMI 2 what comes with an event is set before the step, in FMI 3 in event mode."""
    at_events: Mode = "step" if counts_events else "event"
    return {
        "input": (*BEFORE_TIME, "event", "step"),
        "tunable": (*BEFORE_TIME, "event", "step"),
        "payload": (*BEFORE_TIME, at_events),
        "stamp": (*BEFORE_TIME, at_events),
        "state": BEFORE_TIME,
        "fixed": BEFORE_TIME,
    }
