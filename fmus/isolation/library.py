"""The library of an isolated FMU as fmpy calls it: the proxy, and what it says of the process behind it."""

from __future__ import annotations

import ctypes
import itertools
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fmpy.model_description import ModelDescription

from fmus.fmi.binaries import platform_folder
from fmus.fmi.library import load
from fmus.isolation.limits import OwnProcess
from fmus.isolation.programs import isolation_programs

_PATH_BYTES = 4096
_INPUTS = 8
_numbers = itertools.count(1)
_running = ctypes.c_long(0)
"""Processes of isolated FMUs that this one has: the proxies, of which each FMU has its own, count here."""


class _Options(ctypes.Structure):
    """``Options`` of ``session.h``."""

    _fields_ = (
        *((name, ctypes.c_char * _PATH_BYTES) for name in ("program", "library", "folder")),
        ("identifier", ctypes.c_char * 256),
        *((name, ctypes.c_long) for name in ("processes", "memory", "files", "file_bytes", "output_bytes")),
        ("limit", ctypes.c_void_p),
        ("running", ctypes.c_void_p),
    )


class IsolatedLibrary:
    """A proxy that was loaded, with a process that has loaded the library of an FMU.

    Args:
        proxy: loaded; nobody else uses this file. options: how the process is started.
        names: of variables by value reference, for the last inputs.

    Raises:
        RuntimeError: the process cannot be started, or cannot load the library.
    """

    def __init__(self, proxy: ctypes.CDLL, options: _Options, names: Mapping[int, str]) -> None:
        self._proxy, self._names, self._said = proxy, names, ""
        self._closed = self._interrupted = False
        self._handle = proxy._handle
        self._prefix = f"{Path(proxy._name).stem}_"  # of the functions of FMI 1
        proxy.isolation_reason.restype = proxy.isolation_printed.restype = ctypes.c_char_p
        for name in ("has", "open", "interrupted"):
            getattr(proxy, f"isolation_{name}").restype = ctypes.c_bool
        if not proxy.isolation_open(ctypes.byref(options)):
            raise RuntimeError(self.reason)

    def __getattr__(self, name: str) -> Any:
        plain = name.removeprefix(self._prefix)
        if not self._proxy.isolation_has(plain.encode()):
            raise AttributeError(f"undefined symbol: {name}")
        return getattr(self._proxy, plain)

    @property
    def reason(self) -> str:
        """How the process ended, what the FMU printed last and its last inputs; empty as long as it lives."""
        if self._closed or not (said := self._text("reason")):
            return self._said
        references, values = (ctypes.c_uint32 * _INPUTS)(), (ctypes.c_double * _INPUTS)()
        count = self._proxy.isolation_inputs(references, values)
        inputs = ", ".join(f"{self._names.get(references[k], references[k])} = {values[k]:.12g}" for k in range(count))
        lines = self._text("printed").split("\n")
        printed = next((line for line in reversed(lines) if line.strip()), "")
        more = [f"the last inputs were {inputs}"] if inputs else []
        more += [f"the last line that it printed is {printed!r}"] if printed else []
        self._said = "; ".join([said, *more])
        return self._said

    @property
    def interrupted(self) -> bool:
        """Whether the last process ended because a user asked for the end."""
        return self._interrupted if self._closed else bool(self._proxy.isolation_interrupted())

    def close(self) -> None:
        """End all processes behind it; what went wrong in that is in `reason`."""
        if not self._closed:
            self._proxy.isolation_close()
            self._interrupted = self.interrupted
            self._said, self._closed = self.reason, True

    def _text(self, name: str) -> str:
        text: bytes = getattr(self._proxy, f"isolation_{name}")()
        return text.decode("utf-8", "replace")


def load_isolated(
    folder: Path,
    description: ModelDescription,
    interface: str,
    name: str,
    isolation: OwnProcess,
    call_limit: int | None = None,
) -> Any:
    """As `fmus.fmi.library.load`, complete, with the library in a process of its own.

    Args:
        folder: where the FMU was unpacked.
        description: its model description.
        interface: ``coSimulation`` or ``modelExchange``.
        name: instance name.
        isolation: what its process may take.
        call_limit: address of the longest time a call may take, a double [s], 0 for any; None for any.

    Returns:
        An object with fmpy's call surface, not yet instantiated. Its `reason` says how the process ended.

    Raises:
        IsolationUnavailable: FMUs cannot be isolated here.
        Exception: the library cannot be loaded.
    """
    programs = isolation_programs()
    identifier = getattr(description, interface).modelIdentifier
    place = folder.absolute() / "binaries" / platform_folder(description)
    library = place / f"{identifier}.so"
    if not library.is_file():
        raise FileNotFoundError(f"Cannot find shared library {library}.")
    proxy = place / f"isolation-{next(_numbers)}.so"  # what is loaded twice would be one
    shutil.copyfile(programs.proxy, proxy)
    options = _Options(
        program=bytes(programs.child), library=bytes(library), folder=bytes(place), identifier=identifier.encode()
    )
    for key, most in vars(isolation).items():
        setattr(options, key, most)
    options.limit, options.running = call_limit, ctypes.addressof(_running)
    names = _real_names(description)
    return load(
        folder,
        description,
        interface,
        name,
        complete=True,
        stand_in=(proxy.stem, lambda loaded: IsolatedLibrary(loaded, options, names), _InProcessOfItsOwn),
    )


class _InProcessOfItsOwn:
    """What an isolated slave has beside fmpy's calls."""

    apart = True
    dll: IsolatedLibrary
    _stated = ""

    @property
    def reason(self) -> str:
        """How its process ended; as long as it lives, what the solver of a model exchange FMU has to say."""
        return self.dll.reason or self._stated

    @reason.setter
    def reason(self, stated: str) -> None:
        self._stated = stated

    def freeInstance(self) -> None:
        """Free the instance and its library. Raises RuntimeError where its process ends in that."""
        super().freeInstance()  # type: ignore[misc]
        self._demand_alive(before="")

    def freeLibrary(self) -> None:
        """End the process, and unload the proxy. Raises RuntimeError where the FMU did not let itself be unloaded."""
        before = self.dll.reason
        self.dll.close()
        super().freeLibrary()  # type: ignore[misc]
        self._demand_alive(before)

    def _demand_alive(self, before: str) -> None:
        if self.dll.reason and not before:
            raise RuntimeError(self.dll.reason)


def _real_names(description: ModelDescription) -> dict[int, str]:
    """Names of floating-point variables by value reference; inputs before others that share one."""
    kinds = ("Real", "Float64")
    real = [v for v in description.modelVariables if v.type in kinds]
    ordered = sorted(real, key=lambda v: v.causality == "input")
    return {v.valueReference: v.name for v in ordered}
