"""The tube: what values a curve takes within the allowed time around given instants. NumPy only, O(n log n)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from cosim.comparison.curve import BESIDE, Curve

_AT_A_TIME = 1 << 14
"""Rows whose bands are looked for together: what is kept in between does not grow with their number."""


@dataclass(frozen=True)
class _TubeBand:
    """Values a curve takes around instants; arrays of shape (instants,).

    Args:
        low, high: smallest and largest value [unit].
        evaluated: False where the curve has no value within the allowed time: beyond its end, or in another piece.
    """

    low: np.ndarray
    high: np.ndarray
    evaluated: np.ndarray


def band_of(
    curve: Curve,
    at: np.ndarray,
    tolerance: float | np.ndarray,
    first: np.ndarray | int = 0,
    last: np.ndarray | int | None = None,
) -> _TubeBand:
    """Smallest and largest value of the curve in [at - tolerance, at + tolerance], within one piece.

    Args:
        curve: the finer curve. at: instants [s], shape (m,). tolerance: [s].
        first, last: rows first <= row < last of the piece that belongs to each instant; the whole curve if left out.
    """
    low, high, evaluated = np.empty(len(at)), np.empty(len(at)), np.empty(len(at), dtype=bool)
    last = len(curve.time) if last is None else last
    where = [np.broadcast_to(np.asarray(each), at.shape) for each in (at, tolerance, first, last)]
    for some in _slices(len(at)):
        low[some], high[some], evaluated[some] = _band_rows(curve, *(each[some] for each in where))
    return _TubeBand(low, high, evaluated)


def _slices(count: int) -> Iterator[slice]:
    return (slice(start, start + _AT_A_TIME) for start in range(0, count, _AT_A_TIME))


def _band_rows(
    curve: Curve, at: np.ndarray, tolerance: np.ndarray, first: np.ndarray, last: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Lowest and highest values of some instants, and where there are any."""
    time, values = curve.time, curve.filled
    begin, end = time[first], time[np.minimum(last, len(time) - 1) if curve.held else last - 1]
    low, high = np.maximum(at - tolerance, begin), np.minimum(at + tolerance, end)
    evaluated = low <= high
    low = np.where(evaluated, low, np.clip(at, begin, end))
    high = np.where(evaluated, high, low)
    ends = [_value(curve, low, first, last), _value(curve, high, first, last)]
    a = np.maximum(np.searchsorted(time, low), first)
    b = np.minimum(np.searchsorted(time, high, side="right"), last)
    smallest, largest = _range_extremes(values, a, b)
    return np.minimum.reduce([*ends, smallest]), np.maximum.reduce([*ends, largest]), evaluated


def widen_at_ends(
    band: _TubeBand, curve: Curve, at: np.ndarray, tolerance: float, first: np.ndarray, last: np.ndarray
) -> _TubeBand:
    """The band with what the curve may have been within the allowed time before its first row and after its last one.

    Nobody knows, so the curve is continued by its own reflection in its end point: a ramp as the same ramp. Without
    this a smooth signal that is late by less than allowed would be wrong in its first rows.

    Args:
        band: of the curve at the instants, from `band_of`.
        curve: the finer curve.
        at: instants [s], shape (m,).
        tolerance: time that is allowed before and after each instant [s].
        first: first row of the piece that belongs to each instant, shape (m,).
        last: the row behind its last one, shape (m,).
    """
    low, high = band.low.copy(), band.high.copy()
    ends = [
        (0, at - tolerance < curve.time[0], first == 0),
        (-1, at + tolerance > curve.time[-1], last == len(curve.time)),
    ]
    for row, beyond, in_piece in ends:
        near = np.flatnonzero(beyond & in_piece & band.evaluated)
        if len(near):
            end, value = np.full(len(near), curve.time[row]), curve.filled[row]
            reach = tolerance - (at[near] - end if row == 0 else end - at[near])
            inner = band_of(curve, end, reach, first[near], last[near])
            low[near] = np.minimum(low[near], 2.0 * value - inner.high)
            high[near] = np.maximum(high[near], 2.0 * value - inner.low)
    return _TubeBand(low, high, band.evaluated)


def held_band(curve: Curve, tolerance: float, first: np.ndarray, last: np.ndarray, late: float = 0.0) -> _TubeBand:
    """Values of a held curve that are allowed for another on the same rows, all the time that a row holds.

    A row holds from its own time until that of the next. A value that comes one row late is right at the begin of the
    row, within the allowed time, and wrong at its end; so the begin, the middle and the end are looked at. The last row
    has no end: its value counts, unless a change there may come after it.

    Args:
        curve: the curve, on the rows of the other. tolerance: [s]. first, last: as in `band_of`, for each row.
        late: how much later a change of the other is, where both have it [s].
    """
    until = np.append(curve.time[1:], curve.time[-1])
    low, high, evaluated = np.empty(len(until)), np.empty(len(until)), np.empty(len(until), dtype=bool)
    for some in _slices(len(until)):
        where = curve.time[some], until[some], tolerance, first[some], last[some]
        low[some], high[some], evaluated[some] = _held_rows(curve, *where)
    if _is_apart(curve, max(tolerance, late)):
        low[-1] = high[-1] = curve.filled[-1]
    return _TubeBand(np.minimum(low, high), high, evaluated)


