"""Test FMUs with every variable type there is; outputs are their inputs with a twist.

from test_fmus.typed import expected, typed_fmu
fmu = typed_fmu(tmp_path, version=3)
expected("u_int64", 2**63 - 2)          # what y_int64 must be
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from test_fmus.build import TIME, Define, build_fmu, capability_flags
from test_fmus.description import Variable, Version

FIRST_U, FIRST_Y, ONLY = 2, 32, 30
MOODS = ("calm", "busy", "angry")
"""Items of the enumeration type ``Mood``, values 1 to 3."""
LONGEST = 8
"""Largest value of the structural parameter ``n``."""

SCALARS = (
    "Float64",
    "Float32",
    "Int8",
    "UInt8",
    "Int16",
    "UInt16",
    "Int32",
    "UInt32",
    "Int64",
    "UInt64",
    "Boolean",
    "String",
    "Binary",
    "Enumeration",
)
ARRAYS = {
    "vector": ("Float64", ("1",)),
    "matrix": ("Float64", (2, "1")),
    "pair_int64": ("Int64", (2,)),
    "pair_uint64": ("UInt64", (2,)),
    "pair_boolean": ("Boolean", (2,)),
    "pair_string": ("String", (2,)),
    "pair_binary": ("Binary", (2,)),
    "pair_float32": ("Float32", (2,)),
}
"""By name without ``u_`` or ``y_``: type and shape; "1" is the value reference of ``n``, 3 at the start."""


def typed_fmu(folder: Path, name: str = "typed", *, version: Version = 3) -> Path:
    """Inputs ``u_<type>`` and outputs ``y_<type>`` of every type, in small letters (``u_float64``, ``u_enumeration``,
    ...).

    FMI 3.0: also the arrays ``u_vector`` [n], ``u_matrix`` [2, n], ``u_pair_<type>`` [2] and ``y_...``; structural
    parameter ``n``. FMI 1.0 and 2.0: Float64 as Real, Int32 as Integer, Boolean, String, Enumeration. FMI 1.0:
    ``y_equal`` and ``y_negated`` are an alias and a negated alias of ``y_float64``; the input ``u_negated`` is a
    negated alias of the internal ``w``: setting 2 makes w = -2. All inputs start at zero, empty or false, the
    enumeration at 1.
    """
    variables = [TIME]
    if version == 3:
        variables.append(Variable("n", 1, "structuralParameter", "UInt64", start=3))
    variables += _side(version, "u", FIRST_U) + _side(version, "y", FIRST_Y)
    if version == 1:
        variables += [
            Variable("y_equal", FIRST_Y, "output", depends=("u_float64",), alias="alias"),
            Variable("y_negated", FIRST_Y, "output", depends=("u_float64",), alias="negatedAlias"),
            Variable("w", ONLY, "local"),
            Variable("u_negated", ONLY, "input", start=-0.0, alias="negatedAlias"),
        ]
    defines: dict[str, Define] = {}
    flags = capability_flags(version)
    return build_fmu(folder, name, "typed.c", version, variables, flags, defines, {"Mood": MOODS})


def _side(version: Version, letter: str, first: int) -> list[Variable]:
    old = ("Float64", "Int32", "Boolean", "String", "Enumeration")
    kinds: list[tuple[str, str, tuple[Any, ...]]] = [
        (kind.lower(), kind, ()) for kind in SCALARS if version == 3 or kind in old
    ]
    if version == 3:
        kinds += [(name, kind, shape) for name, (kind, shape) in ARRAYS.items()]
    offsets = {name: i for i, name in enumerate([kind.lower() for kind in SCALARS] + list(ARRAYS))}
    made = []
    for name, kind, shape in kinds:
        count = int(np.prod([3 if d == "1" else d for d in shape])) if shape else 1
        one = {"Boolean": False, "String": "", "Binary": "", "Enumeration": 1, "Float64": 0.0, "Float32": 0.0}.get(
            kind, 0
        )
        made.append(
            Variable(
                f"{letter}_{name}",
                first + offsets[name],
                "input" if letter == "u" else "output",
                kind,
                start=([one] * count if shape else one) if letter == "u" else None,
                depends=(f"u_{name}",),
                shape=shape,
                declared_type="Mood" if kind == "Enumeration" else None,
            )
        )
    return made


def expected(name: str, value: Any) -> Any:
    """What the output must be when this input (``u_...``) has this value.

    Args:
        name: of the input or the output. value: scalars, and nested lists for arrays; bytes for binaries.
    """
    stem = name[2:]
    if stem.startswith("pair_"):
        return [value[1], value[0]]
    twist = TWISTS.get(stem, _floating if stem.startswith("float") else _integer)
    return twist(value)


def _floating(value: float) -> float:
    return value + 1.0


def _integer(value: int) -> int:
    return value ^ 1


TWISTS: dict[str, Callable[[Any], Any]] = {
    "vector": lambda value: [v + i for i, v in enumerate(value, start=1)],
    "matrix": lambda value: [
        [v + 10.0 * i + j for j, v in enumerate(row, start=1)] for i, row in enumerate(value, start=1)
    ],
    "boolean": lambda value: not value,
    "string": lambda value: f"{value}!",
    "binary": lambda value: bytes(value)[::-1],
    "enumeration": lambda value: value % 3 + 1,
}
