"""Exact ports: prepared reads and writes of one variable of any type, value by value, with nothing converted.

Texts, bytes and 64-bit integers do not fit into doubles. Texts are `str` (UTF-8; what is not, comes back out as it came
in), bytes are `bytes`, integers are `int`; arrays of FMI 3 are tuples, row by row.
"""

from __future__ import annotations

import ctypes
import struct
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from fmpy.model_description import ModelVariable

from fmus.fmi.ports import is_native, native_call
from fmus.fmi.types import c_type, getter_type, size

Values = tuple[Any, ...]
ENCODING = ("utf-8", "surrogateescape")
"""Text that is no valid UTF-8 survives the way through Python byte by byte."""


def make_exact_reader(slave: Any, fmi_version: int, variable: ModelVariable) -> Callable[[], Values]:
    """A call that returns the values of a variable, one for a scalar.

    Args:
        slave: instantiated, with fmpy's call surface.
        fmi_version: 2 or 3.
    """
    kind, total = getter_type(variable.type, fmi_version), size(variable)
    if not is_native(slave):
        return _list_reader(slave, kind, variable, total)
    if kind == "String":
        return _string_reader(slave, fmi_version, variable, total)
    if kind == "Binary":
        return _binary_reader(slave, variable, total)
    return _number_reader(slave, fmi_version, kind, variable, total)


def make_exact_writer(slave: Any, fmi_version: int, variable: ModelVariable) -> Callable[[Sequence[Any]], None]:
    """A call that writes the values of a variable, one for a scalar.

    The call raises ValueError, OverflowError, TypeError or struct.error for a value that the type cannot hold.

    Args:
        slave: instantiated, with fmpy's call surface.
        fmi_version: 2 or 3.
    """
    kind, total = getter_type(variable.type, fmi_version), size(variable)
    if not is_native(slave):
        write = getattr(slave, f"set{kind}")
        return lambda values: write([variable.valueReference], list(values))
    if kind == "String":
        return _string_writer(slave, fmi_version, variable, total)
    if kind == "Binary":
        return _binary_writer(slave, variable, total)
    return _number_writer(slave, fmi_version, kind, variable, total)


def _list_reader(slave: Any, kind: str, variable: ModelVariable, total: int) -> Callable[[], Values]:
    get, more = getattr(slave, f"get{kind}"), ({"nValues": total} if variable.shape else {})

    def read() -> Values:
        return tuple(_text(v) if kind == "String" else v for v in get([variable.valueReference], **more))

    return read


def _number_reader(
    slave: Any, fmi_version: int, kind: str, variable: ModelVariable, total: int
) -> Callable[[], Values]:
    ctype, _, dtype = c_type(kind, fmi_version)
    raw = (ctype * total)()
    seen: np.ndarray = np.frombuffer(raw, dtype=dtype)
    call = native_call(slave, fmi_version, "Get", kind, [variable.valueReference], raw, total)

    def read() -> Values:
        call()
        return tuple((seen != 0).tolist() if kind == "Boolean" else seen.tolist())

    return read


def _number_writer(
    slave: Any, fmi_version: int, kind: str, variable: ModelVariable, total: int
) -> Callable[[Sequence[Any]], None]:
    ctype, letter, _ = c_type(kind, fmi_version)
    raw = (ctype * total)()
    pack = struct.Struct(f"={total}{letter}").pack_into
    call = native_call(slave, fmi_version, "Set", kind, [variable.valueReference], raw, total)

    def write(values: Sequence[Any]) -> None:
        pack(raw, 0, *map(bool, values) if kind == "Boolean" else values)
        call()

    return write


def _string_reader(slave: Any, fmi_version: int, variable: ModelVariable, total: int) -> Callable[[], Values]:
    raw = (ctypes.c_char_p * total)()
    call = native_call(slave, fmi_version, "Get", "String", [variable.valueReference], raw, total)

    def read() -> Values:
        call()
        return tuple(_text(value) for value in raw)

    return read


def _string_writer(
    slave: Any, fmi_version: int, variable: ModelVariable, total: int
) -> Callable[[Sequence[Any]], None]:
    raw = (ctypes.c_char_p * total)()
    call = native_call(slave, fmi_version, "Set", "String", [variable.valueReference], raw, total)

    def write(values: Sequence[Any]) -> None:
        raw[:] = [_encoded(value) for value in values]
        call()

    return write


def _binary_reader(slave: Any, variable: ModelVariable, total: int) -> Callable[[], Values]:
    sizes, pointers = (ctypes.c_size_t * total)(), (ctypes.POINTER(ctypes.c_uint8) * total)()
    call = native_call(slave, 3, "Get", "Binary", [variable.valueReference], sizes, pointers, total)

    def read() -> Values:
        call()
        return tuple(ctypes.string_at(p, n) if p and n else b"" for p, n in zip(pointers, sizes, strict=True))

    return read


def _binary_writer(slave: Any, variable: ModelVariable, total: int) -> Callable[[Sequence[Any]], None]:
    sizes, pointers = (ctypes.c_size_t * total)(), (ctypes.POINTER(ctypes.c_uint8) * total)()
    call = native_call(slave, 3, "Set", "Binary", [variable.valueReference], sizes, pointers, total)

    def write(values: Sequence[Any]) -> None:
        # never a null pointer
        kept = [ctypes.create_string_buffer(bytes(value), max(len(value), 1)) for value in values]
        for i, (buffer, value) in enumerate(zip(kept, values, strict=True)):
            pointers[i] = ctypes.cast(buffer, ctypes.POINTER(ctypes.c_uint8))
            sizes[i] = len(value)
        call()

    return write


def _text(value: bytes | str | None) -> str:
    """Text as Python has it; a null pointer is an empty text."""
    return value.decode(*ENCODING) if isinstance(value, bytes) else (value or "")


def _encoded(value: str) -> bytes:
    if "\0" in value:
        raise ValueError(f"the text {value!r} holds a zero character, which ends a text in C")
    return value.encode(*ENCODING)
