"""The logger that native FMUs of FMI 1.0 and 2.0 are given: their messages arrive with the arguments filled in.

That logger takes arguments as C's printf does, which Python cannot receive; fmpy brings a small library that fills them
in and then calls one function of the whole process. So one function takes the messages of all FMUs here and finds out
whose they are: in FMI 2.0 by the environment handed to the FMU, in FMI 1.0 by its instance name. Where a platform has
no such library, messages arrive as written.
"""

from __future__ import annotations

import ctypes
from contextlib import suppress
from itertools import count
from typing import Any, Protocol

from fmpy import fmi1
from fmpy.fmi1 import fmi1CallbackFunctions, printLogMessage
from fmpy.fmi2 import defaultCallbacks, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE


class _Listener(Protocol):
    """Somebody who takes the messages of one instance."""

    name: str

    def note(self, message: bytes | None, status: int = 0, category: bytes | None = None) -> None:
        """Take a message.

        Args:
            status: of FMI, by number.
            category: as the slave names it.
        """


_numbers = count(1)
_listeners: dict[int, _Listener] = {}


def fmi1_callbacks(listener: _Listener) -> Any:
    """Callbacks for an instance of FMI 1.0; `forget` the listener once it is freed."""
    _listen(listener)
    made = fmi1CallbackFunctions()
    # the logger is the first field
    ctypes.memmove(ctypes.byref(made), ctypes.byref(_shared), ctypes.sizeof(ctypes.c_void_p))
    made.allocateMemory, made.freeMemory = fmi1.defaultCallbacks.allocateMemory, fmi1.defaultCallbacks.freeMemory
    made.stepFinished = None  # so that the slave must not return before a step is done
    return made


def fmi2_callbacks(listener: _Listener) -> Any:
    """Callbacks for an instance of FMI 2.0; `forget` the listener once it is freed."""
    made = fmi2CallbackFunctions()
    made.logger = _shared.logger
    made.allocateMemory, made.freeMemory = defaultCallbacks.allocateMemory, defaultCallbacks.freeMemory
    made.componentEnvironment = _listen(listener)
    return made


def forget(listener: _Listener) -> None:
    """Messages of this one are of no interest any more.

    Args:
        listener: who took them until now.
    """
    for number in [n for n, known in _listeners.items() if known is listener]:
        del _listeners[number]


def _listen(listener: _Listener) -> int:
    forget(listener)
    number = next(_numbers)
    _listeners[number] = listener
    return number


def _take_message(
    environment: int | None, name: bytes | None, status: int, category: bytes | None, message: bytes | None
) -> None:
    listener = _listeners.get(environment or 0) or _named(name)
    if listener is not None:
        listener.note(message, status, category)
    else:
        with suppress(Exception):  # an FMU that somebody else runs with fmpy, in this process
            printLogMessage(environment, name or b"", status, category or b"", message or b"")


def _named(name: bytes | None) -> _Listener | None:
    """The newest instance of this name: while an FMU is probed there are two."""
    wanted = (name or b"").decode("utf-8", "replace")
    return next((known for known in reversed(_listeners.values()) if known.name == wanted), None)


def _share() -> Any:
    shared = fmi2CallbackFunctions()
    shared.logger = _message_from_c
    with suppress(ImportError, OSError, AttributeError):
        from fmpy.logging import addLoggerProxy  # noqa: PLC0415 - there is none for every platform

        addLoggerProxy(ctypes.byref(shared))
    return shared


_message_from_c = fmi2CallbackLoggerTYPE(_take_message)  # kept for as long as the process lives
_shared = _share()
