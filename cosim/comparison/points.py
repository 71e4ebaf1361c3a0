"""Two curves of one signal point by point: corresponding pieces, value errors, rows that hold no number. NumPy only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cosim.comparison.alignment import match_jumps
from cosim.comparison.curve import Curve
from cosim.comparison.jumps import EQUAL_INSTANT, Jumps, choose, find_jumps, shifts
from cosim.comparison.tube import band_of, held_band, project, widen_at_ends

_ROUNDED_TIME = 1e-2  # of the allowed time: a baseline rounds times to less than that
MANY = 10  # jumps, from which on those at other instants must look like a delay


@dataclass(frozen=True)
class Allowed:
    """What two curves of a signal may differ by.

    Args:
        value: [unit]. time: [s]. scale: range of the reference [unit]. window: how far off a jump is looked for [s].
    """

    value: float
    time: float
    scale: float
    window: float


@dataclass(frozen=True)
class Points:
    """Two curves compared at the rows of the coarser one; arrays of shape (points,).

    Args:
        time: [s]. error: signed difference of value beyond what the allowed time explains, result minus reference
            [unit]. reference, result: values there; that of the finer curve is the nearest one its tube allows.
        evaluated: where both curves have a number in the same piece.
        no_number: where one holds a number and the other does not, or they hold different kinds of none.
    """

    time: np.ndarray
    error: np.ndarray
    reference: np.ndarray
    result: np.ndarray
    evaluated: np.ndarray
    no_number: np.ndarray


@dataclass(frozen=True)
class MatchedJumps:
    """Jumps of reference and result.

    Args:
        reference, result: the pairs. shift: of each pair, positive where the result is later [s], shape (pairs,).
        missing: alone in the reference. extra: alone in the result.
    """

    reference: Jumps
    result: Jumps
    shift: np.ndarray
    missing: Jumps
    extra: Jumps


def compare_points(reference: Curve, result: Curve, allowed: Allowed) -> tuple[Points, MatchedJumps]:
    """Match jumps, then hold the points of the coarser curve against the tube around the finer one, piece by piece.

    A pair of jumps further apart than the allowed time counts only where the values confirm it: where some point
    between the two is outside a tube that is not cut there. Else the two show one jump with different samples. Where
    many jumps would be moved in a way that no delay does, the value is wrong and not the time, and jumps are matched in
    place.

    Args:
        reference: curve of the reference.
        result: curve of the result.
        allowed: error and shift that are allowed.
    """
    view = _view(reference, result, allowed.time)
    one, two = (find_jumps(curve, allowed.value) for curve in view.sides)
    matched = _matched(one, two, allowed, allowed.window)
    apart = np.abs(matched.shift) > allowed.time
    if not apart.any():
        return view.points(matched), matched
    uncut = view.points(_some(matched, ~apart))
    confirmed = apart & _outside_near(uncut, matched, allowed)
    keep = ~apart | confirmed | (np.append(False, confirmed[:-1]) & np.append(confirmed[1:], False))
    moved = view.points(_some(matched, keep))
    explains = 2 * _count_outside(moved, allowed) <= _count_outside(uncut, allowed)
    if _is_patchwork(matched, apart & keep, allowed.value, explains):
        matched = _matched(one, two, allowed, max(allowed.time, 1e-9))
        return view.points(matched), matched
    return moved, _some(matched, keep)


def outside_between(points: Points, allowed: Allowed, begin: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Whether a point between two instants, or the next one before or after them, is outside the tube; of their
    shape.

    Args:
        points: the points that were held against the tube.
        allowed: error and shift that are allowed.
        begin: [s], shape (n,).
        end: [s], shape (n,).
    """
    outside = np.append(0, np.cumsum(points.evaluated & (np.abs(points.error) > allowed.value)))
    first = np.maximum(np.searchsorted(points.time, begin - allowed.time) - 1, 0)
    last = np.minimum(np.searchsorted(points.time, end + allowed.time, side="right") + 1, len(points.time))
    return np.asarray(outside[last] > outside[first])


