"""Instances: what co-simulation and model exchange have in common when an FMU is driven under test, for FMI 2.0 and
3.0.

Every call is guarded: whatever the FMU or fmpy throws comes out as a `SlaveError` with what the FMU logged last.
"""

from __future__ import annotations

import ctypes
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from itertools import product
from math import prod
from pathlib import Path
from typing import Any

import numpy as np
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import defaultCallbacks, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
from fmpy.model_description import ModelDescription, ModelVariable

from fmus.fmi.description import declared_tolerance
from fmus.fmi.library import load
from fmus.fmi.ports import make_reader, make_writer
from fmus.fmi.standard import FATAL, fmi_version
from fmus.fmi.types import NUMERIC_TYPES
from fmus.plain import one_line

LOADING = "loading the library"
INSTANTIATING = "instantiate"
MESSAGES_KEPT = 20
OWN_MISTAKES = (
    TypeError,
    AttributeError,
    LookupError,
    NameError,
    AssertionError,
    ArithmeticError,
    ctypes.ArgumentError,
)
"""What wrong calls end with, whatever FMU is called."""


def element_names(variable: ModelVariable) -> list[str]:
    """The names of the elements of an array, ``y[1,2]``, row by row; of a scalar its own."""
    if not variable.shape:
        return [variable.name]
    return [
        f"{variable.name}[{','.join(map(str, place))}]" for place in product(*(range(1, n + 1) for n in variable.shape))
    ]


class SlaveError(RuntimeError):
    """A call of an FMU failed; the message says which and why."""


