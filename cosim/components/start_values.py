"""Start values: from what a user writes for the variables of a component to the values that FMI takes.

The one place where that is typed and checked, for every FMI version. No slaves here.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import inf, isfinite
from typing import Any

import numpy as np
from fmpy.model_description import ModelVariable

from cosim.components.described import DescribedComponent
from cosim.components.meant_in_unit import meant_in_unit
from cosim.errors import CouplingError, nearest
from fmus.fmi.elements import described
from fmus.fmi.types import CTYPES, FLOATING_TYPES, NUMERIC_TYPES, enumeration_items, size
from fmus.fmi.units import Units

Scalar = float | int | bool | str | bytes
StartValue = Scalar | list[Scalar]
"""In the type of its variable: one value, or all of an array row by row."""
_WHOLE_TYPES = NUMERIC_TYPES - FLOATING_TYPES - {"Boolean"}
_EXPECTED = {"Boolean": "true or false for a Boolean", "String": "a text for a String"}


STRUCTURAL = "structuralParameter"


def start_values(component: DescribedComponent, parameters: Mapping[str, Any]) -> dict[str, StartValue]:
    """Start values by name, structural parameters first, each of its variable's type. The arrays of the component get
    the shapes that its structural parameters give them.

    A list for a vector of scalars sets ``name[1]``, ``name[2]``, ..., a number for one sets all its elements; an array
    of FMI 3 takes a list, nested or row by row, or one value for all. A text is a text, the name of an item of an
    enumeration, or the bytes of a binary in hexadecimal.

    Args:
        component: of any FMI version. parameters: what the user wrote, by name of a variable or an element.

    Raises:
        CouplingError: a name is unknown (the nearest are suggested), a list is shorter than its vector, or a value is
            not of the variable's type or lies outside what the component declares.
    """
    structural = {n: value for n, value in parameters.items() if _is_structural(component, n)}
    starts = {name: _start_value(component, name, value) for name, value in structural.items()}
    component.configure(starts)
    for name, value in parameters.items():
        if name not in structural:
            starts |= {n: _start_value(component, n, element) for n, element in _spread(component, name, value)}
    return starts


def declared_start(variable: ModelVariable) -> Scalar | None:
    """The start value that a model description declares for a scalar, as a user would write it; None where there is
    none, or none that can be read.

    Args:
        variable: in the model description.
    """
    if variable.shape or variable.start is None or variable.type in ("Clock", "Binary"):
        return None
    text = str(variable.start)
    if variable.type == "String":
        return text
    if variable.type == "Boolean":
        return text.strip().lower() in ("true", "1")
    try:
        number = float(text) if variable.type in FLOATING_TYPES else int(text)  # a whole number keeps all its digits
    except ValueError:
        return None
    return number if isfinite(number) else None


def _is_structural(component: DescribedComponent, name: str) -> bool:
    return name in component.variables and component.variables[name].causality == STRUCTURAL


def _spread(component: DescribedComponent, name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Vectors of FMI 2 and of blocks are scalars named ``name[1]``, ``name[2]``, ..."""
    vector = [n for n in component.variables if n.startswith(f"{name}[")] if name not in component.variables else []
    if f"{name}[1]" not in vector:
        yield name, value
    elif isinstance(value, list):
        if len(value) < len(vector):  # a longer one ends with a name that is unknown
            raise CouplingError(
                f"{component.name}.{name}: expected {len(vector)} values, one for each element, or one number for all "
                f"(got {len(value)})."
            )
        yield from ((f"{name}[{i}]", entry) for i, entry in enumerate(value, 1))
    else:
        yield from ((n, value) for n in vector)


def _start_value(component: DescribedComponent, name: str, value: Any) -> StartValue:
    """The value of a variable, or of the element of this name."""
    variable = component.settable(name)
    is_array = bool(variable.shape) and name in component.variables
    try:
        values = [typed_value(variable, entry) for entry in (_entries(variable, value) if is_array else [value])]
    except ValueError as error:
        end = "" if str(error).endswith("?") else "."
        raise CouplingError(f"{component.name}.{name}: {error}{end}") from error
    return values if is_array else values[0]


def typed_value(variable: ModelVariable, value: Any) -> Scalar:
    """One value of a variable, or of an element of it, in its type.

    Args:
        variable: of a description. value: as a user wrote it.

    Raises:
        ValueError: it is not of the variable's type, or lies outside what the component declares.
    """
    typed = _typed(variable, value)
    if variable.type in NUMERIC_TYPES:
        _demand_range(variable, typed)
    return typed


