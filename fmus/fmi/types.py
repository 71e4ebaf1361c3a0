"""Types of variables: which are numbers, how C holds them, by which functions they are read. Knows variables only."""

from __future__ import annotations

import ctypes
from math import prod
from typing import Any

import numpy as np
from fmpy.model_description import ModelVariable

REAL_TYPE = {1: "Real", 2: "Real", 3: "Float64"}
FLOATING_TYPES = frozenset({"Real", "Float64", "Float32"})

NUMERIC_TYPES = frozenset(
    {"Real", "Integer", "Boolean", "Enumeration", "Float64", "Float32"}
    | {f"{sign}Int{bits}" for sign in ("", "U") for bits in (8, 16, 32, 64)}
)
"""Types whose values a table of numbers can hold. Integers beyond 2**53 are rounded in it; see `exact_ports`."""

CTYPES: dict[str, tuple[Any, str, Any]] = {
    "Real": (ctypes.c_double, "d", np.float64),
    "Float64": (ctypes.c_double, "d", np.float64),
    "Float32": (ctypes.c_float, "f", np.float32),
    "Integer": (ctypes.c_int, "i", np.int32),
    "Int8": (ctypes.c_int8, "b", np.int8),
    "UInt8": (ctypes.c_uint8, "B", np.uint8),
    "Int16": (ctypes.c_int16, "h", np.int16),
    "UInt16": (ctypes.c_uint16, "H", np.uint16),
    "Int32": (ctypes.c_int32, "i", np.int32),
    "UInt32": (ctypes.c_uint32, "I", np.uint32),
    "Int64": (ctypes.c_int64, "q", np.int64),
    "UInt64": (ctypes.c_uint64, "Q", np.uint64),
}
"""FMI type -> C type, its letter in `struct`, and its dtype."""

BOOLEANS: dict[int, tuple[Any, str, Any]] = {
    1: (ctypes.c_char, "B", np.uint8),
    2: (ctypes.c_int, "i", np.int32),
    3: (ctypes.c_bool, "B", np.uint8),
}
"""The same for Boolean, by FMI version. Numbers, not truth values: a slave may say 2 for true."""


def size(variable: ModelVariable) -> int:
    """Number of values of a variable: 1, or the product of its dimensions."""
    return prod(variable.shape) if variable.shape else 1


def is_continuous(variable: ModelVariable) -> bool:
    """Whether a variable changes all the time.

    Args:
        variable: of a description.
    """
    return variable.type in FLOATING_TYPES and variable.variability in (None, "continuous")


def why_not_set(variable: ModelVariable) -> str:
    """What forbids to set a value of a variable before initialisation; empty where nothing does.

    A state may be an output: where its start is exact or approximate it is set as a local one is (FMI 2.0.5, 2.2.7;
    FMI 3.0.2, 2.4.7.5). FMI 1.0 knows no such word; there a declared start says it.

    Args:
        variable: of a description.
    """
    if variable.variability == "constant":
        return "is constant"
    if variable.type == "Clock":
        return "is a Clock, which ticks by itself or at events"
    if variable.causality == "independent":
        return "has causality 'independent'"
    starts = variable.initial in ("exact", "approx") or (variable.initial is None and variable.start is not None)
    if variable.causality in ("output", "calculatedParameter") and not starts:
        return f"has causality '{variable.causality}'" + (
            f" and is {variable.initial}" if variable.initial else " and no start value"
        )
    return ""


def getter_type(kind: str, fmi_version: int) -> str:
    """The type in the name of the functions that read and write a variable type.

    Args:
        kind: type of the variable.
        fmi_version: 2 or 3.
    """
    if kind == "Enumeration":
        return "Int64" if fmi_version == 3 else "Integer"
    return kind


def c_type(kind: str, fmi_version: int) -> tuple[Any, str, Any]:
    """C type, letter in `struct` and dtype of a getter's numeric type.

    Args:
        kind: type in the name of the getter.
        fmi_version: 2 or 3.
    """
    return BOOLEANS[fmi_version] if kind == "Boolean" else CTYPES[kind]


def enumeration_items(variable: ModelVariable) -> dict[str, int]:
    """Items of an enumeration by name; empty for a variable of another type.

    Args:
        variable: in the model description.
    """
    return {item.name: int(item.value) for item in getattr(variable.declaredType, "items", None) or ()}
