"""A column of numbers as a short text that a page decodes (``templates/live_data.js``). Imports NumPy only.

Values become integers: steps of a grid between the smallest and the largest value, or the upper half of their binary
form where the grid would be too coarse for most of them. Of the integers the first or second differences are kept, as
far as these are small, byte by byte, deflated, in base64.
"""

from __future__ import annotations

import zlib
from base64 import b64encode
from dataclasses import dataclass
from math import ceil
from typing import Any, Literal

import numpy as np

COARSEST, FINEST = 2**16, 2**24
"""Steps between the smallest and the largest value of a signal."""
INSTANTS = 2**31 - 1
"""Steps of a column of instants."""
_NOISE_STEPS = 256  # steps within the noise of a signal: finer ones would store chance
_SHARE = 1e-3  # a grid whose step is larger than this share of the middle half of the values is too coarse
_LARGEST = 1e150  # a grid over larger values would overflow
_LEVEL = 4  # of deflate
_NAN, _LOW, _HIGH = 1, 2, 3
_RELATIVE = 2.0**-21
"""Largest relative error of the upper half of the binary form."""


@dataclass(frozen=True, slots=True)
class PackedColumn:
    """A column, packed.

    Args:
        text: base64 of the deflated integers, four planes of bytes, the lowest first.
        kind: ``grid`` or ``float``.
        count: number of values.
        order: how many times differences were taken.
        low, high: ends of the grid. steps: of it between them.
        odd: likewise, one byte a value: 0 finite, 1 NaN, 2 minus infinity, 3 infinity; empty where all are finite.
        tolerance: largest error of a value that is decoded: absolute of a grid, relative otherwise.
    """

    text: str
    kind: Literal["grid", "float"]
    count: int
    order: int
    low: float
    high: float
    steps: int
    odd: str
    tolerance: float

    def data(self) -> dict[str, Any]:
        """All but the texts, for the page."""
        names = ("kind", "count", "order", "low", "high", "steps", "tolerance")
        return {name: getattr(self, name) for name in names}

    @property
    def size(self) -> int:
        """Characters in the page."""
        return len(self.text) + len(self.odd)


def pack(values: np.ndarray, steps: int | None = None) -> PackedColumn:
    """Pack a column.

    Args:
        values: shape (rows,); NaN and infinities stay what they are.
        steps: of the grid; None where they follow from the values.
    """
    values = np.asarray(values, dtype=float)
    finite = np.isfinite(values)
    odd = np.select([np.isnan(values), values == -np.inf, values == np.inf], [_NAN, _LOW, _HIGH], 0).astype(np.uint8)
    filled = values if finite.all() else _filled(values, finite)
    low, high = (float(np.min(filled)), float(np.max(filled))) if len(filled) else (0.0, 0.0)
    count = steps or _steps(filled, low, high)
    kind: Literal["grid", "float"] = "grid" if steps or _grid_fits(filled, low, high, count) else "float"
    if kind == "grid":
        integers = _on_grid(filled, low, high, count)
        tolerance = 0.51 * (high - low) / count  # half a step, and rounding
    else:
        integers, tolerance = _upper_half(filled), _RELATIVE
    order, differences = _smallest_differences(integers)
    return PackedColumn(
        _text(_planes(differences)),
        kind,
        len(values),
        order,
        low,
        high,
        count,
        "" if finite.all() else _text(odd),
        tolerance,
    )


def _filled(values: np.ndarray, finite: np.ndarray) -> np.ndarray:
    """The values with the one before in place of what is not finite, so that differences stay small."""
    if not finite.any():
        return np.zeros_like(values)
    places = np.maximum.accumulate(np.where(finite, np.arange(len(values)), -1))
    return np.asarray(values[np.where(places < 0, np.argmax(finite), places)])


def _steps(values: np.ndarray, low: float, high: float) -> int:
    """Steps of the grid: as many as the noise of the signal deserves, which second differences show."""
    if not (low < high and max(abs(low), abs(high)) <= _LARGEST):
        return 1
    bends = np.abs(np.diff(values, 2))
    bends = bends[bends > 1e-12 * (high - low)]  # what is less is rounding
    noise = float(np.median(bends)) if len(bends) else 0.0
    return ceil(min(max(_NOISE_STEPS * (high - low) / noise, COARSEST), FINEST)) if noise else FINEST


def _grid_fits(values: np.ndarray, low: float, high: float, steps: int) -> bool:
    """Whether a step of the grid is small beside the middle half of the values, too: one that diverged would hide it.
    Of a signal that mostly rests, it is held against what it does when it does not.

    Args:
        values: all finite. low, high: their ends. steps: between these.
    """
    if low == high:
        return True
    if max(abs(low), abs(high)) > _LARGEST:
        return False
    middle = float(np.subtract(*np.percentile(values, (75, 25))))
    if middle == 0.0:
        moves = np.abs(values - np.median(values))
        middle = float(np.percentile(moves[moves > 0.0], 25))
    return (high - low) / steps <= _SHARE * middle


def _on_grid(values: np.ndarray, low: float, high: float, steps: int) -> np.ndarray:
    """The nearest step of each value, shape (rows,)."""
    if low == high:
        return np.zeros(len(values), dtype=np.uint32)
    return np.asarray(np.rint((values - low) / (high - low) * steps).astype(np.uint32))


def _upper_half(values: np.ndarray) -> np.ndarray:
    """The upper 32 bits of each value, rounded, shape (rows,)."""
    bits = np.ascontiguousarray(values).view(np.uint64)
    sign, size = bits >> np.uint64(63), bits & np.uint64(2**63 - 1)
    rounded = np.minimum((size + np.uint64(2**31)) >> np.uint64(32), np.uint64(0x7FEFFFFF))  # never up to infinity
    return np.asarray((rounded | sign << np.uint64(31)).astype(np.uint32))


def _smallest_differences(integers: np.ndarray) -> tuple[int, np.ndarray]:
    """How many times differences are taken, and these with the sign in the last bit, so that small ones have small
    bytes.
    """
    found = []
    signed = integers.view(np.int32)
    for order in range(3):
        found.append(
            (float(np.mean(np.log2(1.0 + np.abs(signed.astype(float))))) if len(signed) else 0.0, order, signed)
        )
        signed = np.diff(signed, prepend=np.int32(0))  # wraps around, and so does the way back
    _, order, chosen = min(found, key=lambda entry: entry[:2])
    return order, ((chosen << 1) ^ (chosen >> 31)).view(np.uint32)


def _planes(integers: np.ndarray) -> np.ndarray:
    """The bytes of the integers, all lowest ones first, shape (4 rows,)."""
    return np.ascontiguousarray(integers.astype("<u4").view(np.uint8).reshape(-1, 4).T).ravel()


def _text(data: np.ndarray) -> str:
    return b64encode(zlib.compress(data.tobytes(), _LEVEL)).decode("ascii")
