"""Components: everything the master can step, with one face for slaves of FMI 1, 2 and 3 and Python blocks.

A component wraps an object with the call surface of fmpy's `FMU1Slave`, `FMU2Slave` or `FMU3Slave`; whether that is a
sealed library or a block makes no difference here. The dialects are in `loading` and `fmi3`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from fmpy.model_description import ModelDescription, ModelVariable

from cosim.components.described import DescribedComponent
from cosim.components.start_values import StartValue
from cosim.diagnostics.call_statistics import CallStatistics, count_methods
from cosim.diagnostics.messages import LogChoice, MessageLog
from cosim.errors import CouplingError, RunError, nearest
from cosim.process.last_call import LAST_CALL, READ, STEP, WRITE
from fmu_observer.event_protocol import OUTCOME_VARIABLES
from fmus.fmi.capabilities import tool_warning
from fmus.fmi.derivatives import input_derivative_writer
from fmus.fmi.elements import described
from fmus.fmi.instance import shown
from fmus.fmi.slave import Slave
from fmus.fmi.surroundings import Surroundings
from fmus.fmi.types import FLOATING_TYPES
from fmus.fmi.values import element_reader, signs, write_start
from plant_models.hybrid.missing import MISSED_SAMPLES

_OUTCOMES, _MISSED = "outcomes", "missed samples"
_WITHOUT_STATES = "without it: algorithm gauss-seidel or jacobi, control fixed, no balise method rollback"


_STATUS_CATEGORIES = frozenset({"logStatusWarning", "logStatusDiscard", "logStatusError", "logStatusFatal"})
"""Standard names of the categories for what is wrong."""


@dataclass(frozen=True)
class _LogSwitch:
    """Arguments of setDebugLogging.

    Args:
        on: whether to log. categories: which ones; none means all.
    """

    on: bool
    categories: tuple[str, ...] = ()


def _log_switch(name: str, description: ModelDescription, choice: LogChoice | None) -> _LogSwitch | None:
    """How to switch a component's log; None where it is left as it is."""
    if choice is None or choice == "none":
        return None if choice is None else _LogSwitch(False)
    declared = [category.name for category in description.logCategories]
    if choice == "all":
        return _LogSwitch(True)
    if choice == "errors":
        wrong = tuple(c for c in declared if c in _STATUS_CATEGORIES)
        return _LogSwitch(True, wrong) if wrong else None
    for category in choice:
        if category not in declared:
            known = nearest(category, declared) if declared else "it declares none; use log = 'all'."
            raise CouplingError(f"{name}: log: there is no log category {category!r}; {known}")
    return _LogSwitch(True, tuple(choice)) if choice else _LogSwitch(False)


def _switch_log(slave: Any, fmi_version: int, switch: _LogSwitch) -> str | None:
    """Call setDebugLogging; what the slave answers if it refuses, since a refused log is no reason not to run."""
    try:
        if fmi_version == 1:
            slave.setDebugLogging(switch.on)  # FMI 1.0 knows no categories
        else:
            slave.setDebugLogging(switch.on, list(switch.categories))
    except Exception as error:
        return f"setDebugLogging({switch.on}, {list(switch.categories)}) was refused: {error}"
    return None


class _DifferentiableComponent(DescribedComponent, Slave):
    """A slave in the words of a scenario, with its derivatives."""

    def make_derivative_writer(self, names: Sequence[str]) -> tuple[Callable[[], None], np.ndarray]:
        """A call of setRealInputDerivatives of first order (FMI 1 and 2), and the array of shape (len(names),) it
        writes from. They hold for the coming step only.

        Args:
            names: of real inputs.

        Raises:
            CouplingError: the slave does not take derivatives (canInterpolateInputs), or a name is no continuous real
            input.
        """
        references, buffer = [v.valueReference for v in self._differentiable_inputs(names)], np.zeros(len(names))
        turn = signs(self, names)
        held = buffer if turn is None else np.zeros(len(names))
        write = input_derivative_writer(self.slave, self.fmi_version, references, held)

        def turn_and_write() -> None:
            assert turn is not None
            turn(buffer, held)
            write()

        return self.guarded(f"derivatives of {shown(names)}", write if turn is None else turn_and_write), buffer

    def derivative_call(
        self, unknowns: Sequence[str], knowns: Sequence[str], seed: Sequence[float]
    ) -> Callable[[], np.ndarray]:
        """As for `Instance`.

        Raises:
            CouplingError: the slave does not declare providesDirectionalDerivatives, or a variable is not real.
        """
        if self.fmi_version == 1 or not self.capabilities.providesDirectionalDerivatives:
            raise CouplingError(f"{self.name} gives no directional derivatives: it does not declare them.")
        for element in (element for name in (*unknowns, *knowns) for element in self.elements(name)):
            if element.variable.type not in FLOATING_TYPES:
                raise CouplingError(
                    f"{self.name}.{element.name} has no derivative: it is a {described(element.variable)}."
                )
        return super().derivative_call(unknowns, knowns, seed)

    def _differentiable_inputs(self, names: Sequence[str]) -> list[ModelVariable]:
        if self.fmi_version == 3 or not self.capabilities.canInterpolateInputs:
            why = (
                "FMI 3 has no input derivatives"
                if self.fmi_version == 3
                else "it does not declare canInterpolateInputs"
            )
            raise CouplingError(f"{self.name} takes no derivatives of inputs: {why}.")
        variables = [self.variable(name, "input") for name in names]
        for variable in variables:
            if variable.type != "Real":
                raise CouplingError(f"{self.name}.{variable.name} has no derivative: it is a {described(variable)}.")
        return variables


