"""Whether two results are the same to the last bit. NumPy only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple

import numpy as np

from cosim.results.result import BaliseRecord, PacketRecord, Result

CHUNK = 65536


def same_result(first: Result, second: Result) -> bool:
    """Whether tables, telegrams and packets agree in every bit.

    One NaN is as good as another, since text files keep no more of it.

    Args:
        first: one of them. second: the other.
    """
    return (
        _same_table(first.table, second.table)
        and same_events(first.events, second.events)
        and same_events(first.packets, second.packets)
    )


def _same_table(first: np.ndarray, second: np.ndarray) -> bool:
    """Whether two tables have the same columns in the same order and the same bits in every row."""
    if first.dtype.names != second.dtype.names or first.shape != second.shape:
        return False
    names = first.dtype.names or ()
    return all(
        _same_bits(first[name][start : start + CHUNK], second[name][start : start + CHUNK])
        for start in range(0, len(first), CHUNK)
        for name in names
    )


def same_events(first: Sequence[BaliseRecord | PacketRecord], second: Sequence[BaliseRecord | PacketRecord]) -> bool:
    """Whether two lists of telegrams or packets are the same.

    Args:
        first: one of them. second: the other.
    """
    return len(first) == len(second) and all(
        list(map(_bits, astuple(a))) == list(map(_bits, astuple(b))) for a, b in zip(first, second, strict=True)
    )


def _same_bits(first: np.ndarray, second: np.ndarray) -> bool:
    a, b = np.ascontiguousarray(first).view(np.uint64), np.ascontiguousarray(second).view(np.uint64)
    return bool(np.all((a == b) | (np.isnan(first) & np.isnan(second))))


def _bits(value: object) -> object:
    return float(value).hex() if isinstance(value, float) else dict(value) if isinstance(value, dict) else value
