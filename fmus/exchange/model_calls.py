"""The calls of model exchange, alike for FMI 1, 2 and 3: time, states, derivatives, indicators, events."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from fmpy.fmi1 import FMICallException, fmi1EventInfo
from fmpy.fmi2 import fmi2EventInfo

from fmus.exchange.jacobian import DirectionalDerivatives
from fmus.exchange.native_steps import CExchange, EventInfo3, describe_model, load_steps
from fmus.fmi.native_calls import WARNING
from fmus.fmi.standard import DISCARD, NEVER

_NAMES = {
    "rates": ("GetDerivatives", "GetDerivatives", "GetContinuousStateDerivatives"),
    "update": ("EventUpdate", "NewDiscreteStates", "UpdateDiscreteStates"),
    "nominals": ("GetNominalContinuousStates", "GetNominalsOfContinuousStates", "GetNominalsOfContinuousStates"),
}
"""Functions whose name depends on the version of FMI, by version."""


class EventIteration(NamedTuple):
    """What an FMU says at the end of one event iteration.

    Attributes:
        again: another one is needed. terminate: it asks for the end. next_event: that it knows of [s].
        nominals: magnitudes of its states changed.
    """

    again: bool
    terminate: bool
    next_event: float
    nominals: bool = False

    @classmethod
    def of_first(cls, info: fmi1EventInfo) -> EventIteration:
        """What FMI 1 says of an event.

        Args:
            info: as filled by the FMU.
        """
        due = info.nextEventTime if info.upcomingTimeEvent != b"\x00" else NEVER
        return cls(info.iterationConverged == b"\x00", info.terminateSimulation != b"\x00", due)


class ModelCalls:
    """Calls of one instance. Arrays are ctypes arrays of doubles; a status above a warning raises `FMICallException`.

    Args:
        slave: fmpy's model, instantiated or not. version: of FMI. counts: of states, and of event indicators.
        functions: of the library by name, as it exports them.
        complete_steps: whether it wants to know of each step that the solver completed.
        slopes: arguments of its directional derivatives; None where it has none.
    """

    def __init__(
        self,
        slave: Any,
        version: int,
        counts: tuple[int, int],
        functions: dict[str, Any],
        *,
        complete_steps: bool,
        slopes: DirectionalDerivatives | None = None,
    ) -> None:
        self._slave, self._version, self._functions = slave, version, functions
        self.state_count, self.indicator_count = counts
        self._complete_steps, self.slopes = complete_steps, slopes
        self.rate_count = 0
        """How often derivatives were asked for, beside what C counts."""
        self._names: list[str] = []
        self.differing: int | None = None
        """Number of the derivative whose slope was not what a difference gives."""
        self.failed: FMICallException | None = None  # with which the FMU last refused what a solver asked
        self._set_time, self._set_states = self._made("SetTime"), self._made("SetContinuousStates")
        self._get_rates, self._get_indicators = self._made(self._name("rates")), self._made("GetEventIndicators")
        self._get_states, self._get_nominals = self._made("GetContinuousStates"), self._made(self._name("nominals"))
        self._info, self._info3 = fmi2EventInfo(), EventInfo3()
        begin, fields = ctypes.addressof(self._info3), ("again", "terminate", "nominals", "values", "defined")
        places = [begin + getattr(EventInfo3, name).offset for name in fields]
        due = ctypes.c_double.from_address(begin + EventInfo3.next_time.offset)
        self._places = *(ctypes.byref(ctypes.c_bool.from_address(p)) for p in places), ctypes.byref(due)
        self._update = self._made(self._name("update"))

    def move(self, t: float, x: Any) -> None:
        """Set time [s] and states."""
        self._done(self._set_time, t)
        if self.state_count:
            self._done(self._set_states, x, self.state_count)

    def set_time(self, t: float) -> None:
        """Set the independent variable [s] alone."""
        self._done(self._set_time, t)

    def rates(self, t: float, x: Any, written: Any) -> int:
        """Derivatives, for a solver: see `cvode.Rates`.

        Args:
            t: instant [s]. x: states. written: where to.
        """
        if not self.state_count:  # a state that stands, so that the solver has one
            written[0] = 0.0
            return 0
        self.rate_count += 1
        return self._tried(t, x, self._get_rates, written, self.state_count)

    def jacobian(self, t: float, x: Any, rates: Any, columns: int) -> int:
        """Derivatives of the derivatives by the states, for a solver, by directional derivatives.

        Args:
            t: instant [s]. x: states. rates: derivatives there.
            columns: address of the doubles that the matrix goes to, column by column.
        """
        slopes, n = self.slopes, self.state_count
        assert slopes is not None
        said, get = self._tried(t, x, lambda: 0), self._made("GetDirectionalDerivative")
        for j in range(n):
            said = said or self._said(get, get(*slopes.arguments(j, columns + 8 * j * n)))
        if said:
            return said
        room = ctypes.c_double * n

        def rates_at(moved: np.ndarray) -> np.ndarray | None:
            point, found = room.from_buffer(slopes.scratch), room.from_buffer(slopes.scratch, 8 * n)
            point[:] = moved.tolist()
            return None if self.rates(t, point, found) else np.array(found)

        matrix = np.ctypeslib.as_array((room * n).from_address(columns))
        self.differing = slopes.differing(np.array(x), np.array(rates), matrix, rates_at)
        return 0 if self.differing is None else -1

    def indicators(self, t: float, x: Any, written: Any) -> int:
        """Event indicators likewise.

        Args:
            t: instant [s]. x: states. written: where to.
        """
        return self._tried(t, x, self._get_indicators, written, self.indicator_count)

    def states(self, written: Any) -> None:
        """Read the continuous states.

        Args:
            written: where to.
        """
        if self.state_count:
            self._done(self._get_states, written, self.state_count)

    def nominals(self) -> np.ndarray:
        """Magnitudes of the states, shape (n,), at least one; 1 where the FMU says nothing that is one."""
        found = np.ones(max(self.state_count, 1))
        if self.state_count:
            array = (ctypes.c_double * self.state_count).from_address(found.ctypes.data)
            self._done(self._get_nominals, array, self.state_count)
        sizes = np.where(np.isfinite(found) & (found != 0.0), np.abs(found), 1.0)
        if self.slopes is not None:
            self.slopes.nominals[:] = sizes.tolist()
        return sizes

    def enter_event_mode(self) -> None:
        """To Event Mode, which FMI 1 does not know."""
        if self._version > 1:
            self.call("EnterEventMode")

    def enter_continuous_mode(self) -> None:
        """To Continuous-Time Mode, which FMI 1 does not know."""
        if self._version > 1:
            self.call("EnterContinuousTimeMode")

    def update(self) -> EventIteration:
        """One event iteration, in Event Mode."""
        if self._version == 1:
            info = fmi1EventInfo()
            self._done(self._update, b"\x00", ctypes.byref(info))
            return EventIteration.of_first(info)
        if self._version == 2:
            self._done(self._update, ctypes.byref(self._info))
            said = self._info
            due = said.nextEventTime if said.nextEventTimeDefined else NEVER
            again, end = bool(said.newDiscreteStatesNeeded), bool(said.terminateSimulation)
            return EventIteration(again, end, due, bool(said.nominalsOfContinuousStatesChanged))
        self._done(self._update, *self._places)
        info = self._info3
        return EventIteration(info.again, info.terminate, info.next_time if info.defined else NEVER, info.nominals)

    def completed(self) -> tuple[bool, bool]:
        """The solver completed a step that ends here: whether the FMU wants Event Mode, and the end."""
        if not self._complete_steps:
            return False, False
        if self._version == 1:
            wanted = ctypes.c_char()
            self.call("CompletedIntegratorStep", ctypes.byref(wanted))
            return wanted.value != b"\x00", False
        kind: Any = ctypes.c_int if self._version == 2 else ctypes.c_bool
        enter, end = kind(), kind()
        self.call("CompletedIntegratorStep", kind(0), ctypes.byref(enter), ctypes.byref(end))
        return bool(enter.value), bool(end.value)

    def native(self, made: CExchange) -> tuple[CExchange, Any] | None:
        """The FMU as C calls it, and what calls it; None where there is no compiler, or its calls are logged.

        Args:
            made: what is filled.
        """
        library = None if self._slave.fmiCallLogger is not None else load_steps()
        if library is None:
            return None
        version, later = self._version, ("EnterEventMode", "EnterContinuousTimeMode")
        names = ["SetTime", "SetContinuousStates", self._name("rates"), "GetEventIndicators", "CompletedIntegratorStep"]
        names += ["GetContinuousStates", self._name("nominals"), self._name("update")]
        names += later if version > 1 else ("", "")
        if self.slopes is not None:
            names.append("GetDirectionalDerivative")
        unused = "" if self._complete_steps else "CompletedIntegratorStep"
        functions = {i: self._functions[f"fmi{version}{n}"] for i, n in enumerate(names) if n not in ("", unused)}
        counts = self.state_count, self.indicator_count
        self._names = names
        made.info = ctypes.addressof(self._info if version < 3 else self._info3)
        describe_model(made, self._slave.component, functions, version, counts, self.slopes)
        return made, library

    def after_native(self, model: CExchange, *, refused: bool) -> None:
        """Take over what C met: warnings are counted, and a refusal is kept, or raised outside of the solver.

        Args:
            model: as C left it. refused: whether the FMU refused outside of the solver.

        Raises:
            FMICallException: it did.
        """
        if not model.noted:
            return
        model.noted = 0
        for place, name in enumerate(self._names):
            for _ in range(model.warnings[place]):
                self._slave.warned(f"fmi{self._version}{name}")
            model.warnings[place] = 0
        if model.differing > 0:
            self.differing, model.differing = int(model.differing) - 1, 0
        if model.status:
            error = FMICallException(f"fmi{self._version}{self._names[model.place]}", int(model.status))
            model.status = 0
            if refused:
                raise error
            self.failed = error

    def call(self, name: str, *arguments: Any) -> None:
        """Call a function with the instance and arguments.

        Args:
            name: without the prefix of FMI. arguments: of it.
        """
        self._done(self._made(name), *arguments)

    # -- internals --------------------------------------------------------------------------------------------------

    def _name(self, what: str) -> str:
        return _NAMES[what][self._version - 1]

    def _made(self, name: str) -> Callable[..., int]:
        """A function of the library with the instance as its first argument; it returns the status."""
        whole = f"fmi{self._version}{name}"
        slave, function = self._slave, self._functions[whole]

        def call(*arguments: Any) -> int:
            status = int(function(slave.component, *arguments))
            if slave.fmiCallLogger is not None:
                every = (slave.component, *arguments)
                slave._log_fmi_args(whole, function.argnames, function.argtypes, every, ctypes.c_int, status)
            if status == WARNING:
                slave.warned(whole)
            return status

        call.whole = whole  # type: ignore[attr-defined]
        return call

    @staticmethod
    def _done(call: Callable[..., int], *arguments: Any) -> None:
        status = call(*arguments)
        if status > WARNING:
            raise FMICallException(call.whole, status)  # type: ignore[attr-defined]

    def _tried(self, t: float, x: Any, get: Callable[..., int], *arguments: Any) -> int:
        """What a solver is to make of a call at an instant [s] and states."""
        call, status = self._set_time, self._set_time(t)
        if status <= WARNING and self.state_count:
            call, status = self._set_states, self._set_states(x, self.state_count)
        if status <= WARNING:
            call, status = get, get(*arguments)
        return self._said(call, status)

    def _said(self, call: Callable[..., int], status: int) -> int:
        """What a solver is to make of a call."""
        if status <= WARNING:
            return 0
        self.failed = FMICallException(call.whole, status)  # type: ignore[attr-defined]
        return 1 if status == DISCARD else -1
