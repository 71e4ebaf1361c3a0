"""Slaves made of plain Python, with fmpy's call surface, for the tests of the co-simulation core.

A mock is honest unless told otherwise; the tests subclass one and break one thing. `component` wraps it as the master
would.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from copy import deepcopy
from math import prod
from typing import Any, ClassVar

from fmpy.fmi1 import FMICallException
from fmpy.model_description import BaseUnit, CoSimulation, ModelDescription, ModelVariable, Unit, Unknown

from cosim.components.component import Component
from cosim.components.fmi3 import FMI3Component
from cosim.components.loading import FMI2Component
from cosim.components.start_values import start_values

DISCARD, ERROR, FATAL = 2, 3, 4


def variable(name: str, causality: str, reference: int, kind: str, **attributes: Any) -> ModelVariable:
    attributes.setdefault("variability", "continuous" if kind in ("Real", "Float64") else "discrete")
    return ModelVariable(name=name, causality=causality, valueReference=reference, type=kind, **attributes)


class Mock:
    """A slave with named real values in `v`, its own clock, and everything declared that it can do.

    Subclasses set `inputs`, `outputs`, `parameters` (name -> start, or name -> (start, unit)) and `feedthrough`, and
    write `compute` (outputs from the state) and `move(t, h)` (the step). Every mutable attribute in `memory` is state.
    """

    version = 3
    inputs: ClassVar[dict[str, Any]] = {}
    outputs: ClassVar[dict[str, Any]] = {}
    parameters: ClassVar[dict[str, Any]] = {}
    feedthrough: ClassVar[dict[str, list[str]]] = {}
    units: ClassVar[dict[str, BaseUnit | None]] = {}
    capabilities: ClassVar[dict[str, Any]] = {}
    memory: tuple[str, ...] = ("v", "x", "time")

    def __init__(self) -> None:
        self.calls: list[str] = []
        self.freed = False
        self.model_description = self.modelDescription = self._describe()
        self.component = self
        self._restart()

    # -- what a subclass writes -------------------------------------------------------------------------------------

    def begin(self) -> None:
        """Set the state `x` at the start."""
        self.x: dict[str, Any] = {}

    def compute(self) -> None:
        """Outputs into `v`."""

    def move(self, t: float, h: float) -> None:
        """State from `t` to `t + h`."""

    # -- description ------------------------------------------------------------------------------------------------

    def _describe(self) -> ModelDescription:
        real = "Real" if self.version == 2 else "Float64"
        table = [("input", self.inputs), ("output", self.outputs), ("parameter", self.parameters)]
        self.references: dict[str, int] = {}
        self._starts: dict[str, float] = {}
        variables = []
        for causality, group in table:
            for name, stated in group.items():
                start, unit = stated if isinstance(stated, tuple) else (stated, None)
                self.references[name] = len(self.references) + 1
                self._starts[name] = start
                fixed = {"variability": "fixed"} if causality == "parameter" else {}
                variables.append(variable(name, causality, self.references[name], real, unit=unit, **fixed))
        for extra in self.more_variables():
            variables.append(extra)
            self.references.setdefault(extra.name, extra.valueReference)
            self._starts.setdefault(extra.name, 0.0)
        named = {v.name: v for v in variables}
        abilities = {
            "canHandleVariableCommunicationStepSize": True,
            "canGetAndSetFMUstate": True,
            "modelIdentifier": "mock",
        } | self.capabilities
        description = ModelDescription(
            fmiVersion=f"{self.version}.0",
            modelName=type(self).__name__,
            coSimulation=CoSimulation(**abilities),
            modelVariables=variables,
            unitDefinitions=[Unit(name=n, baseUnit=b) for n, b in self.units.items()],
        )
        description.outputs = [
            Unknown(variable=named[n], dependencies=[named[i] for i in self.feedthrough.get(n, [])])
            for n in self.outputs
        ]
        return description

    def more_variables(self) -> list[ModelVariable]:
        return []

    # -- FMI life ---------------------------------------------------------------------------------------------------

    def _restart(self) -> None:
        self.v: dict[str, Any] = dict(self._starts)
        self.time = 0.0
        self.begin()

    def instantiate(self, **_: Any) -> None:
        self._restart()

    def setupExperiment(
        self, startTime: float = 0.0, stopTime: float | None = None, tolerance: float | None = None
    ) -> None:
        self.time = startTime

    def enterInitializationMode(self, startTime: float | None = None, stopTime: float | None = None) -> None:
        if startTime is not None:
            self.time = startTime

    def exitInitializationMode(self) -> None:
        pass

    def reset(self) -> None:
        self._restart()

    def terminate(self) -> None:
        self.calls.append("terminate")

    def freeInstance(self) -> None:
        self.calls.append("freeInstance")
        self.freed = True

    # -- values -----------------------------------------------------------------------------------------------------

    def _sizes(self, references: Iterable[int]) -> Iterable[tuple[str, int]]:
        """Names and numbers of values; a scalar is held as a number, an array as a flat list."""
        by_reference = {v.valueReference: v for v in self.model_description.modelVariables}
        return [(by_reference[r].name, prod(by_reference[r].shape or ())) for r in references]

    def _get(self, references: Iterable[int], nValues: int | None = None) -> list[Any]:
        self.compute()
        values: list[Any] = []
        for name, size in self._sizes(references):
            held = self.v[name]
            values += held if isinstance(held, list) else [held] * size
        assert nValues is None or nValues == len(values)
        return values

    def _set(self, references: Iterable[int], values: Iterable[Any]) -> None:
        stated = list(values)
        shaped = {v.name for v in self.model_description.modelVariables if v.shape}
        for name, size in self._sizes(references):
            taken, stated = stated[:size], stated[size:]
            assert len(taken) == size
            self.v[name] = taken if name in shaped else taken[0]
        assert not stated

    getReal = getFloat64 = getFloat32 = getString = getBinary = _get
    setReal = setFloat64 = setFloat32 = setString = setBinary = _set

    def _get_whole(self, references: Iterable[int], nValues: int | None = None) -> list[int]:
        return [round(value) for value in self._get(references, nValues)]

    def _set_whole(self, references: Iterable[int], values: Iterable[int]) -> None:
        values = list(values)
        assert all(isinstance(value, (int, bool)) for value in values)
        self._set(references, values)

    getInteger = getInt64 = getInt32 = getUInt64 = getUInt8 = getBoolean = _get_whole
    setInteger = setInt64 = setInt32 = setUInt64 = setUInt8 = setBoolean = _set_whole

    # -- steps ------------------------------------------------------------------------------------------------------

    def doStep(self, t: float, h: float) -> tuple[bool, bool, bool, float]:
        assert abs(t - self.time) < 1e-8, f"doStep from {t}, standing at {self.time}"
        assert h > 0.0
        self.move(t, h)
        self.time = t + h
        return False, False, False, self.time

    # -- state ------------------------------------------------------------------------------------------------------

    def getFMUstate(self) -> Any:
        return deepcopy({name: getattr(self, name) for name in self.memory})

    def setFMUstate(self, state: Any) -> None:
        for name, value in deepcopy(state).items():
            setattr(self, name, value)

    def freeFMUstate(self, state: Any) -> None:
        self.calls.append("freeFMUstate")

    getFMUState, setFMUState, freeFMUState = getFMUstate, setFMUstate, freeFMUstate


class Train(Mock):
    """``dp = v, dv = effort / 1000 - 0.01 v``, integrated exactly for the held effort."""

    inputs: ClassVar[dict[str, Any]] = {"effort": (0.0, "N")}
    outputs: ClassVar[dict[str, Any]] = {"position": (0.0, "m"), "speed": (0.0, "m/s")}

    def begin(self) -> None:
        self.x = {"p": 0.0, "v": 1.0}

    def compute(self) -> None:
        self.v["position"], self.v["speed"] = self.x["p"], self.x["v"]

    def move(self, t: float, h: float) -> None:
        from math import exp

        rate = 0.01
        limit = self.v["effort"] / 1000.0 / rate
        decay = exp(-rate * h)
        self.x["p"] += limit * h + (self.x["v"] - limit) * (1.0 - decay) / rate
        self.x["v"] = limit + (self.x["v"] - limit) * decay


class Counter(Mock):
    """Adds its input times the step; output `total`. The smallest thing that can be stepped."""

    inputs: ClassVar[dict[str, Any]] = {"rate": 1.0}
    outputs: ClassVar[dict[str, Any]] = {"total": 0.0}

    def begin(self) -> None:
        self.x = {"total": 0.0}

    def compute(self) -> None:
        self.v["total"] = self.x["total"]

    def move(self, t: float, h: float) -> None:
        self.x["total"] += self.v["rate"] * h


class EventMode(Mock):
    """An FMI 3 slave with event mode; subclasses plan `next_event` and write `on_event`."""

    capabilities: ClassVar[dict[str, Any]] = {"hasEventMode": True, "mightReturnEarlyFromDoStep": True}
    memory = ("v", "x", "time", "next_event")
    first_event: float | None = None

    def begin(self) -> None:
        self.next_event = self.first_event
        self.x = {"events": 0.0}
        self.in_event_mode = False

    def on_event(self) -> None:
        self.x["events"] += 1.0

    def exitInitializationMode(self) -> None:
        self.in_event_mode = True
        self.initial = True

    def enterEventMode(self) -> None:
        assert not self.in_event_mode
        self.in_event_mode, self.initial = True, False

    def enterStepMode(self) -> None:
        assert self.in_event_mode
        self.in_event_mode = False

    def updateDiscreteStates(self) -> tuple[bool, bool, bool, bool, bool, float]:
        assert self.in_event_mode
        if not self.initial:
            self.on_event()
        return False, False, False, True, self.next_event is not None, self.next_event or 0.0

    def doStep(self, t: float, h: float) -> tuple[bool, bool, bool, float]:
        assert not self.in_event_mode, "doStep in event mode"
        return super().doStep(t, h)


class FMI2(Mock):
    """Mixin: the FMI 2 interface."""

    version = 2

    def doStep(self, t: float, h: float, noSetFMUStatePriorToCurrentPoint: bool = True) -> None:
        self.may_forget = noSetFMUStatePriorToCurrentPoint
        super().doStep(t, h)

    def getBooleanStatus(self, kind: int) -> bool:
        raise FMICallException("fmi2GetBooleanStatus", ERROR)

    def getRealStatus(self, kind: int) -> float:
        raise FMICallException("fmi2GetRealStatus", ERROR)


def component(slave: Mock, name: str = "mock") -> Component:
    """A mock as the master sees it."""
    interface = FMI2Component if slave.version == 2 else FMI3Component
    return interface(name, slave, slave.model_description)


def started(slave: Mock, name: str = "mock", t0: float = 0.0) -> Component:
    """A mock in step mode."""
    made = component(slave, name)
    made.instantiate()
    made.enter_initialization(t0, 1e6)
    made.exit_initialization()
    return made


def set_start(made: Component, name: str, value: Any) -> None:
    """As a scenario writes it."""
    for typed, start in start_values(made, {name: value}).items():
        made.set_start(typed, start)


def read(made: Component, names: Sequence[str]) -> list[float]:
    import numpy as np

    values = np.zeros(len(names))
    made.reader(names, values)()
    return values.tolist()
