"""Calls in words: function, variables by name, values; long lists cut. Knows fmpy's slaves and our blocks, calls
neither.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from fmpy.model_description import ModelDescription

from cosim.diagnostics.messages import STATUSES

SHOWN = 6
LONGEST = 60  # letters of a text


@dataclass(frozen=True)
class DescribedCall:
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
) -> DescribedCall:
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
            return DescribedCall(
                f"{function}({_pairs(called, _values(arguments[-1 - _counted(function)], count))})", _native_status
            )
        return DescribedCall(
            f"{function}({_list(called)})", lambda status: (_word(status), _got(arguments, function, count))
        )
    shown = [f"{n}={_short(a)}" for n, a in zip(argument_names, arguments, strict=False) if not _is_hidden(n, a)]
    results = [(n, a) for n, a in zip(argument_names, arguments, strict=False) if _is_result(a)]
    return DescribedCall(
        f"{function}({', '.join(shown)})",
        lambda status: (_word(status), ", ".join(f"{n}={_short(a._obj)}" for n, a in results)),
    )


def describe_python(names: Names, function: str, arguments: Sequence[Any], named: Mapping[str, Any]) -> DescribedCall:
    """A call of a slave in Python: values that it gives are what it returns.

    Args:
        names: of the variables of the FMU. function: name of the call. arguments: by position. named: by name.
    """
    verb, kind = function[:3], function[3:]
    if verb in ("get", "set") and arguments and _is_whole(arguments[0]) and kind not in ("RealStatus", "BooleanStatus"):
        called = names.of(kind, list(arguments[0]))
        if verb == "set" and len(arguments) > 1:
            return DescribedCall(f"{function}({_pairs(called, list(arguments[1]))})", lambda _result: ("ok", ""))
        return DescribedCall(f"{function}({_list(called)})", lambda result: ("ok", _short(result)))
    shown = [_short(a) for a in arguments] + [f"{n}={_short(a)}" for n, a in named.items() if not callable(a)]
    return DescribedCall(
        f"{function}({', '.join(shown)})", lambda result: ("ok", "" if result is None else _short(result))
    )


def describe_prepared(names: Names, verb: str, kind: str, references: Sequence[int], values: Any) -> DescribedCall:
    """A prepared call of a block, which reads into or writes from an array.

    Args:
        names: of the variables of the FMU. verb: ``set`` or ``get``. kind: type of the variables in FMI's words.
        references: value references. values: what was set or got.
    """
    called = names.of(kind, references)
    if verb == "set":
        return DescribedCall(f"set{kind}({_pairs(called, values.tolist())})", lambda _result: ("ok", ""))
    return DescribedCall(
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
        return [pointer[i] for i in range(min(count, SHOWN + 1))]
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
    if len(names) == len(values) or len(values) > SHOWN:
        return _list([f"{n}={_short(v)}" for n, v in zip(names, values, strict=False)], len(names))
    return f"{_list(names)}={_list([_short(v) for v in values])}"  # arrays have more values than names


def _list(texts: Sequence[str], count: int | None = None) -> str:
    total = len(texts) if count is None else count
    shown = ", ".join(texts[:SHOWN])
    return f"{shown}, ... {total} in all" if total > SHOWN else shown


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
        return f"[{_list([_short(v) for v in list(value)[: SHOWN + 1]], len(value))}]"
    text = repr(value) if isinstance(value, (str, bool, int)) or value is None else f"<{type(value).__name__}>"
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}..."