class Component(_DifferentiableComponent):
    """One stepped thing, from instantiation to the end.

    The life: `configure`, `instantiate`, `set_start`, `enter_initialization`, readers and writers in turn,
    `exit_initialization`, then `advance` and `notify` in turn, `terminate`, `free`. `reader` and `writer` are prepared
    once and called without arguments. Variables go by name; elements of arrays are named ``x[1]``, ``m[2,3]``, from 1,
    row by row. `save`, `restore` and `release` exist where `can_save` says so. Counters: `seconds` spent in doStep,
    `calls` of it, `call_statistics` of everything else. `messages` are what the slave logged. `time` is where it
    stands [s].
    `terminated` says that the slave asked for the end of the run. `trespasses` are what it changed for everybody in the
    process before its first step, each with the call that did; it was put back. Whatever a call of the slave throws
    comes out as a `RunError` with component, time and the names of the variables concerned.

    Args:
        name: name in the scenario.
        slave: object with fmpy's slave call surface.
        description: its model description.
        source: where it comes from, for people.
        kind: ``FMU`` or ``block``.
        release_files: called once at the end, e.g. to remove an unpacked archive.
    """

    without_states = f" (which its description promises; {_WITHOUT_STATES})"

    def __init__(
        self,
        name: str,
        slave: Any,
        description: ModelDescription,
        *,
        source: str = "",
        kind: str = "FMU",
        release_files: Callable[[], None] | None = None,
    ) -> None:
        self.source, self.kind = source, kind
        super().__init__(name, slave, description)
        self.starts: dict[str, StartValue] = {}
        self._release_files = release_files
        self.messages = MessageLog(name)
        # that others take at the start of a step, as where they were recorded
        self.held_outputs: frozenset[str] = frozenset()
        # that others follow on lines within a step, known ahead by `course`
        self.line_outputs: frozenset[str] = frozenset()
        # says where it stands [s] while somebody else than Python steps it
        self.clock: Callable[[], float] | None = None
        self.log: _LogSwitch | None = None
        self.call_statistics = {kind: CallStatistics() for kind in _KINDS}
        self.trespasses: dict[str, str] = {}
        self._numbers, self._call_numbers = LAST_CALL.numbers(name), dict[str, int]()
        self._call_note, self._step_number = LAST_CALL, self._numbers + STEP
        self._readers: dict[str, Callable[[], Mapping[str, int] | None]] = {}

    # -- how it stands ----------------------------------------------------------------------------------------------

    @property
    def seconds_in_all(self) -> float:
        """Seconds in the slave: steps, and everything in `call_statistics` [s]."""
        return self.seconds + sum(statistics.seconds for statistics in self.call_statistics.values())

    # -- life -------------------------------------------------------------------------------------------------------

    def instantiate(self) -> None:
        """Create the instance.

        Raises:
            RunError: the slave refuses; where it needs another program, the message says so.
        """
        try:
            super().instantiate()
        except RunError as error:
            warning = tool_warning(self.name, self.description)
            if warning is None:
                raise
            raise RunError(f"{error} Perhaps because: {warning}", self.name, error.time) from error
        self._readers.clear()
        self._switch_log()

    def set_start(self, name: str, value: StartValue) -> None:
        """Set a parameter, a start state or an unconnected input before initialisation.

        Raises:
            CouplingError: the variable does not exist.
            RunError: the slave refuses the value.
        """
        variable = self.variable(name)
        element = None if name in self.variables else self.variables.element(name)
        values = value if isinstance(value, list) else [value]
        self.guard(f"setting {name} = {value!r}", lambda: write_start(self, variable, element, values))
        self.starts[name] = value

    def reader(self, names: Sequence[str], values: np.ndarray) -> Callable[[], None]:  # noqa: D102 - see Instance
        return self._counted("get", READ, f"reading {shown(names)}", self._unguarded_reader(names, values))

    def writer(  # noqa: D102 - see Instance
        self, names: Sequence[str], values: np.ndarray | None = None
    ) -> tuple[Callable[[], None], np.ndarray]:
        write, buffer = self._unguarded_writer(names, values)
        return self._counted("set", WRITE, f"writing {shown(names)}", write), buffer

    def free(self) -> None:
        """Free the instance, its library and its files."""
        super().free()
        if self._release_files is not None:
            self._release_files()
            self._release_files = None

    def take_files(self) -> Callable[[], None] | None:
        """What releases its files, which from now on is up to the caller; None where it has none."""
        release, self._release_files = self._release_files, None
        return release

    def outcomes(self) -> Mapping[str, int] | None:
        """Counts of what became of the events delivered, where the slave keeps them: blocks, and FMUs with
        `OUTCOME_VARIABLES`.

        Of an FMU that cannot say any more those that were read last.
        """
        counters = getattr(self.slave, "counters", None)
        if counters is not None:
            return dict(vars(counters))
        return (self._readers.get(_OUTCOMES) or self._count_reader(_OUTCOMES, OUTCOME_VARIABLES))()

    def missed_samples(self) -> Mapping[str, int]:
        """How many measurements were missing at samples, by the name of the count; empty where none can be.

        Apart from `outcomes`, which a receiver asks for while calls of an FMU are answered for the stepper in C.
        """
        return (self._readers.get(_MISSED) or self._count_reader(_MISSED, {MISSED_SAMPLES: MISSED_SAMPLES}))() or {}

    def _count_reader(self, kind: str, names: Mapping[str, str]) -> Callable[[], Mapping[str, int] | None]:
        """A call that reads variables that count, prepared for the slave as it is instantiated; it gives None where
        there are none.
        """
        counted = [name for name in names if name in self.variables]  # an older export knows fewer
        called, values = [names[name] for name in counted], np.zeros(len(counted))
        read = element_reader(self, counted, values) if counted and self._alive else None

        def counts() -> Mapping[str, int] | None:
            try:
                if self._alive and read is not None:
                    read()
            except Exception as error:
                self.explained("counts of events", error)  # after a fatal error nothing is asked any more
            return dict(zip(called, map(int, values), strict=True)) or None

        if self._alive:
            self._readers[kind] = counts
        return counts

    def choose_log(self, choice: LogChoice | None) -> None:
        """What the slave shall log; before `instantiate`. None leaves that to the slave.

        Args:
            choice: ``none``, ``errors``, ``all`` or categories.

        Raises:
            CouplingError: a category that the slave does not declare.
        """
        self.log = _log_switch(self.name, self.description, choice)
        self.logging = self.log is not None and self.log.on
        self.messages.silent = choice == "none"

    def note(self, message: str | bytes | None, status: int | str = 0, category: str | bytes | None = None) -> None:
        """Keep a message of the slave's own log; what it said of something wrong is part of a failure."""
        self.messages.add(self.time if self.clock is None else self.clock(), message, status, category)

    def failure(self, reason: str, t: float | None = None) -> RunError:
        """A RunError of this component at `t` [s], by default where it stands, with what the slave logged last."""
        if self.messages:
            reason = f"{reason.rstrip('.')}. The FMU says: {self.messages.reason}"
        when = self.time if t is None else t
        place = "" if math.isnan(when) else f" at t = {when:g} s"
        return RunError(f"Component '{self.name}'{place}: {reason}", self.name, when)

    @property
    def said_why(self) -> bool:
        """Whether it logged that something is wrong, which is part of a failure."""
        return self.messages.said_fault

    # -- internals --------------------------------------------------------------------------------------------------

    def __init_subclass__(cls, **named: Any) -> None:
        super().__init_subclass__(**named)
        count_methods(cls)

    def _switch_log(self) -> None:
        refused = None if self.log is None else _switch_log(self.slave, self.fmi_version, self.log)
        if refused is not None:
            self.note(refused, "warning")

    def _counted(self, kind: str, number: int, what: str, call: Callable[[], None]) -> Callable[[], None]:
        """`guarded`, counted, and noted as the last call: the one of this number among those that are made often."""
        statistics: CallStatistics = self.call_statistics[kind]
        return statistics.counting(
            call, lambda error: self.explained(what, error), LAST_CALL.call, self._numbers + number
        )

    def guard(self, what: str, call: Callable[..., Any], *arguments: Any) -> Any:  # noqa: D102 - see Instance
        # those of its steps are compared elsewhere; values are set often
        before = None if self._running else Surroundings(whole=not what.startswith("setting"))
        number = self._call_numbers.get(what) or self._number_of(what)
        LAST_CALL.call[0], LAST_CALL.time[0] = number, self.time
        try:
            return call(*arguments)
        except Exception as error:
            raise self.explained(what, error) from error
        finally:
            LAST_CALL.call[0] = 0
            for changed in () if before is None else before.put_back():
                self.trespasses[changed] = what

    def _number_of(self, what: str) -> int:
        """The number of a call among all; what stands behind ``=``, a value, is no part of it."""
        number = self._call_numbers[what] = LAST_CALL.number(self.name, what.partition(" = ")[0])
        return number

    def explained(self, what: str, error: Exception, t: float | None = None) -> Exception:  # noqa: D102 - see Instance
        return error if isinstance(error, RunError) else super().explained(what, error, t)


_KINDS = ("get", "set", "event", "save", "restore", "release")
