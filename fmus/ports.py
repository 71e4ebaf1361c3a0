"""Ports: prepared reads and writes of a group of variables, without lists or look-ups in a step.

Float64 / Real variables of a native FMU are read straight into the caller's array through preset ctypes pointers, those
of a Python block through calls it prepares; everything else goes through fmpy's list calls.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from typing import Any, Literal

import numpy as np
from fmpy.model_description import ModelVariable

REAL_TYPE = {2: "Real", 3: "Float64"}


def make_reader(slave: Any, fmi_version: int, variables: Sequence[ModelVariable], values: np.ndarray) -> Callable[[], None]:
    """A call that reads `variables` into `values`, shape (len(variables),)."""
    return _make_port(slave, fmi_version, variables, values, "Get")


def make_writer(slave: Any, fmi_version: int, variables: Sequence[ModelVariable], buffer: np.ndarray) -> Callable[[], None]:
    """A call that writes `variables` from `buffer`, shape (len(variables),)."""
    return _make_port(slave, fmi_version, variables, buffer, "Set")


def _make_port(
    slave: Any, fmi_version: int, variables: Sequence[ModelVariable], values: np.ndarray, verb: Literal["Get", "Set"]
) -> Callable[[], None]:
    groups = _groups(variables, fmi_version)
    if not groups:
        return _nothing
    if list(groups) == [REAL_TYPE[fmi_version]]:
        references = [v.valueReference for v in variables]
        if _is_native(slave):
            return _native(slave, fmi_version, verb, references, values)
        prepare = getattr(slave, f"prepared_{verb.lower()}", None)
        if prepare is not None:
            prepared: Callable[[], None] = prepare(references, values)
            return prepared
    list_port = _list_reader if verb == "Get" else _list_writer
    return _sequence([list_port(slave, kind, variables, positions, values) for kind, positions in groups.items()])


def _groups(variables: Sequence[ModelVariable], fmi_version: int) -> dict[str, list[int]]:
    groups: dict[str, list[int]] = {}
    for position, variable in enumerate(variables):
        kind = variable.type
        if kind == "Enumeration":
            kind = "Integer" if fmi_version == 2 else "Int64"
        groups.setdefault(kind, []).append(position)
    return groups


def _is_native(slave: Any) -> bool:
    return hasattr(slave, "dll")


def _native(slave: Any, fmi_version: int, verb: str, references: list[int], values: np.ndarray) -> Callable[[], None]:
    assert values.flags.c_contiguous
    assert values.dtype == np.float64
    count = len(references)
    vr = (ctypes.c_uint32 * count)(*references)
    pointer = values.ctypes.data_as(ctypes.POINTER(ctypes.c_double))
    call = getattr(slave, f"fmi{fmi_version}{verb}{REAL_TYPE[fmi_version]}")
    component = slave.component
    arguments = (component, vr, count, pointer) if fmi_version == 2 else (component, vr, count, pointer, count)

    def transfer(_alive: Any = values) -> None:
        call(*arguments)

    return transfer


def _list_reader(
    slave: Any, kind: str, variables: Sequence[ModelVariable], positions: list[int], values: np.ndarray
) -> Callable[[], None]:
    get = getattr(slave, f"get{kind}")
    references = [variables[i].valueReference for i in positions]
    first, last = positions[0], positions[-1]
    index: Any = slice(first, last + 1) if positions == list(range(first, last + 1)) else positions

    def read() -> None:
        values[index] = get(references)

    return read


def _list_writer(
    slave: Any, kind: str, variables: Sequence[ModelVariable], positions: list[int], buffer: np.ndarray
) -> Callable[[], None]:
    set_values = getattr(slave, f"set{kind}")
    references = [variables[i].valueReference for i in positions]
    if kind in ("Real", "Float64", "Float32"):
        if len(positions) == len(buffer):
            return lambda: set_values(references, buffer.tolist())
        return lambda: set_values(references, buffer[positions].tolist())
    cast: Callable[[float], Any] = (lambda x: bool(round(x))) if kind == "Boolean" else round
    return lambda: set_values(references, [cast(x) for x in buffer[positions].tolist()])


def _sequence(calls: list[Callable[[], None]]) -> Callable[[], None]:
    if len(calls) == 1:
        return calls[0]

    def call_all() -> None:
        for call in calls:
            call()

    return call_all


def _nothing() -> None:
    """No variables."""
