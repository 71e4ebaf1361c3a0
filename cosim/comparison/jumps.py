"""Where a curve jumps: event rows, changes of held signals, and samples that change far more than their neighbours."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from cosim.comparison.curve import Curve

NEIGHBOURS = 4  # steps on either side that a step is held against
_FAR_LARGER = 10.0  # times the steepest of them; an exponential must fall to a tenth in one sample to look like a jump
SMALLEST = 1e-6  # of the range: rounding is no jump
EQUAL_INSTANT = 1e-9  # of the time: how far rounding, also that of a file, moves an instant


@dataclass(frozen=True)
class Jumps:
    """Jumps of one curve in order of time; all arrays have the shape (jumps,).

    Args:
        row: last row before the jump; the next one is after it.
        begin, end: time of these rows [s]: the same for an event row; else the jump lies between them.
        before, after: values [unit].
        after_event: whether the row before the jump is itself the one after an event.
    """

    row: np.ndarray
    begin: np.ndarray
    end: np.ndarray
    before: np.ndarray
    after: np.ndarray
    after_event: np.ndarray

    def __len__(self) -> int:
        return len(self.row)

    @property
    def size(self) -> np.ndarray:
        """Signed height [unit]."""
        return np.asarray(self.after - self.before)


def find_jumps(curve: Curve, allowed: float) -> Jumps:
    """The jumps of a curve that are larger than the allowed difference in value.

    A jump is (a) a change between two rows with the same time, (b) any change of a held signal, (c) in other signals a
    change within one sample that is steeper than ten times the steepest of four samples before it and four after it.
    Ramps, sampled exponentials and noise are not: there a neighbour is about as steep.

    Args:
        curve: the signal. allowed: smaller changes are none [unit].
    """
    time, values = curve.time, curve.values
    if len(time) < 2:
        return _at(curve, np.zeros(0, dtype=int))
    change, duration = np.abs(np.diff(values)), np.diff(time)
    change = np.where(curve.finite[1:] & curve.finite[:-1], change, 0.0)
    large = change > max(allowed, 0.0 if curve.held else SMALLEST * curve.scale)
    if not curve.held and large.any():
        large &= (duration == 0.0) | _stands_out(change, duration)
    return _at(curve, np.flatnonzero(large))


def shifts(reference: Jumps, result: Jumps) -> np.ndarray:
    """How much later the jumps of the result are, pair by pair [s], shape (jumps,).

    A jump between two samples may be anywhere between them, so the shift is the smallest that brings the shorter of the
    two intervals into the longer. On equal grids that is the distance of the samples; on others it is never overstated.
    One side that jumps at an event while the other is still unchanged in the row after that event is earlier, by that
    side's sample.

    Args:
        reference: jumps of the reference that have a partner.
        result: their partners in the result.
    """
    first, last = result.begin - reference.begin, result.end - reference.end
    smaller = np.where(np.abs(first) < np.abs(last), first, last)
    together = np.abs(first) <= EQUAL_INSTANT * (1.0 + np.abs(reference.begin))
    late = result.after_event & (reference.begin == reference.end)
    early = reference.after_event & (result.begin == result.end)
    return np.where(together & (late | early), last, np.where(first * last > 0.0, smaller, 0.0))


def choose(jumps: Jumps, which: np.ndarray | slice) -> Jumps:
    """Some of the jumps.

    Args:
        jumps: all of them.
        which: indices of those to take, shape (n,), or a slice.
    """
    return Jumps(*(getattr(jumps, field.name)[which] for field in fields(Jumps)))


def _at(curve: Curve, row: np.ndarray) -> Jumps:
    after_event = np.append(False, np.diff(curve.time) == 0.0)[row]
    return Jumps(row, curve.time[row], curve.time[row + 1], curve.values[row], curve.values[row + 1], after_event)


def _stands_out(change: np.ndarray, duration: np.ndarray) -> np.ndarray:
    slope = np.divide(change, duration, out=np.zeros_like(change), where=duration > 0.0)
    if len(slope) < NEIGHBOURS:
        return np.zeros(len(slope), dtype=bool)
    padded, steepest = np.pad(slope, NEIGHBOURS), np.zeros(len(slope))
    for k in (k for k in range(-NEIGHBOURS, NEIGHBOURS + 1) if k):
        np.maximum(steepest, padded[NEIGHBOURS + k :][: len(slope)], out=steepest)
    return np.asarray((duration > 0.0) & (change > _FAR_LARGER * steepest * duration))
