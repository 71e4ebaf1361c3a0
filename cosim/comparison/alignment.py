"""Which jumps of two curves belong to each other: pairs in order, with the least sum of costs. NumPy only."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from cosim.comparison.jumps import Jumps, choose, shifts

_UNMATCHED = 0.9  # cost of a jump that stays alone; a pair costs up to 2.5
_UNLIKE = 0.3  # cost of a pair whose values are not within the tolerance, at least
_LARGEST_BAND = 64  # jumps to either side that are looked at

_ROWS_OF_COSTS = 64
"""Jumps whose costs stand in memory at once."""

_IN_BYTE = 4
"""Moves in a byte."""
_SHIFTS = np.array([0, 2, 4, 6], dtype=np.uint8)

_Packed = np.ndarray
_Costs = Callable[[Jumps, np.ndarray], np.ndarray]
_Pairs = tuple[np.ndarray, np.ndarray]
"""Index into the jumps of the reference, and of the result, both rising."""


def match_jumps(reference: Jumps, result: Jumps, *, window: float, allowed: float, scale: float) -> _Pairs:
    """Pairs of jumps, in order, with the least sum of costs.

    A pair costs its shift as a share of the window, and where the values before or after differ by more than allowed
    something for that, by how much height and values differ. So a whole row of samples that is late is matched as late,
    and a row of samples that are each a little wrong as wrong.

    Args:
        reference, result: the jumps. window: largest shift that is looked at [s]. allowed: difference in value [unit].
        scale: range of the signal [unit].
    """
    equal, short = _equal_in_place(reference, result, allowed), min(len(reference), len(result))
    head = int(np.argmin(np.append(equal, False)))
    back = _equal_in_place(_last(reference, short - head), _last(result, short - head), allowed)[::-1]
    tail = int(np.argmin(np.append(back, False)))
    inner_a = choose(reference, np.arange(head, len(reference) - tail))
    inner_b = choose(result, np.arange(head, len(result) - tail))
    first, second = _align(inner_a, inner_b, window, allowed, scale)
    ends = np.arange(tail)
    return (
        np.concatenate([np.arange(head), head + first, len(reference) - tail + ends]),
        np.concatenate([np.arange(head), head + second, len(result) - tail + ends]),
    )


def _last(jumps: Jumps, count: int) -> Jumps:
    return choose(jumps, np.arange(len(jumps) - count, len(jumps)))


def _equal_in_place(a: Jumps, b: Jumps, allowed: float) -> np.ndarray:
    """Whether the k-th jumps are at the same instant with values within the tolerance."""
    n = min(len(a), len(b))
    a, b = choose(a, np.arange(n)), choose(b, np.arange(n))
    alike = (np.abs(a.before - b.before) <= allowed) & (np.abs(a.after - b.after) <= allowed)
    return np.asarray(alike & (np.abs(shifts(a, b)) <= 1e-9 * (1.0 + np.abs(a.end))))


def _align(a: Jumps, b: Jumps, window: float, allowed: float, scale: float) -> _Pairs:
    if not len(a) or not len(b):
        return np.zeros(0, dtype=int), np.zeros(0, dtype=int)
    first, last = np.searchsorted(b.end, a.begin - window), np.searchsorted(b.begin, a.end + window, side="right")
    band = int(min(max(np.max(last - first), 1), _LARGEST_BAND))
    centre = np.searchsorted(b.end, a.end)
    costs = partial(_costs, b=b, band=band, window=window, allowed=allowed, scale=scale)
    return _trace(_moves(a, costs, centre, band, len(b)), centre, band, len(b))


def _costs(
    a: Jumps, centre: np.ndarray, *, b: Jumps, band: int, window: float, allowed: float, scale: float
) -> np.ndarray:
    """Cost of the pairs (i, centre[i] - band - 1 + c), shape (len(a), 2 band + 2); infinite where there is no such
    pair.
    """
    other = centre[:, None] + np.arange(-band - 1, band + 1)
    there = (other >= 0) & (other < len(b))
    rows, columns = np.nonzero(there)
    one, two = choose(a, rows), choose(b, other[there])
    shift = np.abs(shifts(one, two))
    before, after = np.abs(one.before - two.before), np.abs(one.after - two.after)
    height = np.maximum(np.maximum(np.abs(one.size), np.abs(two.size)), np.finfo(float).tiny)
    unlike = _UNLIKE + 0.7 * np.minimum(np.abs(one.size - two.size) / height, 1.0)
    unlike += np.minimum(0.25 * (before + after) / max(scale, np.finfo(float).tiny), 0.5)
    pair = shift / window + np.where((before <= allowed) & (after <= allowed), 0.0, unlike)
    cost = np.full(other.shape, np.inf)
    cost[rows, columns] = np.where(shift <= window, pair, np.inf)
    return cost


def _moves(
    a: Jumps, costs: Callable[[Jumps, np.ndarray], np.ndarray], centre: np.ndarray, band: int, n: int
) -> _Packed:
    """Best last move to every cell: 0 skip one of the reference, 1 pair, 2 skip one of the result.

    Cell (i, c) stands for i + 1 jumps of the reference and centre[i] - band + c of the result being done with.
    Costs are made for some rows at a time, and moves are kept four in a byte: a run may jump at every row.
    """
    width = 2 * band + 2
    skips = _UNMATCHED * np.arange(width + 2)
    steps = skips[:width]
    packed = np.empty((len(a), -(-width // _IN_BYTE)), dtype=np.uint8)
    previous, at = steps, 0
    for first in range(0, len(a), _ROWS_OF_COSTS):
        part = slice(first, first + _ROWS_OF_COSTS)
        cost = costs(choose(a, part), centre[part])
        moves = np.zeros((len(cost), _IN_BYTE * packed.shape[1]), dtype=np.uint8)
        for i, start in enumerate((centre[part] - band).tolist()):  # of the result done with at the first cell
            before = _read(previous, start - at, skips)
            skip, pair = before[1:] + _UNMATCHED, before[:-1] + cost[i]
            best = np.minimum(skip, pair)
            row = np.minimum.accumulate(best - steps) + steps
            if start < 0 or start + width - 1 > n:
                counts = start + np.arange(width)
                row[(counts < 0) | (counts > n)] = np.inf
            moves[i, :width] = np.where(row < best - 1e-9, 2, pair <= skip)
            previous, at = row, start
        packed[part] = np.bitwise_or.reduce(moves.reshape(len(moves), -1, _IN_BYTE) << _SHIFTS, axis=2)
    return packed


def _read(row: np.ndarray, shift: int, skips: np.ndarray) -> np.ndarray:
    """The cells shift - 1, shift, ... of a row, one more than it has: infinite before its begin, beyond its end all are
    skips.
    """
    width = len(row)
    if shift <= 0:
        return np.concatenate([np.full(1 - shift, np.inf), row])[: width + 1]
    inside = row[shift - 1 :]
    beyond = row[-1] + _UNMATCHED * max(shift - width - 1, 0) + skips[1 : width + 2 - len(inside)]
    return np.concatenate([inside, beyond])


def _trace(packed: _Packed, centre: np.ndarray, band: int, n: int) -> _Pairs:
    pairs = np.empty((2, min(len(packed), n)), dtype=np.intp)
    i, j, left = len(packed) - 1, n, pairs.shape[1]  # j: jumps of the result done with; pairs are filled from the end
    while i >= 0 and j >= 0:
        cell = j - int(centre[i] - band)
        move = 2 if cell > 2 * band + 1 else 0
        if 0 <= cell <= 2 * band + 1:
            move = int(packed[i, cell // _IN_BYTE]) >> 2 * (cell % _IN_BYTE) & 3
        if move == 1:
            left -= 1
            pairs[:, left] = i, j - 1
        i, j = i - (move != 2), j - (move != 0)
    return pairs[0, left:], pairs[1, left:]
