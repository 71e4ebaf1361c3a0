"""BlockVariables: what each value reference of a block stands for, and in which modes it may be set.

The same rules as in the exported FMU, so that a master which works with the block works with the FMU.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from fmu_observer.description import FIRST_REFERENCE, VariableTable, exposed_inputs
from fmu_observer.event_protocol import OUTCOME_VARIABLES
from plant_models.hybrid import HybridSystem, Runtime, Signal, scalar_names

if TYPE_CHECKING:
    from fmu_observer.block.block_events import Events

Mode = Literal["instantiated", "initialization", "event", "step", "terminated", "freed"]
Role = Literal[
    "time",
    "input",
    "payload",
    "output",
    "integer_output",
    "state",
    "fixed",
    "tunable",
    "clock",
    "count",
    "stamp",
    "policy",
    "horizon",
    "outcome",
    "derivative",
    "indicator",
]

OUTPUTS: frozenset[Role] = frozenset({"output", "integer_output"})
COMPUTED: frozenset[Role] = OUTPUTS | {"derivative", "indicator"}
BEFORE_TIME: tuple[Mode, ...] = ("instantiated", "initialization")
ALIVE: tuple[Mode, ...] = (*BEFORE_TIME, "event", "step", "terminated")


NOT_REAL: dict[Role, str] = {
    "clock": "announces an event",
    "count": "announces an event",
    "policy": "is an enumeration",
    "integer_output": "is a whole number",
    "outcome": "counts events",
}


class BlockError(ValueError):
    """Something a block cannot do: what was asked, and what was expected."""


class StepDiscarded(BlockError):  # noqa: N818 - FMI's word for it
    """A communication step that cannot be done; it has left no trace."""


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


class BlockVariables:
    """The variables of one runtime by value reference.

    `derivatives` and `indicators` hold what `refresh` has computed last; `outdate`, a call without arguments, says that
    something has changed since. `stale` are the roles of what is not up to date.

    Args:
        system: the hybrid system. runtime: its runtime. events: its events.
        counts_events: whether events are announced by counts or by clocks.
    """

    def __init__(self, system: HybridSystem, runtime: Runtime, events: Events, counts_events: bool) -> None:
        self.table = VariableTable.of(system)
        self._runtime = runtime
        self.derivatives = np.zeros(system.continuous_count)
        self.indicators = np.zeros(len(system.frictions) + len(system.switchings))
        self._places = [Place("time", "time", None, 0), *_system_places(system, runtime)]
        for number, event in enumerate(system.triggered_events):
            count, stamp = event.implied_names
            trigger = (
                Place(count, "count", events, number) if counts_events else Place(event.name, "clock", events, number)
            )
            self._places += [trigger, Place(stamp, "stamp", events.stamps, number)]
        if system.triggered_events:
            self._places.append(Place("late_policy", "policy", events.protocol, 0))
            self._places.append(Place("replay_horizon", "horizon", events.protocol, 1))
            self._places += [Place(name, "outcome", events, i) for i, name in enumerate(OUTCOME_VARIABLES)]
        self._places += _rate_places(system, self.derivatives, self.indicators)
        self._settable = _settable_modes(counts_events)
        self._listed: dict[tuple[tuple[int, ...], Mode | None], list[Place]] = {}
        self.stale: set[Role] = set(COMPUTED)
        self.outdate: Callable[[], None] = partial(self.stale.update, COMPUTED)

    def refresh(self, role: Role) -> None:
        """Compute the variables of this role, where that is due."""
        if role not in self.stale:
            return
        if role in OUTPUTS:
            self._runtime.update_outputs()
            self.stale -= OUTPUTS
        elif role == "derivative":
            self.derivatives[:] = self._runtime.derivatives()
            self.stale.discard(role)
        else:
            self.indicators[:] = self._runtime.indicators()
            self.stale.discard(role)

    def place(self, reference: int) -> Place:
        """Where the variable with this value reference is kept.

        Raises:
            BlockError: there is none.
        """
        if not self.table.time <= reference < self.table.end:
            raise BlockError(
                f"there is no variable with value reference {reference}; the last one is {self.table.end - 1}."
            )
        return self._places[reference - FIRST_REFERENCE]

    def readable(self, reference: int) -> Place:
        """The place of a real variable.

        Raises:
            BlockError: there is no such variable, or it is a clock or a count.
        """
        place = self.place(reference)
        if place.role in NOT_REAL:
            raise BlockError(
                f"{place.name} (value reference {reference}) is not a real variable but {NOT_REAL[place.role]}."
            )
        return place

    def whole(self, reference: int, roles: Sequence[Role]) -> Place:
        """The place of a whole number that has one of these roles.

        Raises:
            BlockError: there is no such variable, or it is of another type.
        """
        place = self.place(reference)
        if place.role not in roles:
            raise BlockError(f"{place.name} (value reference {reference}) is of another type.")
        return place

    def settable(self, reference: int, mode: Mode) -> Place:
        """The place of a real variable that may be set in this mode.

        Raises:
            BlockError: there is no such variable, or it cannot be set, or not now.
        """
        return self.check_settable(reference, self.readable(reference), mode)

    def all_readable(self, references: Sequence[int]) -> list[Place]:
        """The places of the real variables of these references, found once for each list; raises as `readable`."""
        key = tuple(references), None
        if key not in self._listed:
            self._listed[key] = [self.readable(reference) for reference in references]
        return self._listed[key]

    def all_settable(self, references: Sequence[int], mode: Mode) -> list[Place]:
        """The places of the variables of these references, all to be set in this mode; see `settable`."""
        key = tuple(references), mode
        if key not in self._listed:
            self._listed[key] = [self.settable(reference, mode) for reference in references]
        return self._listed[key]

    def check_settable(self, reference: int, place: Place, mode: Mode) -> Place:
        """The place of a variable, if it may be set in this mode.

        Raises:
            BlockError: it cannot be set, or not now.
        """
        modes = self._settable.get(place.role, ())
        if mode not in modes:
            which = f"{place.name} (value reference {reference})"
            if not modes:
                raise BlockError(f"{which} is computed and cannot be set.")
            what = "is a fixed parameter and cannot" if place.role == "fixed" else "cannot"
            raise BlockError(f"{which} {what} be set in mode '{mode}', only in: {', '.join(modes)}.")
        return place

    def clock_number(self, reference: int) -> int:
        """Number of the triggered event whose clock has this value reference.

        Raises:
            BlockError: it is not a clock.
        """
        place = self.place(reference)
        if place.role != "clock":
            raise BlockError(f"{place.name} (value reference {reference}) is not the clock of an event.")
        return place.index

    def have_role(self, references: Sequence[int], role: Role) -> bool:
        """Whether all these variables have one role.

        Args:
            references: value references.
        """
        return all(self.place(reference).role == role for reference in references)


def _system_places(system: HybridSystem, runtime: Runtime) -> list[Place]:
    own = len(system.inputs)
    return [
        *_places(exposed_inputs(system), runtime.u, lambda i: "input" if i < own else "payload"),
        *_places(system.outputs, runtime.y, lambda i: "integer_output" if system.outputs[i].integer else "output"),
        *_places(system.states, runtime.x, lambda _: "state"),
        *_places(
            system.parameter_signals,
            runtime.p,
            lambda i: "tunable" if system.parameter_signals[i].variability == "tunable" else "fixed",
        ),
    ]


def _rate_places(system: HybridSystem, derivatives: np.ndarray, indicators: np.ndarray) -> list[Place]:
    states = scalar_names(system.states)[: system.continuous_count]
    places = [Place(f"der({name})", "derivative", derivatives, i) for i, name in enumerate(states)]
    named = enumerate((*system.frictions, *system.switchings))
    return places + [Place(f"event_indicator.{name}", "indicator", indicators, i) for i, name in named]


def _places(signals: Sequence[Signal], values: Any, role: Callable[[int], Role]) -> list[Place]:
    """Places of signals that stand one after the other in `values`; `role` takes the number of the signal."""
    named = [(name, role(i)) for i, signal in enumerate(signals) for name in signal.scalar_names]
    return [Place(name, kind, values, index) for index, (name, kind) in enumerate(named)]


def _settable_modes(counts_events: bool) -> dict[Role, tuple[Mode, ...]]:
    """What comes with an event is set before the step where it is announced by a count, in event mode where by a
    clock.
    """
    at_events: Mode = "step" if counts_events else "event"
    return {
        "input": (*BEFORE_TIME, "event", "step"),
        "tunable": (*BEFORE_TIME, "event", "step"),
        "payload": (*BEFORE_TIME, at_events),
        "stamp": (*BEFORE_TIME, at_events),
        "count": (*BEFORE_TIME, "step"),
        "policy": BEFORE_TIME,
        "horizon": BEFORE_TIME,
        "state": BEFORE_TIME,
        "fixed": BEFORE_TIME,
    }