def _held_rows(
    curve: Curve, at: np.ndarray, until: np.ndarray, tolerance: float, first: np.ndarray, last: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of some rows, from `at` to `until` [s], the largest of the lowest values, the smallest of the highest, and where
    there are any.
    """
    begin, middle = (band_of(curve, instants, tolerance, first, last) for instants in (at, 0.5 * (at + until)))
    end = _band_before(curve, until, tolerance, first, last)
    holds = until > at
    evaluated = np.stack([begin.evaluated, middle.evaluated & holds, end.evaluated & holds])
    low = np.max(np.where(evaluated, [begin.low, middle.low, end.low], -np.inf), axis=0)
    high = np.min(np.where(evaluated, [begin.high, middle.high, end.high], np.inf), axis=0)
    return low, high, np.asarray(evaluated.any(axis=0))


def _is_apart(curve: Curve, reach: float) -> bool:
    """Whether the last row is further than `reach` [s] from those before it."""
    before = np.searchsorted(curve.time, curve.time[-1])
    return before == 0 or bool(curve.time[-1] - curve.time[before - 1] > reach * (1.0 + BESIDE))


def _band_before(curve: Curve, until: np.ndarray, tolerance: float, first: np.ndarray, last: np.ndarray) -> _TubeBand:
    """As `band_of`, of a held curve just before the instants."""
    time = curve.time
    begin, end = time[first], time[np.minimum(last, len(time) - 1)]
    evaluated = (until + tolerance > begin) & (until - tolerance <= end)
    low = np.clip(until - tolerance, begin, end)
    a = np.clip(np.searchsorted(time, low) - 1, first, last - 1)
    b = np.clip(np.searchsorted(time, until + tolerance), a + 1, last)
    return _TubeBand(*_range_extremes(curve.filled, a, b), evaluated)


def project(curve: Curve, onto: Curve, tolerance: float) -> Curve:
    """A held curve at the rows of another: its own value where it has a row there and none other within the allowed
    time, else of the values within that time the nearest one.

    Args:
        curve: the finer one. onto: the coarser one. tolerance: [s].
    """
    at, time = onto.time, curve.time
    nearest = np.searchsorted(0.5 * (time[1:] + time[:-1]), at)
    own = time[nearest]
    gap = np.diff(time[np.flatnonzero(np.diff(time, prepend=-np.inf))], prepend=-np.inf, append=np.inf)
    instant = np.cumsum(np.diff(time, prepend=-np.inf) > 0.0)[nearest] - 1
    room = np.minimum(gap[instant], gap[instant + 1])
    alone = np.isfinite(room) & (np.abs(own - at) <= BESIDE * room) & (room * (1.0 - BESIDE) > tolerance)
    band = band_of(curve, np.where(alone, own, at), np.where(alone, 0.0, tolerance))
    values = np.where(onto.finite & band.evaluated, np.clip(onto.filled, band.low, band.high), band.low)
    return Curve(onto.time, values, held=True)


def _value(curve: Curve, at: np.ndarray, first: np.ndarray, last: np.ndarray) -> np.ndarray:
    time, values = curve.time, curve.filled
    row = np.clip(np.searchsorted(time, at, side="right") - 1, first, last - 1)
    if curve.held:
        return np.asarray(values[row])
    following = np.minimum(row + 1, last - 1)
    duration = time[following] - time[row]
    share = np.divide(at - time[row], duration, out=np.zeros(at.shape), where=duration > 0.0)
    return np.asarray(values[row] + np.clip(share, 0.0, 1.0) * (values[following] - values[row]))


def _range_extremes(values: np.ndarray, a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Smallest and largest of values[a:b] for each range; +inf and -inf for an empty one."""
    low, high = np.full(a.shape, np.inf), np.full(a.shape, -np.inf)
    from_row = int(np.min(a, initial=len(values)))
    values, length, a, b = values[from_row : int(np.max(b, initial=0))], b - a, a - from_row, b - from_row
    smallest = largest = values
    power = 1
    while power <= np.max(length, initial=0):  # smallest[k] is that of values[k : k + power]
        chosen = (length >= power) & (length < 2 * power)
        head, tail = a[chosen], b[chosen] - power
        low[chosen] = np.minimum(smallest[head], smallest[tail])
        high[chosen] = np.maximum(largest[head], largest[tail])
        smallest = np.minimum(smallest[:-power], smallest[power:])
        largest = np.maximum(largest[:-power], largest[power:])
        power *= 2
    return low, high