@dataclass(frozen=True)
class _View:
    """Two curves ready to be compared.

    Args:
        fine: around it the tube is laid. coarse: its rows are the points. original: the finer curve as it was given.
        swap: whether the result is the finer one. usable, no_number: of the points, see `_numbers`. tolerance: [s].
    """

    fine: Curve
    coarse: Curve
    original: Curve
    swap: bool
    usable: np.ndarray
    no_number: np.ndarray
    tolerance: float

    @property
    def sides(self) -> tuple[Curve, Curve]:
        """Reference and result."""
        return (self.coarse, self.fine) if self.swap else (self.fine, self.coarse)

    def points(self, jumps: MatchedJumps) -> Points:
        """The points, with the curves cut at the pairs of jumps."""
        fine, coarse = self.fine, self.coarse
        rows = (jumps.result.row, jumps.reference.row) if self.swap else (jumps.reference.row, jumps.result.row)
        piece = np.searchsorted(rows[1], np.arange(len(coarse.time)))
        starts, ends = np.append(0, rows[0] + 1), np.append(rows[0] + 1, len(fine.time))
        if fine.held:
            late = float(np.max(-jumps.shift if self.swap else jumps.shift, initial=0.0))
            band = held_band(fine, self.tolerance, starts[piece], ends[piece], late)
        else:
            begin = _from_event(fine, coarse, self.tolerance, starts[piece], ends[piece])
            where = coarse.time, self.tolerance, begin, ends[piece]
            band = widen_at_ends(band_of(fine, *where), fine, *where)
        evaluated = band.evaluated & self.usable
        at = coarse.time + _ROUNDED_TIME * self.tolerance
        last = np.maximum(np.searchsorted(self.original.time, at, side="right") - 1, 0)
        nearest = np.where(evaluated, np.clip(coarse.filled, band.low, band.high), self.original.values[last])
        error = np.where(evaluated, (nearest - coarse.values) if self.swap else (coarse.values - nearest), np.nan)
        one, two = (coarse.values, nearest) if self.swap else (nearest, coarse.values)
        return Points(coarse.time, error, one, two, evaluated, self.no_number)


def _view(reference: Curve, result: Curve, tolerance: float) -> _View:
    swap = instants_within(result.time, reference.time) > instants_within(reference.time, result.time)
    original, coarse = (result, reference) if swap else (reference, result)
    no_number, usable = _numbers(original, coarse, tolerance)
    fine = original
    if fine.held and not _equal_rows(fine.time, coarse.time, tolerance):
        fine = project(fine, coarse, tolerance)  # what happens between two rows of the coarser one cannot be seen in it
    return _View(fine, coarse, original, swap, usable, no_number, tolerance)


def _equal_rows(one: np.ndarray, two: np.ndarray, tolerance: float) -> bool:
    """Whether two sides have the same rows, but for digits of the times that a baseline does not keep."""
    return len(one) == len(two) and bool(np.all(np.abs(one - two) <= _ROUNDED_TIME * tolerance))


def instants_within(time: np.ndarray, other: np.ndarray) -> int:
    """Number of instants of one side between begin and end of the other.

    Args:
        time, other: of the rows of the sides [s], never falling.
    """
    first, last = np.searchsorted(time, other[0]), np.searchsorted(time, other[-1], side="right")
    inside = time[first:last]
    return int(np.count_nonzero(np.diff(inside))) + bool(len(inside))


def _matched(one: Jumps, two: Jumps, allowed: Allowed, window: float) -> MatchedJumps:
    first, second = match_jumps(one, two, window=window, allowed=allowed.value, scale=allowed.scale)
    pairs = choose(one, first), choose(two, second)
    alone = [np.delete(np.arange(len(jumps)), which) for jumps, which in ((one, first), (two, second))]
    return MatchedJumps(*pairs, shifts(*pairs), choose(one, alone[0]), choose(two, alone[1]))


def _some(jumps: MatchedJumps, which: np.ndarray) -> MatchedJumps:
    pairs = choose(jumps.reference, which), choose(jumps.result, which)
    return MatchedJumps(*pairs, jumps.shift[which], jumps.missing, jumps.extra)


