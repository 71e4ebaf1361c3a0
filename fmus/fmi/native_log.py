"""The logger that native FMUs of FMI 1.0 and 2.0 are given: their messages arrive with the arguments filled in.

That logger takes arguments as C's printf does, which Python cannot receive; fmpy brings a small library that fills them
in and then calls one function of the whole process. So one function takes the messages of all FMUs here and finds out
whose they are by the instance name that each message brings. The environment of an instance of FMI 2.0 is NULL; only
where another one of the same name lives it is a pointer, to memory of zeros, by which the two are distinguished. Where
a platform has no such library, messages arrive as written.
"""

from __future__ import annotations

import ctypes
from contextlib import suppress
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


_listeners: list[_Listener] = []
_environments: dict[int, tuple[_Listener, Any]] = {}
_ENVIRONMENT_BYTES = 4096
"""More than an FMU reads of what it takes for its environment."""


def fmi1_callbacks(listener: _Listener) -> Any:
    """Callbacks for an instance of FMI 1.0; `forget` the listener once it is freed."""
    forget(listener)
    _listeners.append(listener)
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
    _listeners[:] = [known for known in _listeners if known is not listener]
    for address in [address for address, (known, _) in _environments.items() if known is listener]:
        del _environments[address]


def _listen(listener: _Listener) -> int | None:
    """The environment to hand over."""
    forget(listener)
    if any(known.name == listener.name for known in _listeners):
        memory = ctypes.create_string_buffer(_ENVIRONMENT_BYTES)
        _environments[ctypes.addressof(memory)] = listener, memory
        return ctypes.addressof(memory)
    _listeners.append(listener)
    return None


def _take_message(
    environment: int | None, name: bytes | None, status: int, category: bytes | None, message: bytes | None
) -> None:
    listener, _ = _environments.get(environment or 0) or (_named(name), None)
    if listener is not None:
        listener.note(message, status, category)
    else:
        with suppress(Exception):  # an FMU that somebody else runs with fmpy, in this process
            printLogMessage(environment, name or b"", status, category or b"", message or b"")


def _named(name: bytes | None) -> _Listener | None:
    """The instance of this name. One that names itself otherwise is the only one there is, if it is that."""
    wanted = (name or b"").decode("utf-8", "replace")
    alone = _listeners[0] if len(_listeners) == 1 else None
    return next((known for known in reversed(_listeners) if known.name == wanted), alone)


def _share() -> Any:
    shared = fmi2CallbackFunctions()
    shared.logger = _message_from_c
    with suppress(ImportError, OSError, AttributeError):
        from fmpy.logging import addLoggerProxy  # noqa: PLC0415 - there is none for every platform

        addLoggerProxy(ctypes.byref(shared))
    return shared


_message_from_c = fmi2CallbackLoggerTYPE(_take_message)  # kept for as long as the process lives
_shared = _share()
