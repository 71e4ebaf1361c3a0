"""The call log: every call of every component, written before it begins. Touches the file it is given.

A line is written in two pieces, what is called and what came of it, each straight to the operating system: where a call
takes the process with it, the log ends with that call. Calls of several threads are written, and so made, one after the
other.
"""

from __future__ import annotations

import ctypes
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import isnan
from pathlib import Path
from threading import RLock
from time import perf_counter
from typing import Any

from fmpy.model_description import ModelDescription

from cosim.diagnostics.messages import STATUSES
from cosim.errors import OutputError

HEADER = "# time [s], component, call -> status, duration [us], what it returned\n"


_SHOWN = 6
_LONGEST = 60  # letters of a text


@dataclass(frozen=True)
class _DescribedCall:
    """A call in words.

    Args:
        text: function and arguments. outcome: from what it returned to status and further words.
    """

    text: str
    outcome: Callable[[Any], tuple[str, str]]


class Names:
    """Names of variables by type and value reference.

    Args:
        description: model description of the FMU.
    """

    def __init__(self, description: ModelDescription) -> None:
        self._names: dict[tuple[str, int], str] = {}
        for variable in description.modelVariables:
            for kind in {variable.type, "Integer" if variable.type == "Enumeration" else variable.type, ""}:
                self._names.setdefault((str(kind), variable.valueReference), variable.name)

    def of(self, kind: str, references: Sequence[int]) -> list[str]:
        """Names of variables of a type; the number where there is no such variable.

        Args:
            kind: type of the variables in FMI's words. references: value references.
        """
        return [self._names.get((kind, r)) or self._names.get(("", r)) or f"#{r}" for r in references]


def describe_native(
    names: Names, function: str, argument_names: Sequence[str], arguments: Sequence[Any]
) -> _DescribedCall:
    """A call of a native function: values that it gives are read from its arguments afterwards.

    Args:
        names: of the variables of the FMU. argument_names: in FMI's words.
    """
    verb, kind = function[4:7], function[7:]
    transfers = verb in ("Get", "Set") and len(arguments) >= 4 and _is_references(arguments[1])
    if transfers:
        count = int(arguments[2])
        called = names.of(kind, [int(arguments[1][i]) for i in range(count)])
        if verb == "Set":
            return _DescribedCall(
                f"{function}({_pairs(called, _values(arguments[-1 - _counted(function)], count))})", _native_status
            )
        return _DescribedCall(
            f"{function}({_list(called)})", lambda status: (_word(status), _got(arguments, function, count))
        )
    shown = [f"{n}={_short(a)}" for n, a in zip(argument_names, arguments, strict=False) if not _is_hidden(n, a)]
    results = [(n, a) for n, a in zip(argument_names, arguments, strict=False) if _is_result(a)]
    return _DescribedCall(
        f"{function}({', '.join(shown)})",
        lambda status: (_word(status), ", ".join(f"{n}={_short(a._obj)}" for n, a in results)),
    )


def describe_python(names: Names, function: str, arguments: Sequence[Any], named: Mapping[str, Any]) -> _DescribedCall:
    """A call of a slave in Python: values that it gives are what it returns.

    Args:
        names: of the variables of the FMU. function: name of the call. arguments: by position. named: by name.
    """
    verb, kind = function[:3], function[3:]
    if verb in ("get", "set") and arguments and _is_whole(arguments[0]) and kind not in ("RealStatus", "BooleanStatus"):
        called = names.of(kind, list(arguments[0]))
        if verb == "set" and len(arguments) > 1:
            return _DescribedCall(f"{function}({_pairs(called, list(arguments[1]))})", lambda _result: ("ok", ""))
        return _DescribedCall(f"{function}({_list(called)})", lambda result: ("ok", _short(result)))
    shown = [_short(a) for a in arguments] + [f"{n}={_short(a)}" for n, a in named.items() if not callable(a)]
    return _DescribedCall(
        f"{function}({', '.join(shown)})", lambda result: ("ok", "" if result is None else _short(result))
    )


def describe_prepared(names: Names, verb: str, kind: str, references: Sequence[int], values: Any) -> _DescribedCall:
    """A prepared call of a block, which reads into or writes from an array.

    Args:
        names: of the variables of the FMU. verb: ``set`` or ``get``. kind: type of the variables in FMI's words.
        references: value references. values: what was set or got.
    """
    called = names.of(kind, references)
    if verb == "set":
        return _DescribedCall(f"set{kind}({_pairs(called, values.tolist())})", lambda _result: ("ok", ""))
    return _DescribedCall(
        f"get{kind}({_list(called)})", lambda _result: ("ok", _list([_short(v) for v in values.tolist()]))
    )


# -- pieces -----------------------------------------------------------------------------------------------------------


def _native_status(status: Any) -> tuple[str, str]:
    return _word(status), ""


def _word(status: Any) -> str:
    return STATUSES[status] if isinstance(status, int) and 0 <= status < len(STATUSES) else "done"


