"""The rows of a baseline as text: numbers with as many digits as a tolerance needs, many rows at once.

Uses the writer of result tables. What that writes in another way, or cannot round without doubt, is written number by
number.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from math import isfinite

import numpy as np

from cosim.results.formats.csv_file import rows_as_text

Decimals = int | None
"""Digits behind the decimal point; None for the shortest text that reads back as the same number."""

_LARGE = 1e16
"""Size from which numbers are written in full: beyond it float64 knows no digits behind the point."""

_WHOLE = re.compile(rb"\.0(?=[,\n])")
_DIGITS = 15
"""A decimal number of so many digits is the only one near its double, so that the shortest text is that number."""

_CHUNK = 65536
"""Rows that are written at once."""


def number_text(value: float, decimals: Decimals) -> str:
    """A number as text.

    Args:
        value: the number; NaN and infinities become ``nan``, ``inf`` and ``-inf``.
        decimals: digits to keep.
    """
    full = repr(float(value)).removesuffix(".0")
    if decimals is None or not isfinite(value) or abs(value) >= _LARGE:
        return full
    short = f"{value:.{decimals}f}".rstrip("0").rstrip(".") if decimals > 0 else f"{round(value, decimals):.0f}"
    return "0" if short in ("-0", "") else short


def _column_text(values: Iterable[float], decimals: Decimals) -> list[str]:
    return [number_text(value, decimals) for value in values]


def time_text(times: list[float], decimals: Decimals) -> list[str]:
    """Instants as text. Those that rounding would make equal or put out of order are written in full.

    Rows with the same time are the two sides of an event: rounding must make none and lose none.

    Args:
        times: of the rows [s], not decreasing. decimals: digits to keep.
    """
    texts = _column_text(times, decimals)
    for row in range(1, len(times)):
        if times[row] != times[row - 1] and not float(texts[row]) > float(texts[row - 1]):
            for near in (row - 1, row):
                texts[near] = _equal_instant(times, texts, near)
    return texts


def _equal_instant(times: list[float], texts: list[str], row: int) -> str:
    """The full text of a row's time, given to the rows with the same time as well."""
    full = number_text(times[row], None)
    first = row
    while first > 0 and times[first - 1] == times[row]:
        first -= 1
    while first < len(times) and times[first] == times[row]:
        texts[first] = full
        first += 1
    return full


def rows_text(columns: Sequence[np.ndarray], decimals: Sequence[Decimals]) -> str:
    """Rows as lines of a CSV.

    Args:
        columns: time [s] and signals, each of shape (rows,). decimals: digits to keep, by column.
    """
    found = [_rounded(column, digits) for column, digits in zip(columns, decimals, strict=True)]
    unit = 0.0 if decimals[0] is None else 1.5 * 10.0 ** -decimals[0]
    if np.any((np.diff(columns[0]) != 0.0) & ~(np.diff(found[0][0]) > unit)):  # rounding may make instants equal
        return _line_by_line(columns, decimals)
    values, doubtful = np.stack([one for one, _ in found], axis=1), np.any([two for _, two in found], axis=0)
    write, texts = rows_as_text(values.size), list[str]()
    for start in range(0, len(values), _CHUNK):
        part = slice(start, start + _CHUNK)
        text = _WHOLE.sub(b"", write(values[part])).decode()
        if (again := np.flatnonzero(doubtful[part])).size:
            lines = text.splitlines(keepends=True)
            rows = _line_by_line([column[start + again] for column in columns], decimals).splitlines(keepends=True)
            for row, line in zip(again.tolist(), rows, strict=True):
                lines[row] = line
            text = "".join(lines)
        texts.append(text)
    return "".join(texts)


def _line_by_line(columns: Sequence[np.ndarray], decimals: Sequence[Decimals]) -> str:
    time, *others = (column.tolist() for column in columns)
    texts = [time_text(time, decimals[0]), *map(_column_text, others, decimals[1:])]
    return "".join(",".join(row) + "\n" for row in zip(*texts, strict=True))


def _rounded(values: np.ndarray, decimals: Decimals) -> tuple[np.ndarray, np.ndarray]:
    """Numbers whose shortest text is that of `number_text`, shape (rows,), and where that is in doubt.

    So it is near a tie, where there are too many digits, and where the shortest text has an exponent.
    """
    if decimals is None:
        return values, np.zeros(len(values), dtype=bool)
    if abs(decimals) > _DIGITS:
        return values, np.ones(len(values), dtype=bool)
    scale = 10.0 ** abs(decimals)  # exactly
    with np.errstate(invalid="ignore", over="ignore"):
        scaled = values * scale if decimals >= 0 else values / scale
        whole = np.rint(scaled)
        shown = (whole / scale if decimals >= 0 else whole * scale) + 0.0  # no minus before zero
        near_tie = np.abs(np.abs(scaled - whole) - 0.5) <= 1e-9 + 4.0 * np.finfo(float).eps * np.abs(scaled)
        many = np.maximum(np.abs(whole), np.abs(shown)) >= 10.0**_DIGITS
    finite, small = np.isfinite(values), (shown != 0.0) & (np.abs(shown) < 1e-4)
    return np.where(finite, shown, values), finite & (near_tie | many | small)
