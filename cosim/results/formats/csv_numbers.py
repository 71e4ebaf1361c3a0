"""Numbers of a CSV file by a C function that is compiled once, for long tables; the bytes are those of Python's repr.

Loaded only for these: it brings the tool chain of the exports with it.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import cache
from importlib.resources import files

import numpy as np

from fmus.toolchain.cached_library import cached_library
from fmus.toolchain.compile import CompilationError, CompilerMissing, find_compiler
from plant_models.disk_cache.folder import cache_folder

SOURCE = "shortest.c"
POWERS = range(-292, 325)
"""Powers of ten that the digits of a double are found with."""
_BITS = 128
ROOM = 25
"""Bytes of the longest number, ``-2.2250738585072014e-308``, and what is behind it."""

Rows = Callable[[np.ndarray], bytes]


@cache
def native_rows() -> Rows | None:
    """A function that writes rows of numbers, shape (rows, columns), as lines of text; None without a C compiler."""
    try:
        sources = {SOURCE: (files("cosim.results.formats") / SOURCE).read_bytes()}
        library = ctypes.CDLL(str(cached_library("shortest", sources, SOURCE, find_compiler(), cache_folder())))
    except (CompilerMissing, CompilationError, OSError):
        return None
    function = library.shortest_rows
    function.restype = ctypes.c_int64
    function.argtypes = [ctypes.c_void_p, ctypes.c_int64, ctypes.c_int64, ctypes.c_void_p, ctypes.c_void_p]
    powers = _powers_of_ten()

    def rows(values: np.ndarray) -> bytes:
        numbers = np.ascontiguousarray(values, dtype=np.float64)
        text = np.empty(numbers.size * ROOM, dtype=np.uint8)
        count = function(numbers.ctypes.data, *numbers.shape, powers.ctypes.data, text.ctypes.data)
        return text[:count].tobytes()

    return rows


def _powers_of_ten() -> np.ndarray:
    """The upper 128 bits of 10^k for each k in `POWERS`, rounded up, as two words each, shape (617, 2)."""
    words = [divmod(_upper_bits(10 ** abs(k), inverse=k < 0), 2**64) for k in POWERS]
    return np.array(words, dtype=np.uint64)


def _upper_bits(power: int, *, inverse: bool) -> int:
    length = power.bit_length()
    if inverse:
        return -(-(1 << (length + _BITS - 1)) // power)
    return power << (_BITS - length) if length <= _BITS else -(-power >> (length - _BITS))
