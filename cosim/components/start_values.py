"""Start values: what a user writes for a variable of any type, checked and turned into the values FMI takes. No slaves
here.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from fmpy.model_description import ModelVariable

from cosim.errors import nearest
from fmus.fmi.elements import described
from fmus.fmi.types import CTYPES, FLOATING_TYPES, enumeration_items, size

StartValue = float | int | bool | str | bytes | Sequence[Any]


def refusal(what: str, error: ValueError) -> str:
    """The sentence that a value does not fit, from what was to be set and why not.

    Args:
        error: why not.
    """
    return f"{what}: {error}" + ("" if str(error).endswith("?") else ".")


def typed_values(variable: ModelVariable, value: Any) -> list[Any]:
    """All values of a variable, row by row: one for a scalar.

    Args:
        variable: what is set.
        value: a number, truth value, text or bytes (or bytes as a hexadecimal text); an item's name for an enumeration;
            for an array a nested or flat list, or one value for all elements.

    Raises:
        ValueError: the value does not fit the variable; the message says what was expected.
    """
    if not variable.shape:
        return [typed_value(variable, value)]
    values = _flat(variable, value)
    return [typed_value(variable, v) for v in values]


def typed_value(variable: ModelVariable, value: Any) -> Any:
    """One value of a variable, or of an element of it.

    Raises:
        ValueError: as for `typed_values`.
    """
    if isinstance(value, np.generic):
        value = value.item()
    kind = str(variable.type)
    if kind in FLOATING_TYPES:
        return _floating(value)
    convert: Callable[[str, Any], Any] = {"Boolean": _boolean, "String": _text, "Binary": _bytes}.get(kind, _whole)
    return _item(variable, value) if kind == "Enumeration" else convert(kind, value)


def _flat(variable: ModelVariable, value: Any) -> list[Any]:
    if isinstance(value, (str, bytes)) or not isinstance(value, (Sequence, np.ndarray)):
        return [value] * size(variable)
    shape, flat = _shape(value), _leaves(value)
    if len(flat) != size(variable) or (len(shape) > 1 and shape != tuple(variable.shape or ())):
        raise ValueError(
            f"expected {size(variable)} values for a {described(variable)} (got {len(flat)} in shape {shape})"
        )
    return flat


def _leaves(value: Any) -> list[Any]:
    if isinstance(value, (str, bytes)) or not isinstance(value, (Sequence, np.ndarray)):
        return [value]
    return [leaf for entry in value for leaf in _leaves(entry)]


def _shape(value: Any) -> tuple[int, ...]:
    if isinstance(value, (str, bytes)) or not isinstance(value, (Sequence, np.ndarray)):
        return ()
    inner = {_shape(entry) for entry in value}
    if len(inner) > 1:
        raise ValueError(f"expected rows of equal length (got {value!r})")
    return (len(value), *next(iter(inner), ()))


def _floating(value: Any) -> float:
    if isinstance(value, (bool, int, float)):
        return float(value)
    raise ValueError(f"expected a number, or a list of numbers for a vector (got {value!r})")


def _whole(kind: str, value: Any) -> int:
    if isinstance(value, (bool, int)) or (isinstance(value, float) and value.is_integer()):
        _, _, dtype = CTYPES.get(kind, CTYPES["Int64"])
        low, high = np.iinfo(dtype).min, np.iinfo(dtype).max
        if not low <= value <= high:
            raise ValueError(f"expected {low} to {high} for a {kind} (got {int(value)})")
        return int(value)
    raise ValueError(f"expected a whole number for a {kind} (got {value!r})")


def _boolean(kind: str, value: Any) -> bool:
    if isinstance(value, (bool, int, float)) and value in (0, 1):
        return bool(value)
    raise ValueError(f"expected true or false for a {kind} (got {value!r})")


def _text(kind: str, value: Any) -> str:
    if isinstance(value, str):
        return value
    raise ValueError(f"expected a text for a {kind} (got {value!r})")


def _bytes(kind: str, value: Any) -> bytes:
    if isinstance(value, (bytes, bytearray)):
        return bytes(value)
    if isinstance(value, str):
        try:
            return bytes.fromhex(value)
        except ValueError:
            pass
    raise ValueError(f"expected bytes or a hexadecimal text such as '00ff' for a {kind} (got {value!r})")


def _item(variable: ModelVariable, value: Any) -> int:
    items = enumeration_items(variable)
    if not isinstance(value, str):
        return _whole("Enumeration", value)
    if value not in items:
        raise ValueError(f"no item {value!r}; {nearest(value, items).rstrip('.')}")
    return items[value]
