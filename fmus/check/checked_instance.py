"""Instances driven under test: what co-simulation and model exchange have in common, and slaves of FMI 2.0 and 3.0.

Whatever the FMU or fmpy throws comes out as a `SlaveError` with what the FMU logged last; a mistake of the check stays
what it is.
"""

from __future__ import annotations

import ctypes
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Any

from fmpy.model_description import ModelDescription

from fmus.exchange.description import is_solved
from fmus.exchange.slave import as_slave
from fmus.fmi.elements import elements_of
from fmus.fmi.fmi2 import FMI2Slave
from fmus.fmi.fmi3 import FMI3Slave
from fmus.fmi.instance import Instance
from fmus.fmi.library import load
from fmus.fmi.standard import CO_SIMULATION, MODEL_EXCHANGE, fmi_version
from fmus.fmi.types import NUMERIC_TYPES
from fmus.plain import one_line

LOADING = "loading the library"
_MESSAGES_KEPT = 20
_OWN_MISTAKES = (
    TypeError,
    AttributeError,
    LookupError,
    NameError,
    AssertionError,
    ArithmeticError,
    ctypes.ArgumentError,
)
"""What wrong calls end with, whatever FMU is called."""


class SlaveError(RuntimeError):
    """A call of an FMU failed; the message says which and why."""


class FmuInstance(Instance):
    """An instance of an unpacked FMU, for either interface type.

    Args:
        folder: where the FMU was unpacked.
        description: its model description.
        name: instance name.
        logging: whether the FMU is asked to log.

    Raises:
        SlaveError: the library cannot be loaded.
    """

    mistakes = (SlaveError, *_OWN_MISTAKES)

    def __init__(
        self, folder: Path, description: ModelDescription, name: str = "checked", *, logging: bool = False
    ) -> None:
        self.messages: deque[str] = deque(maxlen=_MESSAGES_KEPT)
        self.ends = True  # whether it is terminated and freed; an FMU that dies there is left as it is
        self.announce: Callable[[str], None] = lambda _what: None  # the call that ends it, and nothing after it
        solved = self.interface == CO_SIMULATION and is_solved(description)
        kind = MODEL_EXCHANGE if solved else self.interface
        slave = self.guard(LOADING, lambda: load(folder, description, kind, name))
        super().__init__(name, as_slave(slave, description) if solved else slave, description)
        self.logging = logging

    @property
    def missing_functions(self) -> list[str]:
        """Functions of the standard that the library does not export."""
        return list(self.slave.dll.missing)

    def names(self, causality: str) -> list[str]:
        """Names of the numeric scalars and elements of one causality, each once; no clocks, nothing clocked, no
        aliases.

        Args:
            causality: in the words of FMI.
        """
        own = [v for v in self.description.modelVariables if v.alias is None and v.causality == causality]
        return [e.name for v in own if v.type in NUMERIC_TYPES and not v.clocks for e in elements_of(v)]

    def free_instance_only(self) -> None:
        """Free the instance; the library stays loaded."""
        self._alive = self._running = False
        call = getattr(self.slave, f"fmi{self.fmi_version}FreeInstance")
        self._quietly("freeInstance", lambda: call(self.slave.component))
        self.slave.component = None

    def _quietly(self, what: str, call: Callable[[], Any]) -> None:
        if self.ends:
            self.announce(what)
            super()._quietly(what, call)
            self.announce("")

    def failure(self, reason: str, t: float | None = None) -> SlaveError:
        place = "" if t is None else f" at t = {t:g} s"
        return SlaveError(
            reason.rstrip(".") + place + (f"; the FMU says: {self.messages[-1]}" if self.messages else "")
        )

    def note(self, message: str | bytes | None, status: int | str = 0, category: str | bytes | None = None) -> None:
        text = one_line(message.decode("utf-8", "replace") if isinstance(message, bytes) else message or "")
        if text:
            self.messages.append(text)


class FmuSlave2(FmuInstance, FMI2Slave):
    """A co-simulation instance of FMI 2.0; arguments as for `FmuInstance`."""


class FmuSlave3(FmuInstance, FMI3Slave):
    """A co-simulation instance of FMI 3.0; arguments as for `FmuInstance`."""


FmuSlave = FmuSlave2 | FmuSlave3


def make_slave(
    folder: Path, description: ModelDescription, name: str = "checked", *, logging: bool = False
) -> FmuSlave:
    """See `FmuInstance`: one that is stepped, of the version of its description, not yet instantiated. A solver moves
    that of a description from `as_stepped`.

    Raises:
        SlaveError: the library cannot be loaded.
    """
    version = FmuSlave2 if fmi_version(description) == 2 else FmuSlave3
    return version(folder, description, name, logging=logging)
