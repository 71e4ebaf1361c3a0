"""One test FMU stepped by plain fmpy, by the names of its variables: what the closed forms are checked against."""

from __future__ import annotations

import ctypes
import shutil
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from fmpy import extract, read_model_description
from fmpy.fmi1 import FMU1Slave, defaultCallbacks, fmi1CallbackFunctions, fmi1CallbackLoggerTYPE
from fmpy.fmi2 import FMU2Slave, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
from fmpy.fmi3 import FMU3Slave

OLD = {"Real": "Real", "Integer": "Integer", "Enumeration": "Integer", "Boolean": "Boolean", "String": "String"}
RAISED = 100
"""Event iterations before a driver gives up."""


class Plain:
    """An instance of any FMI version. `log`: status, category and message of what it says, arguments not filled in (FMI
    1, 2).
    """

    def __init__(self, fmu: Path, folder: Path, event_mode: bool | None = None, early: bool = True) -> None:
        self.description = read_model_description(str(fmu), validate=False)
        self.version = int(self.description.fmiVersion[0])
        self.variables = {v.name: v for v in self.description.modelVariables}
        self.log: list[tuple[int, str, str]] = []
        interface = self.description.coSimulation
        kind = {1: FMU1Slave, 2: FMU2Slave, 3: FMU3Slave}[self.version]
        self.slave: Any = kind(
            guid=self.description.guid,
            modelIdentifier=interface.modelIdentifier,
            unzipDirectory=str(folder),
            instanceName="test_fmus",
        )
        if self.version == 1:
            _mend(self.slave)
        can = self.version == 3 and bool(interface.hasEventMode)
        self.event_mode = can if event_mode is None else event_mode
        self.early = early
        self.time = 0.0
        self.next_event = np.inf

    # -- life

    def instantiate(self, logging: bool = False, intermediate: Callable[..., None] | None = None) -> None:
        """`intermediate`: the callback of FMI 3."""
        if self.version == 3:
            self.slave.instantiate(
                loggingOn=logging,
                eventModeUsed=self.event_mode,
                earlyReturnAllowed=self.early,
                intermediateUpdate=intermediate,
                logMessage=lambda _e, status, category, text: self.log.append(
                    (status, category.decode(), text.decode())
                ),
            )
            return
        first = self.version == 1
        callbacks: Any = fmi1CallbackFunctions() if first else fmi2CallbackFunctions()
        logger = fmi1CallbackLoggerTYPE if first else fmi2CallbackLoggerTYPE
        callbacks.logger = logger(
            lambda _e, _n, status, kind, text: self.log.append((status, kind.decode(), text.decode()))
        )
        callbacks.allocateMemory, callbacks.freeMemory = defaultCallbacks.allocateMemory, defaultCallbacks.freeMemory
        self.slave.instantiate(loggingOn=logging, **{"functions" if first else "callbacks": callbacks})

    def initialize(self, start: float = 0.0, **values: Any) -> Plain:
        """Set start values and initialise; in event mode the first events are settled."""
        for name, value in values.items():
            self.set(name, value)
        self.time = start
        if self.version == 1:
            self.slave.initialize(start)
        elif self.version == 2:
            self.slave.setupExperiment(startTime=start)
            self.slave.enterInitializationMode()
            self.slave.exitInitializationMode()
        else:
            self.slave.enterInitializationMode(startTime=start)
            self.slave.exitInitializationMode()
            if self.event_mode:
                self.settle()
                self.slave.enterStepMode()
        return self

    # -- values

    def _call(self, verb: str, name: str) -> tuple[Callable[..., Any], list[int]]:
        variable = self.variables[name]
        kind = OLD[variable.type] if self.version < 3 else {"Enumeration": "Int64"}.get(variable.type, variable.type)
        return getattr(self.slave, f"{verb}{kind}"), [variable.valueReference]

    def get(self, name: str) -> Any:
        """A scalar, or a list for an array, row by row."""
        call, references = self._call("get", name)
        shape = self.shape(name)
        if self.version == 3 and self.variables[name].type != "Clock":
            values = call(references, nValues=int(np.prod(shape)))
        else:
            values = call(references)
        values = [v.decode() if isinstance(v, bytes) and self.variables[name].type == "String" else v for v in values]
        return list(values) if shape else values[0]

    def set(self, name: str, value: Any) -> None:
        """A scalar, or a flat list for an array."""
        call, references = self._call("set", name)
        call(references, list(value) if isinstance(value, list | tuple) else [value])

    def shape(self, name: str) -> tuple[int, ...]:
        """Of a variable, with the structural parameters as they are now."""
        return tuple(
            int(d.start) if d.start is not None else int(self.slave.getUInt64([int(d.valueReference)])[0])
            for d in self.variables[name].dimensions
        )

    # -- steps and events

    def step(self, until: float) -> tuple[bool, bool, bool, float]:
        """One doStep; FMI 3's four results (FMI 1, 2: nothing happened, and `until`)."""
        done = self.slave.doStep(self.time, until - self.time)
        result = done if self.version == 3 else (False, False, False, until)
        self.time = result[3]
        return result

    def settle(self) -> None:
        """updateDiscreteStates until it asks for no more."""
        for _ in range(RAISED):
            again, _, _, _, defined, when = self.slave.updateDiscreteStates()
            self.next_event = when if defined else np.inf
            if not again:
                return
        raise AssertionError("does not settle")

    @contextmanager
    def event(self) -> Iterator[None]:
        """Event mode around what is done to clocks and inputs; ends with the update."""
        self.slave.enterEventMode()
        yield
        self.settle()
        self.slave.enterStepMode()

    def tick(self, clock: str) -> None:
        """Activate an input clock, in event mode."""
        self.slave.setClock([self.variables[clock].valueReference], [True])

    def ticks(self, clock: str) -> bool:
        """Whether an output clock is active, in event mode."""
        return bool(self.slave.getClock([self.variables[clock].valueReference])[0])

    def interval(self, clock: str) -> tuple[float, int]:
        """Interval [s] and qualifier of an input clock."""
        interval, qualifier = (ctypes.c_double * 1)(), (ctypes.c_int * 1)()
        reference = (ctypes.c_uint32 * 1)(self.variables[clock].valueReference)
        self.slave.fmi3GetIntervalDecimal(self.slave.component, reference, 1, interval, qualifier)
        return interval[0], qualifier[0]

    def run(self, until: float, step: float) -> None:
        """Communication points every `step` [s], events of its own handled where they are announced."""
        count = round((until - self.time) / step)
        start = self.time
        for point in [start + step * (k + 1) for k in range(count)]:
            while self.time < point - 1e-12:
                needed, _, _, _ = self.step(
                    min(point, self.next_event) if self.next_event > self.time + 1e-12 else point
                )
                if self.event_mode and (needed or self.time >= self.next_event - 1e-12):
                    with self.event():
                        pass


def _mend(slave: Any) -> None:
    """fmpy 0.3.32 takes the status of many FMI 1.0 functions for the address of a string."""
    for name, function in slave._functions.items():
        if function.restype is ctypes.c_char_p and not name.endswith(("Platform", "Version")):
            function.restype = ctypes.c_int


@contextmanager
def plain(fmu: Path, *, event_mode: bool | None = None, early: bool = True, **arguments: Any) -> Iterator[Plain]:
    """An instantiated FMU, freed at the end. Arguments as for `Plain` and `Plain.instantiate`."""
    folder = Path(tempfile.mkdtemp(prefix="test_fmus-"))
    try:
        extract(str(fmu), str(folder))
        made = Plain(fmu, folder, event_mode, early)
        made.instantiate(**arguments)
        try:
            yield made
        finally:
            made.slave.freeInstance()
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def row(instance: Plain, names: Sequence[str]) -> list[Any]:
    """The values of some variables."""
    return [instance.get(name) for name in names]
