"""Libraries: fmpy's slave and model classes over a shared library that may lack functions, and which ones it must have.

fmpy refuses a library that lacks any function of the standard. Here a missing one is noted, and fails when it is
called.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

from fmpy.fmi1 import FMU1Model
from fmpy.fmi2 import FMU2Model, FMU2Slave
from fmpy.fmi3 import FMU3Model, FMU3ScheduledExecution, FMU3Slave
from fmpy.model_description import ModelDescription

from fmus.fmi.fmi1_library import FMU1SlaveRepaired
from fmus.fmi.native_calls import FUNCTION
from fmus.fmi.standard import CO_SIMULATION, MODEL_EXCHANGE, SCHEDULED_EXECUTION, WARNING, fmi_version

FACES: dict[tuple[int, str], type] = {
    (1, CO_SIMULATION): FMU1SlaveRepaired,
    (1, MODEL_EXCHANGE): FMU1Model,
    (2, CO_SIMULATION): FMU2Slave,
    (2, MODEL_EXCHANGE): FMU2Model,
    (3, CO_SIMULATION): FMU3Slave,
    (3, MODEL_EXCHANGE): FMU3Model,
    (3, SCHEDULED_EXECUTION): FMU3ScheduledExecution,
}

CAPABILITY_FUNCTIONS = {
    "canGetAndSetFMUstate": ("GetFMUstate", "SetFMUstate", "FreeFMUstate"),
    "canSerializeFMUstate": ("SerializedFMUstateSize", "SerializeFMUstate", "DeSerializeFMUstate"),
    "providesDirectionalDerivative": ("GetDirectionalDerivative",),
    "providesAdjointDerivatives": ("GetAdjointDerivative",),
    "canInterpolateInputs": ("SetRealInputDerivatives",),
    "hasEventMode": ("EnterEventMode", "UpdateDiscreteStates", "EnterStepMode"),
}
"""Functions that belong to a capability, in FMI 2 spelling; case is ignored."""


def functions_of_capabilities(description: ModelDescription, interface: str) -> Iterator[tuple[str, str]]:
    """Pairs of a declared capability and a C function that it needs, names in lower case.

    Args:
        description: model description of the FMU.
        interface: ``coSimulation`` or ``modelExchange``.
    """
    declared = getattr(description, interface)
    for capability, functions in CAPABILITY_FUNCTIONS.items():
        if getattr(declared, capability, False):
            yield from ((capability, f"fmi{fmi_version(description)}{name}".lower()) for name in functions)


StandIn = tuple[str, Callable[[ctypes.CDLL], Any], type]
"""A library in place of the FMU's, beside it: its name without the ending, what is called when it is loaded and
returns what has its functions, and what the object has beside fmpy's calls.
"""


def load(
    folder: Path,
    description: ModelDescription,
    interface: str,
    name: str,
    *,
    complete: bool = False,
    stand_in: StandIn | None = None,
) -> Any:
    """An object with fmpy's call surface over the library of an unpacked FMU; not yet instantiated.

    Args:
        folder: where the FMU was unpacked.
        description: its model description.
        interface: ``coSimulation`` or ``modelExchange``.
        name: instance name.
        complete: whether a library that lacks a function of the standard is refused.
        stand_in: a library in place of that of the FMU.

    Raises:
        Exception: the library cannot be loaded.
    """
    face: Any = FACES[fmi_version(description), interface]
    identifier = getattr(description, interface).modelIdentifier
    if stand_in is not None:
        identifier, opened, more = stand_in
        face = _with_functions(face, opened, more)
    else:
        face = _complete(face) if complete else _with_functions(face, _Library)
    return face(guid=description.guid, modelIdentifier=identifier, unzipDirectory=str(folder), instanceName=name)


class MissingFunctionError(RuntimeError):
    """A function of the standard was called that the library does not export."""


class _Missing:
    """Stands where a function should be; fmpy hangs its types on it."""

    argnames: Any
    argtypes: Any
    restype: Any

    def __init__(self, name: str) -> None:
        self._name = name

    def __call__(self, *_: Any) -> Any:
        raise MissingFunctionError(f"the library does not export {self._name}")


class _Library:
    """A loaded library whose missing functions are noted in `missing`."""

    def __init__(self, dll: ctypes.CDLL) -> None:
        self._dll = dll
        self._handle = dll._handle
        self.missing: list[str] = []

    def __getattr__(self, name: str) -> Any:
        try:
            return getattr(self._dll, name)
        except AttributeError:
            self.missing.append(name)
            return _Missing(name)


@cache
def _complete(face: type) -> Any:
    return _with_functions(face)


def _with_functions(face: type, opened: Callable[[ctypes.CDLL], Any] | None = None, *more: type) -> Any:
    """A class of fmpy that counts warnings, over what `opened` makes of the library where it is given."""

    def load_functions(self: Any) -> None:
        if opened is not None:
            self.dll = opened(self.dll)
        _load_functions(face, self)

    def call(self: Any, name: str, *arguments: Any) -> Any:
        status, function = face._call(self, name, *arguments), self._functions[name]  # type: ignore[attr-defined]
        if status == WARNING and function.restype is ctypes.c_int and isinstance(function, FUNCTION):
            self.warned(name)  # whoever stands in for the library repeats what was counted before
        return status

    members = {"_loadFunctions": load_functions, "_call": call, "warned": lambda _self, _name: None}
    return type(face.__name__, (*more, face), members)  # fmpy goes by the name of the class


_signatures: dict[type, dict[str, tuple[list[str], list[Any], Any]]] = {}


def _load_functions(face: Any, slave: Any) -> None:
    """fmpy's `_loadFunctions`, which derives the C types of the same functions anew for every library."""
    known = _signatures.get(face)
    if known is None:
        face._loadFunctions(slave)
        functions = slave._functions.items()
        _signatures[face] = {name: (c.argnames, c.argtypes, c.restype) for name, c in functions}
        return
    old = face.__name__.startswith("FMU1")
    for name, types in known.items():
        c_name = f"{slave.modelIdentifier}_{name.replace('fmi1', 'fmi')}" if old else name
        function = slave._functions[name] = getattr(slave.dll, c_name)
        function.argnames, function.argtypes, function.restype = types
