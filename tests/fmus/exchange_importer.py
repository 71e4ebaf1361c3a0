"""A small importer of model exchange FMUs: SciPy's solvers, event indicators, time events, told events. For the tests
only.

Independent of the runtime it drives: all it knows of a model is what the FMI functions say. fmpy's own importer knows
no clocks.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from ctypes import POINTER, c_double, cast
from dataclasses import dataclass, field
from functools import cache
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
from fmpy import read_model_description
from fmpy.fmi2 import FMU2Model, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
from fmpy.fmi3 import FMU3Model
from fmpy.model_description import ModelDescription
from scipy.integrate import DOP853, RK45, Radau

INSTANCE = "component"
"""Name of every instance, from which its noise follows where a test gives no seed."""

SOLVERS: dict[str, Any] = {"DOP853": DOP853, "RK45": RK45, "Radau": Radau}
GUESSES = 4
"""Points inside a solver step at which the indicators are looked at too, so that two changes are not taken for none."""


@dataclass(frozen=True)
class Update:
    """What a model says after an event."""

    states_changed: bool
    next_time: float


@dataclass(frozen=True)
class Notified:
    """An event that the importer tells the model at `time`, with a stamp or without."""

    time: float
    name: str
    payload: Mapping[str, float] = field(default_factory=dict)
    stamp: float | None = None


@cache
def description_of(fmu: Path) -> ModelDescription:
    """As fmpy reads it, once in a process; FMUs of the tests are not written a second time."""
    return read_model_description(str(fmu), validate=False)


def callbacks_into(log: list[str]) -> fmi2CallbackFunctions:
    """Callbacks of FMI 2 that append what is logged."""
    callbacks = fmi2CallbackFunctions()
    callbacks.logger = fmi2CallbackLoggerTYPE(lambda *a: log.append(_text(a[4])))
    return callbacks


def pass_initialization(instance: Any, version: int, start_time: float) -> None:
    """From instantiated to initialised, of either interface type."""
    if version == 2:
        instance.setupExperiment(startTime=start_time)
        instance.enterInitializationMode()
    else:
        instance.enterInitializationMode(startTime=start_time)
    instance.exitInitializationMode()


class Exchange:
    """One model exchange instance, FMI 2 or FMI 3, driven by names; `log` holds its messages."""

    def __init__(self, fmu: Path, folder: Path, logging: bool = False) -> None:
        self.description = description_of(fmu)
        self.version = int(self.description.fmiVersion[0])
        self.by_name = {v.name: v for v in self.description.modelVariables}
        self.log: list[str] = []
        self.nx = int(self.description.numberOfContinuousStates or 0)
        self.nz = int(self.description.numberOfEventIndicators or 0)
        identity = {
            "guid": self.description.guid,
            "unzipDirectory": str(folder),
            "modelIdentifier": self.description.modelExchange.modelIdentifier,
            "instanceName": INSTANCE,
        }
        self.model: Any = FMU2Model(**identity) if self.version == 2 else FMU3Model(**identity)
        self._x, self._dx, self._z = np.zeros(self.nx), np.zeros(self.nx), np.zeros(self.nz)
        self._instantiate(logging)

    def _instantiate(self, logging: bool) -> None:
        if self.version == 2:
            self._callbacks = callbacks_into(self.log)
            self.model.instantiate(callbacks=self._callbacks, loggingOn=logging)
        else:
            self.model.instantiate(loggingOn=logging, logMessage=lambda *a: self.log.append(_text(a[3])))

    # -- life -------------------------------------------------------------------------------------------------------

    def initialize(self, start_time: float = 0.0, **starts: float) -> Update:
        """To continuous-time mode."""
        self.set(**starts)
        pass_initialization(self.model, self.version, start_time)
        update = self.update()
        self.model.enterContinuousTimeMode()
        return update

    def update(self) -> Update:
        """In event mode: let everything happen, until nothing more does."""
        call = self.model.newDiscreteStates if self.version == 2 else self.model.updateDiscreteStates
        changed = False
        while True:
            again, terminate, _, values, defined, instant = call()
            assert not terminate
            changed = changed or bool(values)
            if not again:
                return Update(changed, float(instant) if defined else inf)

    def happen(self, reported: Sequence[Notified] = (), **inputs: float) -> Update:
        """An event now: event mode, inputs, what is told, update, and back."""
        self.model.enterEventMode()
        self.set(**inputs)
        for one in reported:
            self.tell(one)
        update = self.update()
        self.model.enterContinuousTimeMode()
        return update

    def tell(self, reported: Notified) -> None:
        """In event mode: by clock, or by count where the model has one."""
        stamp = {} if reported.stamp is None else {f"{reported.name}_time": reported.stamp}
        count = self.by_name.get(f"{reported.name}_count")
        if count is None:
            self.model.setClock([self.by_name[reported.name].valueReference], [True])
        elif self.version == 2:
            self.model.setInteger([count.valueReference], [self.model.getInteger([count.valueReference])[0] + 1])
        else:
            self.model.setInt32([count.valueReference], [self.model.getInt32([count.valueReference])[0] + 1])
        self.set(**dict(reported.payload), **stamp)

    # -- values -----------------------------------------------------------------------------------------------------

    def references(self, names: Sequence[str]) -> list[int]:
        return [self.by_name[name].valueReference for name in names]

    def set(self, **values: float) -> None:
        if values:
            setter = self.model.setReal if self.version == 2 else self.model.setFloat64
            setter(self.references(list(values)), list(values.values()))

    def get(self, *names: str) -> np.ndarray:
        getter = self.model.getReal if self.version == 2 else self.model.getFloat64
        return np.array(getter(self.references(names)))

    def set_state(self, t: float, x: np.ndarray) -> None:
        self.model.setTime(t)
        self._x[:] = x
        if self.nx:
            self.model.setContinuousStates(_pointer(self._x), self.nx)

    def states(self) -> np.ndarray:
        if self.nx:
            self.model.getContinuousStates(_pointer(self._x), self.nx)
        return self._x.copy()

    def derivatives(self) -> np.ndarray:
        if self.nx:
            call = self.model.getDerivatives if self.version == 2 else self.model.getContinuousStateDerivatives
            call(_pointer(self._dx), self.nx)
        return self._dx.copy()

    def indicators(self) -> np.ndarray:
        if self.nz:
            self.model.getEventIndicators(_pointer(self._z), self.nz)
        return self._z.copy()

    # -- saved states -----------------------------------------------------------------------------------------------

    def save(self) -> bytes:
        """The state of the model as bytes."""
        model = self.model
        if self.version == 2:
            saved = model.getFMUstate()
            content = bytes(model.serializeFMUstate(saved))
            model.freeFMUstate(saved)
            return content
        saved = model.getFMUState()
        content = bytes(model.serializeFMUState(saved))
        model.freeFMUState(saved)
        return content

    def restore(self, content: bytes) -> None:
        model = self.model
        if self.version == 2:
            saved = model.deSerializeFMUstate(content)
            model.setFMUstate(saved)
            model.freeFMUstate(saved)
        else:
            saved = model.deserializeFMUState(content)
            model.setFMUState(saved)
            model.freeFMUState(saved)


@dataclass
class Run:
    """What an importer did: states, and values of variables, at the asked instants; instants of state events and time
    events.
    """

    times: list[float] = field(default_factory=list)
    rows: list[np.ndarray] = field(default_factory=list)
    state_events: list[float] = field(default_factory=list)
    time_events: list[float] = field(default_factory=list)

    def values(self) -> np.ndarray:
        return np.array(self.rows)


class Importer:
    """Integrates an initialised model through its events.

    Args:
        exchange: the model, in continuous-time mode.
        update: what it said at the end of its last event.
        method: a solver of SciPy. rtol, atol: its tolerances.
        inputs: continuous inputs as a function of time, or None.
    """

    def __init__(
        self,
        exchange: Exchange,
        update: Update,
        *,
        method: str = "DOP853",
        rtol: float = 1e-10,
        atol: float = 1e-12,
        inputs: Callable[[float], Mapping[str, float]] | None = None,
    ) -> None:
        self.exchange, self.method, self.rtol, self.atol, self.inputs = exchange, method, rtol, atol, inputs
        self.next_time = update.next_time
        self.t = float(exchange.get("time")[0])
        self.run = Run()
        self.evaluations = 0

    def record(self, *names: str) -> None:
        """Note the values of these variables now, or of the continuous states where none are named."""
        self.run.times.append(self.t)
        self.run.rows.append(self.exchange.get(*names) if names else self.exchange.states())

    def advance(self, stop: float) -> None:
        """Integrate to `stop` [s], through state events and time events; events at `stop` itself have happened."""
        while self.t < stop:
            self._segment(min(stop, self.next_time))
            if self.t >= self.next_time:
                self.run.time_events.append(self.t)
                self._event()

    def happen(self, reported: Sequence[Notified] = (), **inputs: float) -> None:
        """An event that the importer causes."""
        self.next_time = self.exchange.happen(reported, **inputs).next_time

    # -- internals --------------------------------------------------------------------------------------------------

    def _event(self) -> None:
        self.next_time = self.exchange.happen().next_time

    def _evaluate(self, t: float, x: np.ndarray) -> None:
        self.exchange.set_state(t, x)
        if self.inputs is not None:
            self.exchange.set(**self.inputs(t))

    def _derivative(self, t: float, x: np.ndarray) -> np.ndarray:
        self.evaluations += 1
        self._evaluate(t, x)
        return self.exchange.derivatives()

    def _indicators(self, t: float, x: np.ndarray) -> np.ndarray:
        self._evaluate(t, x)
        return self.exchange.indicators()

    def _segment(self, stop: float) -> None:
        """To `stop`, or to the first change of an indicator before it."""
        x = self.exchange.states()
        if not self.exchange.nx:
            self.t = stop
            return self._evaluate(stop, x)
        solver = SOLVERS[self.method](self._derivative, self.t, x, stop, rtol=self.rtol, atol=self.atol)
        while self.t < stop:
            before, start = self._indicators(self.t, solver.y) > 0.0, self.t
            message = solver.step()
            assert solver.status != "failed", message
            change = self._first_change(solver, before, start)
            if change is None:
                self.t = float(solver.t)
                self._evaluate(self.t, solver.y)
                continue
            self.t, x = change
            self._evaluate(self.t, x)
            self.run.state_events.append(self.t)
            return self._event()
        return None

    def _first_change(self, solver: Any, before: np.ndarray, start: float) -> tuple[float, np.ndarray] | None:
        """The first instant after a change, located to rounding by bisection, and the states there."""
        if not self.exchange.nz:
            return None
        dense = solver.dense_output()
        states: Callable[[float], np.ndarray] = lambda t: solver.y if t == solver.t else dense(t)  # noqa: E731
        lower = start
        for upper in np.linspace(start, solver.t, GUESSES + 2)[1:]:
            if np.any((self._indicators(upper, states(upper)) > 0.0) != before):
                break
            lower = upper
        else:
            return None
        while True:
            middle = 0.5 * (lower + upper)
            if not lower < middle < upper:
                return float(upper), states(upper)
            if np.any((self._indicators(middle, states(middle)) > 0.0) != before):
                upper = middle
            else:
                lower = middle


def _pointer(values: np.ndarray) -> Any:
    return cast(values.ctypes.data, POINTER(c_double))


def _text(message: Any) -> str:
    return message.decode() if isinstance(message, bytes) else str(message)