def _counted(function: str) -> int:
    """FMI 3 gives the number of values after them."""
    return 1 if function.startswith("fmi3") and not function.endswith("Clock") else 0


def _got(arguments: Sequence[Any], function: str, count: int) -> str:
    return _list([_short(v) for v in _values(arguments[-1 - _counted(function)], count)])


def _values(pointer: Any, count: int) -> list[Any]:
    count = len(pointer) if hasattr(pointer, "__len__") else count
    try:
        return [pointer[i] for i in range(min(count, _SHOWN + 1))]
    except (TypeError, ValueError):  # a NULL pointer
        return []


def _is_references(argument: Any) -> bool:
    return isinstance(argument, ctypes.Array) and argument._type_ is ctypes.c_uint


def _is_whole(argument: Any) -> bool:
    return hasattr(argument, "__iter__") and all(isinstance(a, int) for a in argument)


def _is_result(argument: Any) -> bool:
    return (
        hasattr(argument, "_obj") and hasattr(argument._obj, "value") and not isinstance(argument._obj, ctypes.c_void_p)
    )


def _is_hidden(name: str, argument: Any) -> bool:
    """Addresses say nothing to people, and results are not known yet."""
    address = (
        isinstance(argument, (ctypes.c_void_p, ctypes.Structure)) or hasattr(argument, "_obj") or callable(argument)
    )
    return (
        address
        or name in ("c", "instance", "component", "functions", "callbacks", "instanceEnvironment")
        or argument is None
    )


def _pairs(names: Sequence[str], values: Sequence[Any]) -> str:
    if len(names) == len(values) or len(values) > _SHOWN:
        return _list([f"{n}={_short(v)}" for n, v in zip(names, values, strict=False)], len(names))
    return f"{_list(names)}={_list([_short(v) for v in values])}"  # arrays have more values than names


def _list(texts: Sequence[str], count: int | None = None) -> str:
    total = len(texts) if count is None else count
    shown = ", ".join(texts[:_SHOWN])
    return f"{shown}, ... {total} in all" if total > _SHOWN else shown


def _short(value: Any) -> str:
    if isinstance(value, ctypes._SimpleCData):
        value = value.value
    if value in (b"\0", b"\1"):  # a Boolean of FMI 1.0
        value = value == b"\1"
    if isinstance(value, bytes):
        value = value.decode("utf-8", "replace")
    if isinstance(value, float):
        return f"{value:.12g}"
    if isinstance(value, (list, tuple, ctypes.Array)):
        return f"[{_list([_short(v) for v in list(value)[: _SHOWN + 1]], len(value))}]"
    text = repr(value) if isinstance(value, (str, bool, int)) or value is None else f"<{type(value).__name__}>"
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."


class CallLog:
    """A file of calls.

    Args:
        path: the file; replaced where it exists.

    `count` calls were begun. `broken` says why nothing is written any more, or is None.

    Raises:
        OutputError: the file cannot be written.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self.count = 0
        self.broken: str | None = None
        self._lock = RLock()
        self._open_line = 0  # number of the call whose line is not ended yet
        try:
            self._file = os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
            os.write(self._file, HEADER.encode())
        except OSError as error:
            hint = "Choose another file."
            raise OutputError(f"The call log cannot be written to {path}: {error.strerror or error}. {hint}") from error

    def call(self, time: float, component: str, described: _DescribedCall, function: Callable[[], Any]) -> Any:
        """Make a call and log it.

        Args:
            time: where the component stands [s], NaN before it is initialised. component: its name.
            described: the call in words. function: makes it.
        """
        with self._lock:
            number = self._begin(f"{_instant(time)} {component} {described.text}")
            begin = perf_counter()
            try:
                result = function()
            except BaseException as error:
                status = _status(getattr(error, "status", None), type(error).__name__)
                self._end(number, described.text, status, perf_counter() - begin, "")
                raise
            seconds = perf_counter() - begin
            status, returned = described.outcome(result)
            self._end(number, described.text, status, seconds, returned)
            return result

    def close(self) -> None:
        """End the file."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1

    def _begin(self, text: str) -> int:
        self.count += 1
        self._write(("\n" if self._open_line else "") + text)  # a call within a call: the FMU called back
        self._open_line = self.count
        return self.count

    def _end(self, number: int, text: str, status: str, seconds: float, returned: str) -> None:
        again = "" if self._open_line == number else f"... {text}"
        self._write(f"{again} -> {status}, {1e6 * seconds:.1f} us" + (f", {returned}" if returned else "") + "\n")
        self._open_line = 0

    def _write(self, text: str) -> None:
        if self.broken is None and self._file >= 0:
            try:
                os.write(self._file, text.encode("utf-8", "backslashreplace"))
            except OSError as error:  # a full disk ends the log, not the run
                self.broken = f"The call log {self.path} ends after {self.count} calls: {error.strerror or error}."


def _instant(time: float) -> str:
    return "-" if isnan(time) else f"{time:.9g}"


def _status(status: Any, otherwise: str) -> str:
    return STATUSES[status] if isinstance(status, int) and 0 <= status < len(STATUSES) else otherwise
