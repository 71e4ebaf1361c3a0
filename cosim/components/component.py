"""Components: everything the master can step, with one face for FMI 2 slaves, FMI 3 slaves and Python blocks.

A component wraps an object with the call surface of fmpy's `FMU2Slave` or `FMU3Slave`; whether that is a sealed library or a
block makes no difference here. The dialects are in `fmi2` and `fmi3`.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from fmpy.fmi1 import FMICallException
from fmpy.model_description import ModelDescription, ModelVariable

from cosim.errors import CouplingError, RunError, nearest
from fmus.ports import make_reader, make_writer
from plant_models.hybrid.units import BASE_SYMBOLS, Unit, UnitError, parse_unit

TIME_TOLERANCE = 1e-9
"""Communication times closer than this are the same [s]; a billionth of a second is above rounding at 1e5 s."""

NUMERIC_TYPES = frozenset(
    {"Real", "Integer", "Boolean", "Enumeration", "Float64", "Float32"}
    | {f"{sign}Int{bits}" for sign in ("", "U") for bits in (8, 16, 32, 64)}
)
MESSAGES_KEPT = 20
NEVER = math.inf
FATAL = 4  # FMI status: the slave must not be called again
OWN_TOOL = "fmu-observer"
NAMES_SHOWN = 6


@dataclass(frozen=True)
class EventPort:
    """A triggered event a component declares.

    Args:
        name: the event.
        trigger: value reference of the clock (FMI 3) or of the count (FMI 2).
        stamp: value reference of ``<name>_time``, or None where the component has none.
        payload: field of the event (``position``, ...) -> value reference.
    """

    name: str
    trigger: int
    stamp: int | None
    payload: Mapping[str, int]


class Component(ABC):
    """One stepped thing, from instantiation to the end.

    The life: `instantiate`, `set_start`, `enter_initialization`, readers and writers in turn, `exit_initialization`, then
    `advance` and `tell` in turn, `terminate`, `free`. `reader` and `writer` are prepared once and called without arguments.
    `save`, `restore` and `release` exist where `can_save` says so. Counters: `seconds` spent in steps, `calls` of doStep.
    `time` is where it stands [s]. `terminated` says that the slave asked for the end of the run. Whatever a call of the slave
    throws comes out as a `RunError` with component, time and the names of the variables concerned.

    Args:
        name: name in the scenario.
        slave: object with fmpy's slave call surface.
        description: its model description.
        source: where it comes from, for people.
        kind: ``FMU`` or ``block``.
        release_files: called once at the end, e.g. to remove an unpacked archive.
    """

    fmi_version: int
    real_type: str
    event_needs_step: bool
    """Whether an event that was told happens in the next step only (FMI 2), or at once (FMI 3)."""

    def __init__(
        self, name: str, slave: Any, description: ModelDescription, *, source: str = "", kind: str = "FMU",
        release_files: Callable[[], None] | None = None,
    ) -> None:  # fmt: skip
        self.name, self.slave, self.description, self.source, self.kind = name, slave, description, source, kind
        self.variables: dict[str, ModelVariable] = {v.name: v for v in description.modelVariables}
        self.events: dict[str, EventPort] = self._find_events()
        self.starts: dict[str, float] = {}
        self.seconds, self.calls = 0.0, 0
        self.time = math.nan
        self.terminated = False
        self.next_event = NEVER
        self._release_files = release_files
        self._alive = self._running = False
        self.messages: deque[str] = deque(maxlen=MESSAGES_KEPT)
        self._units = {u.name: u for u in description.unitDefinitions}

    # -- what it is -------------------------------------------------------------------------------------------------

    @property
    def can_save(self) -> bool:
        """Whether the component says that its state can be saved and restored."""
        return bool(self.description.coSimulation.canGetAndSetFMUstate)

    @property
    def can_vary_step(self) -> bool:
        """Whether the component says that the communication step may vary."""
        return bool(self.description.coSimulation.canHandleVariableCommunicationStepSize)

    @property
    def restores_exactly(self) -> bool:
        """Whether its states are known to be exact without a probe: those of blocks and of the FMUs this package exports."""
        return self.can_save and (self.kind == "block" or self.description.generationTool == OWN_TOOL)

    def names(self, causality: str) -> list[str]:
        """Names of the scalar numeric variables of one causality, without the triggers, stamps and payloads of events."""
        hidden = self.event_references() if causality == "input" else set()
        return [
            v.name
            for v in self.description.modelVariables
            if v.causality == causality and v.type in NUMERIC_TYPES and not v.shape and v.valueReference not in hidden
        ]

    def variable(self, name: str, *causalities: str) -> ModelVariable:
        """The variable of this name.

        Raises:
            CouplingError: there is none, or it has another causality; the nearest names are suggested.
        """
        found = self.variables.get(name)
        if found is None:
            candidates = [v.name for v in self.variables.values() if not causalities or v.causality in causalities]
            raise CouplingError(f"{self.name}: no variable {name!r}; {nearest(name, candidates)}")
        if causalities and found.causality not in causalities:
            raise CouplingError(
                f"{self.name}.{name} has causality '{found.causality}', expected {' or '.join(causalities)}; "
                f"such variables: {', '.join(self.names(causalities[0])) or 'none'}."
            )
        return found

    def unit_name(self, name: str) -> str | None:
        """Name of a variable's unit, its own or that of its declared type; None where there is none."""
        variable = self.variables[name]
        declared = variable.declaredType
        found: str | None = variable.unit or (declared.unit if declared is not None else None)
        return found

    def unit(self, name: str) -> Unit | None:
        """The unit of a variable from the FMU's own unit definitions, or None where it declares none.

        A relative quantity (a temperature difference) has no offset.

        Raises:
            UnitError: a unit name without definition that cannot be understood.
        """
        unit_name = self.unit_name(name)
        if unit_name is None:
            return None
        try:
            unit = self._defined_unit(unit_name) or parse_unit(unit_name)
        except UnitError as error:
            raise UnitError(f"{self.name}.{name}: {error}") from error
        return replace(unit, offset=0.0) if self._is_relative(name) else unit

    # -- life -------------------------------------------------------------------------------------------------------

    def instantiate(self) -> None:
        """Create the instance."""
        self._guard("instantiate", self._instantiate)
        self._alive = True

    def reset(self) -> None:
        """Back to the state after `instantiate`."""
        self._guard("reset", self.slave.reset)
        self._forget()
        self.time, self.terminated, self.next_event = math.nan, False, NEVER
        self._running = False

    def set_start(self, name: str, value: float) -> None:
        """Set a parameter, a start state or an unconnected input before initialisation.

        Raises:
            CouplingError: the variable does not exist, cannot be set, or is not a scalar number.
            RunError: the slave refuses the value.
        """
        variable = self.variable(name)
        if variable.causality in ("output", "independent", "calculatedParameter") or variable.variability == "constant":
            what = "is constant" if variable.variability == "constant" else f"has causality '{variable.causality}'"
            raise CouplingError(f"{self.name}.{name} cannot be set: it {what}.")
        if variable.type not in NUMERIC_TYPES or variable.shape:
            raise CouplingError(f"{self.name}.{name} cannot be set: it is a {_kind(variable)}; only scalar numbers can.")
        write, buffer = self._unguarded_writer([name])
        buffer[0] = value
        self._guard(f"setting {name} = {value!r}", write)
        self.starts[name] = value

    @abstractmethod
    def enter_initialization(self, start_time: float, stop_time: float) -> None:
        """Begin initialisation; times in [s]."""

    @abstractmethod
    def exit_initialization(self) -> None:
        """End initialisation, discrete states settled."""

    def reader(self, names: Sequence[str], values: np.ndarray) -> Callable[[], None]:
        """A call that reads variables into `values`, shape (len(names),), a contiguous view of the caller's array."""
        read = make_reader(self.slave, self.fmi_version, [self.variables[n] for n in names], values)
        return self._guarded(f"reading {_shown(names)}", read)

    def writer(self, names: Sequence[str]) -> tuple[Callable[[], None], np.ndarray]:
        """A call that writes variables, and the array of shape (len(names),) it writes from."""
        write, buffer = self._unguarded_writer(names)
        return self._guarded(f"writing {_shown(names)}", write), buffer

    @abstractmethod
    def advance(self, t: float, until: float) -> None:
        """Step from `t` to `until` [s], own time events on the way included.

        Raises:
            RunError: the component failed or did not get there.
        """

    @abstractmethod
    def tell(self, event: EventPort, t: float, stamp: float, payload: Mapping[str, float]) -> None:
        """A triggered event is delivered at `t` [s]; it happened at `stamp` [s].

        Args:
            event: one of `events`.
            t: current time of the component [s].
            stamp: when the event happened [s]: at or before `t`, or within the coming step where the component takes stamps.
            payload: fields by name; fields the component does not declare are dropped.

        Where `event_needs_step` says so, only the last event told before a step happens, and it happens in that step.
        """

    @abstractmethod
    def save(self) -> Any:
        """The state, to be restored any number of times and released once."""

    @abstractmethod
    def restore(self, state: Any) -> None:
        """Return to a saved state."""

    @abstractmethod
    def release(self, state: Any) -> None:
        """Free a saved state."""

    def terminate(self) -> None:
        """End the run; errors of a dying component are of no interest."""
        if self._alive and self._running:
            self._running = False
            _quietly(self.slave.terminate)

    def free(self) -> None:
        """Free the instance, its library and its files."""
        if self._alive:
            self._alive = False
            _quietly(self.slave.freeInstance)
        elif self._release_files is not None and math.isnan(self.time):
            _quietly(self._free_library)  # loaded, never instantiated: freeInstance did not do it
        if self._release_files is not None:
            self._release_files()
            self._release_files = None

    def outcomes(self) -> Mapping[str, int] | None:
        """Counts of what became of the events told, where the component keeps them (blocks do)."""
        counters = getattr(self.slave, "counters", None)
        return None if counters is None else dict(vars(counters))

    def note(self, message: str | bytes | None) -> None:
        """Keep a message of the slave's own log; the last ones are part of a failure and of the summary."""
        text = message.decode("utf-8", "replace") if isinstance(message, bytes) else str(message or "")
        if text.strip():
            self.messages.append(text.strip())

    def failure(self, reason: str, t: float | None = None) -> RunError:
        """A RunError of this component at `t` [s], by default where it stands, with what the slave logged last."""
        reason += f" The FMU says: {self.messages[-1]}" if self.messages else ""
        when = self.time if t is None else t
        place = "" if math.isnan(when) else f" at t = {when:g} s"
        return RunError(f"Component '{self.name}'{place}: {reason}", self.name, when)

    # -- internals --------------------------------------------------------------------------------------------------

    @abstractmethod
    def _instantiate(self) -> None: ...

    @abstractmethod
    def _find_events(self) -> dict[str, EventPort]: ...

    def _forget(self) -> None:
        """Drop what the dialect remembers of a run; by default there is nothing."""
        return

    def _free_library(self) -> None:
        self.slave.freeLibrary()

    def _payload_of(self, event: str, references: Mapping[str, int]) -> dict[str, int]:
        prefix = f"{event}_"
        reserved = {f"{event}_time", f"{event}_count"}
        real = {n: r for n, r in references.items() if self.variables[n].type == self.real_type and not self.variables[n].shape}
        return {n.removeprefix(prefix): r for n, r in real.items() if n.startswith(prefix) and n not in reserved}

    def event_references(self) -> set[int]:
        """Value references of the triggers, stamps and payloads of all events: the master sets them, no connection may."""
        hidden: set[int] = set()
        for event in self.events.values():
            hidden |= {event.trigger, *event.payload.values()} | ({event.stamp} if event.stamp is not None else set())
        return hidden

    def _defined_unit(self, unit_name: str) -> Unit | None:
        defined = self._units.get(unit_name)
        if defined is None or defined.baseUnit is None:
            return None
        base = defined.baseUnit
        powers = tuple(int(getattr(base, symbol) or 0) for symbol in BASE_SYMBOLS)
        return Unit(powers, 1.0 if base.factor is None else float(base.factor), float(base.offset or 0.0))

    def _is_relative(self, name: str) -> bool:
        variable = self.variables[name]
        declared = variable.declaredType
        own = variable.relativeQuantity
        return bool(declared is not None and declared.relativeQuantity) if own is None else bool(own)

    def _unguarded_writer(self, names: Sequence[str]) -> tuple[Callable[[], None], np.ndarray]:
        buffer = np.zeros(len(names))
        return make_writer(self.slave, self.fmi_version, [self.variables[n] for n in names], buffer), buffer

    def _guarded(self, what: str, call: Callable[[], None]) -> Callable[[], None]:
        def guarded() -> None:
            try:
                call()
            except Exception as error:
                raise self._explained(what, error) from error

        return guarded

    def _guard(self, what: str, call: Callable[[], Any]) -> Any:
        """Run a call of the slave; turn whatever it throws into a RunError with component and time."""
        try:
            return call()
        except Exception as error:
            raise self._explained(what, error) from error

    def _explained(self, what: str, error: Exception, t: float | None = None) -> RunError:
        if isinstance(error, FMICallException) and getattr(error, "status", None) == FATAL:
            self._alive = self._running = False  # after a fatal error no function of the slave may be called
        return error if isinstance(error, RunError) else self.failure(f"{what} failed: {error or type(error).__name__}", t)


def _shown(names: Sequence[str]) -> str:
    return ", ".join(names[:NAMES_SHOWN]) + (f" and {len(names) - NAMES_SHOWN} more" if len(names) > NAMES_SHOWN else "")


def _kind(variable: ModelVariable) -> str:
    return f"{variable.type} array of shape {variable.shape}" if variable.shape else str(variable.type)


def _quietly(call: Callable[[], Any]) -> None:
    """A component that fails while it is put away changes nothing any more."""
    with suppress(Exception):
        call()