def _entries(variable: ModelVariable, value: Any) -> list[Any]:
    """The values of an array, row by row, of a nested or flat list or of one value for all."""
    if not _is_list(value):
        return [value] * size(variable)
    shape, flat = _shape(value), _leaves(value)
    if len(flat) != size(variable) or (len(shape) > 1 and shape != tuple(variable.shape or ())):
        raise ValueError(
            f"expected {size(variable)} values for a {described(variable)} (got {len(flat)} in shape {shape})"
        )
    return flat


def _is_list(value: Any) -> bool:
    return isinstance(value, (Sequence, np.ndarray)) and not isinstance(value, (str, bytes))


def _leaves(value: Any) -> list[Any]:
    return [leaf for entry in value for leaf in _leaves(entry)] if _is_list(value) else [value]


def _shape(value: Any) -> tuple[int, ...]:
    if not _is_list(value):
        return ()
    inner = {_shape(entry) for entry in value}
    if len(inner) > 1:
        raise ValueError(f"expected rows of equal length (got {value!r})")
    return (len(value), *next(iter(inner), ()))


def _typed(variable: ModelVariable, value: Any) -> Scalar:
    value = value.item() if isinstance(value, np.generic) else value
    kind, is_number = str(variable.type), isinstance(value, (bool, int, float))
    if kind in FLOATING_TYPES and is_number:
        return _floating(kind, float(value))
    if kind == "Boolean" and is_number and value in (0, 1):
        return bool(value)
    if kind == "String" and isinstance(value, str):
        return value
    if kind == "Binary":
        return _bytes(value)
    if kind == "Enumeration" and isinstance(value, str):
        return _item(value, enumeration_items(variable))
    if kind in _WHOLE_TYPES:
        return _whole(kind, value)
    meant = (
        meant_in_unit(value, Units.name(variable) or "") if kind in FLOATING_TYPES and isinstance(value, str) else ""
    )
    number = f"a number{meant}" if meant else "a number, or a list of numbers for a vector"
    raise ValueError(f"expected {_EXPECTED.get(kind, number)} (got {value!r})")


def _floating(kind: str, value: float) -> float:
    largest = float(np.finfo(CTYPES[kind][2]).max)
    if largest < abs(value) < inf:
        raise ValueError(f"expected {-largest:g} to {largest:g} for a {kind} (got {value:g})")
    return value


def _whole(kind: str, value: Any) -> int:
    if not (isinstance(value, (bool, int)) or (isinstance(value, float) and value.is_integer())):
        meant = meant_in_unit(value, whole=True) if isinstance(value, str) else ""
        raise ValueError(f"expected a whole number for a {kind}{meant} (got {value!r})")
    _, _, dtype = CTYPES.get(kind, CTYPES["Int64"])
    low, high = np.iinfo(dtype).min, np.iinfo(dtype).max
    if not low <= value <= high:
        raise ValueError(f"expected {low} to {high} for a {kind} (got {int(value)})")
    return int(value)


def _bytes(value: Any) -> bytes:
    if isinstance(value, (bytes, bytearray)):
        return bytes(value)
    try:
        return bytes.fromhex(value)
    except (ValueError, TypeError) as error:
        raise ValueError(f"expected bytes or a hexadecimal text such as '00ff' for a Binary (got {value!r})") from error


def _item(value: str, items: Mapping[str, int]) -> int:
    if value not in items:
        raise ValueError(f"no item {value!r}; {nearest(value, items).rstrip('.')}")
    return items[value]


def _demand_range(variable: ModelVariable, value: Any) -> None:
    items = enumeration_items(variable)
    if variable.type == "Enumeration" and items and value not in items.values():
        names = ", ".join(f"{item} ({number})" for item, number in items.items())
        raise ValueError(f"{value:g} is no item of the enumeration: {names}")
    low, high = (_limit(variable, side) for side in ("min", "max"))
    low = 0 if low is None and variable.causality == STRUCTURAL else low
    if (low is not None and value < float(low)) or (high is not None and value > float(high)):
        allowed = f"{'-inf' if low is None else low} to {'inf' if high is None else high} {variable.unit or ''}"
        raise ValueError(f"{value:g} lies outside what the component declares: {allowed.rstrip()}")


def _limit(variable: ModelVariable, side: str) -> Any:
    own = getattr(variable, side)
    return own if own is not None else getattr(variable.declaredType, side, None)
