"""Numbers as text: as few digits as the tolerance allows, so that noise of the last bits makes no difference between
versions.

Standard library only. Python's own conversions know no locale: the decimal point is a point everywhere.
"""

from __future__ import annotations

from collections.abc import Iterable
from math import floor, isfinite, log10

SHARE = 1e-3
"""The last digit kept, as a share of the difference allowed: rounding takes at most half of it from the tolerance."""
LARGE = 1e16
"""Size from which numbers are written in full: beyond it float64 knows no digits behind the point."""
MOST = 15
"""Digits behind the point beyond which rounding gains nothing: numbers are then written in full."""


def decimals_for(allowed: float) -> int | None:
    """Digits behind the decimal point that a column keeps.

    Args:
        allowed: difference allowed, in the unit of the column.

    Returns:
        The number of digits, negative for tens and hundreds; None where every bit is kept (nothing is allowed to
        differ).
    """
    if not (allowed > 0.0 and isfinite(allowed)):
        return None
    digits = -floor(log10(allowed * SHARE))
    return digits if digits <= MOST else None


def number_text(value: float, decimals: int | None) -> str:
    """A number as text.

    Args:
        value: the number; NaN and infinities become ``nan``, ``inf`` and ``-inf``.
        decimals: as from `decimals_for`; None for the shortest text that reads back as the same number.
    """
    full = repr(float(value)).removesuffix(".0")
    if decimals is None or not isfinite(value) or abs(value) >= LARGE:
        return full
    short = f"{value:.{decimals}f}".rstrip("0").rstrip(".") if decimals > 0 else f"{round(value, decimals):.0f}"
    return "0" if short in ("-0", "") else short


def column_text(values: Iterable[float], decimals: int | None) -> list[str]:
    """A column of numbers as text, see `number_text`.

    Args:
        values: the numbers.
        decimals: digits behind the point; None for as many as they need.
    """
    return [number_text(value, decimals) for value in values]


def time_text(times: list[float], decimals: int | None) -> list[str]:
    """Instants as text. Those that rounding would make equal or put out of order are written in full.

    Rows with the same time are the two sides of an event: rounding must make none and lose none.

    Args:
        times: of the rows [s], not decreasing. decimals: as from `decimals_for`.
    """
    texts = column_text(times, decimals)
    for row in range(1, len(times)):
        if times[row] != times[row - 1] and not float(texts[row]) > float(texts[row - 1]):
            for near in (row - 1, row):
                texts[near] = _same_instant(times, texts, near)
    return texts


def _same_instant(times: list[float], texts: list[str], row: int) -> str:
    """The full text of a row's time, given to the rows with the same time as well."""
    full = number_text(times[row], None)
    first = row
    while first > 0 and times[first - 1] == times[row]:
        first -= 1
    while first < len(times) and times[first] == times[row]:
        texts[first] = full
        first += 1
    return full
