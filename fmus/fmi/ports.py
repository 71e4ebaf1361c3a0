"""Ports: prepared reads and writes of a group of numeric variables, without lists or look-ups in a step.

Values are doubles; arrays of FMI 3 lie row by row. Variables of a native FMU go through preset ctypes buffers, doubles
that lie together straight into the caller's array; those of a Python block go through calls it prepares; everything
else goes through fmpy's list calls. What must stay as it is (texts, bytes, 64-bit integers) has the ports in
`fmus.fmi.exact_ports`.
"""

from __future__ import annotations

import ctypes
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from fmpy.model_description import ModelVariable

from fmus.fmi.native_calls import prepared_call
from fmus.fmi.types import FLOATING_TYPES, REAL_TYPE, c_type, getter_type, size


def is_native(slave: Any) -> bool:
    """Whether a slave is a shared library, so that its functions take ctypes buffers."""
    return hasattr(slave, "dll")


Verb = Literal["Get", "Set"]


@dataclass(frozen=True)
class _Group:
    """Variables of one type.

    Args:
        kind: type in the name of the functions. references: of the variables. total: number of values.
        index: where their values lie in the caller's array.
        has_arrays: whether some have more than one value each.
    """

    kind: str
    references: list[int]
    total: int
    index: Any
    has_arrays: bool


def make_port(
    slave: Any, fmi_version: int, verb: Verb, variables: Sequence[ModelVariable], values: np.ndarray
) -> Callable[[], None]:
    """A call that reads variables into an array, or writes them from it.

    Args:
        slave: instantiated, with fmpy's call surface.
        fmi_version: 1, 2 or 3.
        verb: ``Get`` or ``Set``.
        variables: whole ones. values: that array, shape (number of values of all,).
    """
    groups = _groups(variables, fmi_version)
    if not groups:
        return _nothing
    if is_native(slave):
        return _sequence([_native_transfer(slave, fmi_version, verb, group, values) for group in groups])
    prepare = getattr(slave, f"prepared_{verb.lower()}", None)
    if (
        prepare is not None
        and len(groups) == 1
        and groups[0].kind == REAL_TYPE[fmi_version]
        and not groups[0].has_arrays
    ):
        prepared: Callable[[], None] = prepare(groups[0].references, values)
        return prepared
    list_port = _list_reader if verb == "Get" else _list_writer
    return _sequence([list_port(slave, group, values) for group in groups])


def _groups(variables: Sequence[ModelVariable], fmi_version: int) -> list[_Group]:
    members: dict[str, list[tuple[ModelVariable, range]]] = {}
    position = 0
    for variable in variables:
        span = range(position, position + size(variable))
        members.setdefault(getter_type(variable.type, fmi_version), []).append((variable, span))
        position = span.stop
    return [_group(kind, entries) for kind, entries in members.items()]


def _group(kind: str, members: Sequence[tuple[ModelVariable, range]]) -> _Group:
    places = [i for _, span in members for i in span]
    contiguous = bool(places) and places == list(range(places[0], places[-1] + 1))
    index: Any = slice(places[0], places[-1] + 1) if contiguous else np.array(places, dtype=np.intp)
    has_arrays = any(variable.shape for variable, _ in members)
    return _Group(kind, [variable.valueReference for variable, _ in members], len(places), index, has_arrays)


def native_call(
    slave: Any, fmi_version: int, verb: Verb, kind: str, references: Sequence[int], *rest: Any
) -> Callable[[], None]:
    """A getter or setter of the library with all its arguments.

    Args:
        slave: native, instantiated.
        fmi_version: 1, 2 or 3.
        verb: which of both.
        kind: type in the name of the function.
        references: value references of the variables.
        rest: buffers as in the signature, and the number of values, which FMI 3 alone takes.
    """
    count, (*buffers, total) = len(references), rest
    numbers = (total,) if fmi_version == 3 else ()
    held = (ctypes.c_uint32 * count)(*references)
    return prepared_call(slave, f"fmi{fmi_version}{verb}{kind}", slave.component, held, count, *buffers, *numbers)


def _straight(values: np.ndarray, group: _Group) -> Any:
    """A pointer to the caller's doubles where the group's lie together in them, else None."""
    if not isinstance(group.index, slice) or group.kind not in REAL_TYPE.values():
        return None
    assert values.flags.c_contiguous
    assert values.dtype == np.float64
    return values[group.index].ctypes.data_as(ctypes.POINTER(ctypes.c_double))  # keeps the array alive


def _native_transfer(slave: Any, fmi_version: int, verb: Verb, group: _Group, values: np.ndarray) -> Callable[[], None]:
    called = (slave, fmi_version, verb, group.kind, group.references)
    pointer = _straight(values, group)
    if pointer is not None:
        return native_call(*called, pointer, group.total)
    kind, letter, dtype = c_type(group.kind, fmi_version)
    raw = (kind * group.total)()
    call, index = native_call(*called, raw, group.total), group.index
    seen: np.ndarray = np.frombuffer(raw, dtype=dtype)
    pack = struct.Struct(f"={group.total}{letter}").pack_into  # refuses what the type cannot hold; ctypes would wrap it
    truth, cast = group.kind == "Boolean", _cast(group.kind)

    def read() -> None:
        call()
        values[index] = seen != 0 if truth else seen

    def write() -> None:
        pack(raw, 0, *map(cast, values[index].tolist()))
        call()

    return read if verb == "Get" else write


def _cast(kind: str) -> Callable[[float], Any]:
    if kind in FLOATING_TYPES:
        return float
    return (lambda x: bool(round(x))) if kind == "Boolean" else round


def _list_reader(slave: Any, group: _Group, values: np.ndarray) -> Callable[[], None]:
    kind, references, index, total = group.kind, group.references, group.index, group.total
    get = getattr(slave, f"get{kind}")
    more = {"nValues": group.total} if group.has_arrays else {}

    def read() -> None:
        stated = get(references, **more)
        if len(stated) != total:
            raise ValueError(f"get{kind} gave {len(stated)} values, expected {total}")
        values[index] = stated

    return read


def _list_writer(slave: Any, group: _Group, buffer: np.ndarray) -> Callable[[], None]:
    set_values, references, index = getattr(slave, f"set{group.kind}"), group.references, group.index
    if group.kind in FLOATING_TYPES:
        return lambda: set_values(references, buffer[index].tolist())
    cast = _cast(group.kind)
    return lambda: set_values(references, [cast(x) for x in buffer[index].tolist()])


def _sequence(calls: list[Callable[[], None]]) -> Callable[[], None]:
    if len(calls) == 1:
        return calls[0]

    def call_all() -> None:
        for call in calls:
            call()

    return call_all


def _nothing() -> None:
    """No variables."""