def _outside_near(uncut: Points, jumps: MatchedJumps, allowed: Allowed) -> np.ndarray:
    one, two = jumps.reference, jumps.result
    return outside_between(uncut, allowed, np.minimum(one.begin, two.begin), np.maximum(one.end, two.end))


def _count_outside(points: Points, allowed: Allowed) -> int:
    return int(np.count_nonzero(points.evaluated & (np.abs(points.error) > allowed.value)))


def _is_patchwork(jumps: MatchedJumps, apart: np.ndarray, allowed: float, explains: bool) -> bool:
    """Whether many jumps would be at other instants, but not as a delay does it.

    A delay explains most points outside the tube, leaves hardly a jump alone, and has the same values before and after
    them.
    """
    count = int(np.count_nonzero(apart))
    if len(apart) < MANY or not explains or count < MANY:
        return len(apart) >= MANY and not explains
    one, two = choose(jumps.reference, apart), choose(jumps.result, apart)
    alike = (np.abs(one.before - two.before) <= allowed) & (np.abs(one.after - two.after) <= allowed)
    alone = len(jumps.missing) + len(jumps.extra)
    return alone > count // 10 or 2 * int(np.count_nonzero(alike)) < count


def _from_event(fine: Curve, coarse: Curve, tolerance: float, first: np.ndarray, last: np.ndarray) -> np.ndarray:
    """First row of the finer curve that explains each point, shape (points,), within its piece first <= row < last.

    In the row after an event of both sides, what was before it is over: not even a result that is late by the allowed
    time still shows it, unless it has another row within that time.
    """
    at, rows = coarse.time, np.flatnonzero(np.append(False, np.diff(coarse.time) == 0.0))
    following = np.append(at, np.inf)[rows + 1]
    found = np.searchsorted(fine.time, at[rows] + EQUAL_INSTANT * (1.0 + np.abs(at[rows])), side="right") - 1
    event = (found > 0) & (fine.time[found] == fine.time[found - 1]) & (following > at[rows] + tolerance)
    event &= np.abs(fine.time[found] - at[rows]) <= EQUAL_INSTANT * (1.0 + np.abs(at[rows]))
    event &= (found >= first[rows]) & (found < last[rows])
    begin = first.copy()
    begin[rows[event]] = found[event]
    return begin


def _numbers(fine: Curve, coarse: Curve, tolerance: float) -> tuple[np.ndarray, np.ndarray]:
    """Coarse rows where one side holds a number and the other none, and rows where both hold one."""
    within = (coarse.time >= fine.time[0] - tolerance) & (coarse.time <= fine.time[-1] + tolerance)
    if fine.finite.all() and coarse.finite.all():
        return np.zeros(len(within), dtype=bool), within
    a = np.searchsorted(fine.time, coarse.time - tolerance)
    b = np.searchsorted(fine.time, coarse.time + tolerance, side="right")
    between = a >= b  # no fine row at this instant: the two around it
    a = np.clip(np.where(between, a - 1, a), 0, len(fine.time) - 1)
    b = np.clip(np.where(between, b + 1, b), a + 1, len(fine.time))
    a, b = _sides_of_events(fine.time, coarse.time, a, b)
    has = [np.append(0, np.cumsum(kind)) for kind in _kinds(fine)]
    present = [count[b] > count[a] for count in has]
    agrees = np.logical_or.reduce([mine & there for mine, there in zip(_kinds(coarse), present, strict=True)])
    mixed = between & np.logical_or.reduce(present[1:])  # half a step next to a row without a number: cannot be judged
    return within & ~agrees & ~(mixed & present[0]), within & coarse.finite & present[0] & ~mixed


def _sides_of_events(
    fine: np.ndarray, coarse: np.ndarray, a: np.ndarray, b: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Ranges of fine rows [a, b), where both sides have two rows of an event only the one on the same side of it."""
    equal = np.diff(coarse) == 0.0
    last = np.minimum(b, len(fine)) - 1
    event = (b - a == 2) & (fine[a] == fine[last])
    return np.where(event & np.append(False, equal), last, a), np.where(event & np.append(equal, False), last, b)


def _kinds(curve: Curve) -> list[np.ndarray]:
    values = curve.values
    return [curve.finite, np.isnan(values), values == np.inf, values == -np.inf]