class FmuInstance:
    """An instance of an unpacked FMU, for either interface type.

    Args:
        folder: where the FMU was unpacked.
        description: its model description.
        name: instance name.
        logging: whether the FMU is asked to log.

    Raises:
        SlaveError: the library cannot be loaded.
    """

    interface: str

    def __init__(
        self, folder: Path, description: ModelDescription, name: str = "checked", *, logging: bool = False
    ) -> None:
        self.name, self.description, self.logging = name, description, logging
        self.version = fmi_version(description)
        self.tolerance = declared_tolerance(description)
        self.variables: dict[str, ModelVariable] = {
            n: v for v in description.modelVariables for n in (v.name, *element_names(v))
        }
        self.messages: deque[str] = deque(maxlen=MESSAGES_KEPT)
        self.terminated = False
        self._alive = self._running = False
        self.slave: Any = self.guarded(LOADING, lambda: load(folder, description, self.interface, name))

    # -- what it declares -------------------------------------------------------------------------------------------

    @property
    def declared(self) -> Any:
        """The element of the model description that holds the capabilities."""
        return getattr(self.description, self.interface)

    @property
    def can_save(self) -> bool:
        """Whether it says that its state can be saved and restored."""
        return bool(self.declared.canGetAndSetFMUstate)

    @property
    def missing_functions(self) -> list[str]:
        """Functions of the standard that the library does not export."""
        return list(self.slave.dll.missing)

    def names(self, causality: str) -> list[str]:
        """Names of the numeric scalars and elements of one causality, each once; no clocks, nothing clocked, no
        aliases.
        """
        own = [v for v in self.description.modelVariables if v.alias is None and v.causality == causality]
        return [n for v in own if v.type in NUMERIC_TYPES and not v.clocks for n in element_names(v)]

    # -- life -------------------------------------------------------------------------------------------------------

    def instantiate(self) -> None:
        """Create the instance."""
        self.guarded(INSTANTIATING, self._instantiate)
        self._alive = True

    def reset(self) -> None:
        """Back to the state after `instantiate`."""
        self.guarded("reset", self.slave.reset)
        self.terminated = self._running = False

    def terminate(self) -> None:
        """End the run; errors of a dying instance are of no interest."""
        if self._alive and self._running:
            self._running = False
            with suppress(Exception):
                self.slave.terminate()

    def free(self) -> None:
        """Free the instance and its library."""
        with suppress(Exception):
            if self._alive:
                self._alive = False
                self.slave.freeInstance()
            elif self.slave.component is None:
                self.slave.freeLibrary()

    def free_instance_only(self) -> None:
        """Free the instance; the library stays loaded."""
        self._alive = self._running = False
        call = getattr(self.slave, f"fmi{self.version}FreeInstance")
        self.guarded("freeInstance", lambda: call(self.slave.component))
        self.slave.component = None

    def set_start(self, name: str, value: float) -> None:
        """Set a scalar numeric variable before initialisation."""
        write, buffer = self.writer([name])
        buffer[0] = value
        write()

    # -- values -----------------------------------------------------------------------------------------------------

    def reader(self, names: Sequence[str], values: np.ndarray) -> Callable[[], None]:
        """A call that reads variables into `values`, shape (len(names),)."""
        variables, places, held = self._whole(names)
        read = make_reader(self.slave, self.version, variables, held)

        def call() -> None:
            self.guarded("reading variables", read)
            values[:] = held[places]

        return call

    def writer(self, names: Sequence[str]) -> tuple[Callable[[], None], np.ndarray]:
        """A call that writes variables, and the array of shape (len(names),) it writes from."""
        variables, places, held = self._whole(names)
        buffer, write = np.zeros(len(names)), make_writer(self.slave, self.version, variables, held)

        def call() -> None:
            held[places] = buffer
            self.guarded("writing variables", write)

        return call, buffer

    def _whole(self, names: Sequence[str]) -> tuple[list[ModelVariable], np.ndarray, np.ndarray]:
        """The whole variables of scalars and elements, the places of these among all their values, and room for the
        values.
        """
        whole = {self.variables[n].name: self.variables[n] for n in names}
        place = {n: k for k, n in enumerate(n for v in whole.values() for n in element_names(v))}
        return list(whole.values()), np.array([place[n] for n in names], dtype=np.intp), np.zeros(len(place))

    def read(self, names: Sequence[str]) -> np.ndarray:
        """Values of scalar numeric variables, shape (len(names),)."""
        values = np.zeros(len(names))
        self.reader(names, values)()
        return values

    def get(self, variable: ModelVariable) -> list[Any]:
        """The value of one variable of any type, by the getter of its type.

        Raises:
            SlaveError: it cannot be read.
        """
        kind = variable.type
        if kind == "Enumeration":
            kind = "Integer" if self.version == 2 else "Int64"
        call = getattr(self.slave, f"get{kind}")
        size = {"nValues": prod(variable.shape)} if variable.shape else {}
        values: list[Any] = self.guarded(
            f"get{kind} of {variable.name}", lambda: call([variable.valueReference], **size)
        )
        return values

    def derivative(self, unknowns: Sequence[str], known: str) -> np.ndarray:
        """Directional derivative of the unknowns along one known, shape (len(unknowns),)."""
        references = [self.variables[n].valueReference for n in unknowns]
        along = [self.variables[known].valueReference]
        return np.array(
            self.guarded(
                "getDirectionalDerivative", lambda: self.slave.getDirectionalDerivative(references, along, [1.0])
            )
        )

    # -- state ------------------------------------------------------------------------------------------------------

    def save(self) -> Any:
        """The state."""
        return self.guarded("getFMUState", self.slave.getFMUState)

    def restore(self, state: Any) -> None:
        """Return to a saved state."""
        self.guarded("setFMUState", lambda: self.slave.setFMUState(state))
        self.terminated = False

    def release(self, state: Any) -> None:
        """Free a saved state."""
        self.guarded("freeFMUState", lambda: self.slave.freeFMUState(state))

    def serialize(self, state: Any) -> bytes:
        """A saved state as bytes."""
        return bytes(self.guarded("serializeFMUState", lambda: self.slave.serializeFMUState(state)))

    def deserialize(self, content: bytes) -> Any:
        """A saved state from bytes."""
        return self.guarded("deserializeFMUState", lambda: self.slave.deserializeFMUState(content))

    # -- errors -----------------------------------------------------------------------------------------------------

    def failure(self, reason: str, t: float | None = None) -> SlaveError:
        """An error of this instance at `t` [s], with what it logged last."""
        place = "" if t is None else f" at t = {t:g} s"
        return SlaveError(reason + place + (f"; the FMU says: {self.messages[-1]}" if self.messages else ""))

    def guarded(self, what: str, call: Callable[[], Any]) -> Any:
        """Run a call; whatever the FMU or fmpy throws for it becomes a `SlaveError`, a mistake of ours stays what it
        is.
        """
        try:
            return call()
        except (SlaveError, *OWN_MISTAKES):
            raise
        except Exception as error:
            if isinstance(error, FMICallException) and error.status == FATAL:
                self._alive = self._running = False
            raise self.failure(f"{what} failed: {error or type(error).__name__}") from error

    def _instantiate(self) -> None:
        if self.version == 2:
            self.slave.instantiate(callbacks=self._callbacks(), loggingOn=self.logging)
        else:
            self.slave.instantiate(loggingOn=self.logging, logMessage=self._log_fmi3, **self._arguments())

    def _arguments(self) -> Mapping[str, Any]:
        """Further arguments of instantiate, FMI 3."""
        return {}

    def _enter_initialization(self, start_time: float, stop_time: float) -> None:
        """Begin initialisation; times in [s]."""
        slave, tolerance = self.slave, self.tolerance
        if self.version == 2:
            setup = slave.setupExperiment
            self.guarded(
                "setupExperiment", lambda: setup(tolerance=tolerance, startTime=start_time, stopTime=stop_time)
            )
            self.guarded("enterInitializationMode", slave.enterInitializationMode)
        else:
            enter = slave.enterInitializationMode
            self.guarded(
                "enterInitializationMode", lambda: enter(tolerance=tolerance, startTime=start_time, stopTime=stop_time)
            )

    def _callbacks(self) -> Any:
        """fmpy's callbacks with our logger in place of the one that prints."""
        callbacks = fmi2CallbackFunctions()
        callbacks.logger = fmi2CallbackLoggerTYPE(lambda _e, _n, _s, _c, message: self._note(message))
        callbacks.allocateMemory = defaultCallbacks.allocateMemory
        callbacks.freeMemory = defaultCallbacks.freeMemory
        return callbacks

    def _log_fmi3(self, _environment: Any, _status: int, _category: bytes, message: bytes) -> None:
        self._note(message)

    def _note(self, message: bytes | None) -> None:
        text = one_line((message or b"").decode("utf-8", "replace"))
        if text:
            self.messages.append(text)
