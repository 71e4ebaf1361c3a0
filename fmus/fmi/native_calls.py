"""Calls of a native FMU whose arguments are allocated once: a third of what fmpy's own call costs, with the same
checks.

fmpy's call looks its function up, converts every argument and asks for the type of the result each time. What hangs
itself into it (a logger of calls, a function in place of that of the library) is respected: such calls go through
fmpy.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from fmpy.fmi1 import FMICallException

WARNING = 1  # FMI status: the last one that is no failure
FUNCTION: Any = ctypes.CFUNCTYPE(None).__bases__[0]
BY_REFERENCE = type(ctypes.byref(ctypes.c_int()))


class Native(NamedTuple):
    """What a prepared call calls, for who joins several.

    Attributes:
        slave: fmpy's slave. name: of the function. function: fmpy's, as long as nobody hangs itself in.
        raw: the function of the library. typed: its arguments.
    """

    slave: Any
    name: str
    function: Any
    raw: Callable[..., int]
    typed: tuple[Any, ...]


def prepared_call(slave: Any, name: str, *arguments: Any) -> Callable[[], None]:
    """A call of a function that returns a status, always with the same arguments.

    Args:
        slave: fmpy's slave, instantiated.
        name: the function in fmpy's words, e.g. ``fmi2GetReal``.
        arguments: as for fmpy's method of this name. What is to change between calls is a ctypes object and changes its
            value.

    Returns:
        The call; it raises `FMICallException` where the status is worse than a warning.
    """
    functions, checked = slave._functions, getattr(slave, name)
    function = functions[name]
    if not isinstance(function, FUNCTION):  # the library lacks it: fmpy's own call says so
        return lambda: checked(*map(_plain, arguments))
    typed = tuple(_typed(argument, kind) for argument, kind in zip(arguments, function.argtypes, strict=True))
    raw = ctypes.CFUNCTYPE(ctypes.c_int)(ctypes.cast(function, ctypes.c_void_p).value or 0)

    def call() -> None:
        if functions[name] is not function or slave.fmiCallLogger is not None:
            checked(*map(_plain, arguments))
            return
        status = raw(*typed)
        if status:
            _demand_done(slave, name, status)

    call.native = Native(slave, name, function, raw, typed)  # type: ignore[attr-defined]
    return call


class JoinedCalls:
    """Several calls as one: who hangs himself into a call is searched once, not at every call.

    It raises what the first of them raises that fails.

    Args:
        slave: fmpy's slave, instantiated.
        calls: in their order; those from `prepared_call` of this slave go to the library without anything between.
    """

    def __init__(self, slave: Any, calls: Sequence[Callable[[], None]]) -> None:
        self._slave, self._calls = slave, list(calls)
        self.steps = list[tuple[Callable[..., int], tuple[Any, ...], str]]()
        """Function, arguments and name of each: to be called one after the other where nobody `hangs_in`."""
        found = list[Native]()
        for call in calls:
            native: Native | None = getattr(call, "native", None)
            if native is None or native.slave is not slave:
                self.steps.append((_done(call), (), ""))
            else:
                found.append(native)
                self.steps.append((native.raw, native.typed, native.name))
        self._names, self._expected = [n.name for n in found], [n.function for n in found]

    @property
    def hangs_in(self) -> bool:
        """Whether somebody logs calls, or stands in for the library."""
        responding = [*map(self._slave._functions.__getitem__, self._names)]
        return self._slave.fmiCallLogger is not None or responding != self._expected

    def __call__(self) -> None:
        """Make the calls."""
        if self.hangs_in:
            for call in self._calls:
                call()
            return
        for raw, typed, name in self.steps:
            status = raw(*typed)
            if status:
                _demand_done(self._slave, name, status)


def _demand_done(slave: Any, name: str, status: int) -> None:
    """Raise `FMICallException` for a status that is worse than a warning; a warning the slave is notified of."""
    if status > WARNING:
        raise FMICallException(name, status)
    slave.warned(name)


def _done(call: Callable[[], None]) -> Callable[[], int]:
    def done() -> int:
        call()
        return 0

    return done


def _typed(argument: Any, kind: Any) -> Any:
    """The argument as a ctypes object that goes to C as it is; it keeps alive what it points to."""
    if isinstance(argument, BY_REFERENCE):
        argument = ctypes.pointer(argument._obj)  # type: ignore[attr-defined]
    if isinstance(argument, ctypes.Array | ctypes._Pointer):
        return ctypes.cast(argument, ctypes.c_void_p)
    return argument if isinstance(argument, ctypes._SimpleCData) else kind(argument)


def _plain(argument: Any) -> Any:
    return argument.value if isinstance(argument, ctypes._SimpleCData) else argument
