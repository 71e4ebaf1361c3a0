"""What a reference does between two rows of a result that has fewer: nobody sees whether the result did. NumPy only."""

from __future__ import annotations

import numpy as np

from cosim.comparison.curve import BESIDE, Curve
from cosim.comparison.jumps import NEIGHBOURS
from cosim.comparison.tube import band_of


def unseen(reference: Curve, result: Curve, tolerance: float) -> np.ndarray:
    """How far each row of the reference is from all that the rows of the result around it say.

    Between two rows a held signal is expected between their values; any other on the straight line between them, but
    for as much as the result bends nearby: the largest change of its slope times the step. That is four times what a
    smooth curve does between rows, and bounds a kink or a jump there.

    Args:
        reference: with more rows. result: with fewer. tolerance: allowed shift [s].

    Returns:
        Distances [unit], zero at rows of the result and where one side has no number, shape (rows of the reference,).
    """
    time, at = result.time, reference.time
    after = np.clip(np.searchsorted(time, at, side="right"), 1, max(len(time) - 1, 1))
    if len(time) < 2:
        return np.zeros(len(at))
    reach = tolerance + BESIDE * (time[after] - time[after - 1])
    inside = (at > time[after - 1] + reach) & (at < time[after] - reach)
    equal = np.diff(at) == 0.0  # jumps are matched, not held against lines
    inside &= (
        ~np.append(equal, False)
        & ~np.append(False, equal)
        & reference.finite
        & result.finite[after - 1]
        & result.finite[after]
    )
    if result.held:
        ends = result.filled[after - 1], result.filled[after]
        low, high = np.minimum(*ends), np.maximum(*ends)
    else:
        band, bend = band_of(result, at, tolerance), _bends(result)[after - 1]
        low, high = band.low - bend, band.high + bend
    off = np.maximum(reference.filled - high, low - reference.filled)
    return np.where(inside, np.maximum(0.0, off), 0.0)


def _bends(curve: Curve) -> np.ndarray:
    """Between each two rows of a curve how far it bends there and nearby [unit], shape (rows - 1,)."""
    duration = np.diff(curve.time)
    rows = np.flatnonzero(duration > 0.0)
    slope = np.diff(curve.filled)[rows] / duration[rows]
    bend = np.pad(np.abs(np.diff(slope)), NEIGHBOURS)
    nearby = [bend[k : k + len(rows)] for k in range(2 * NEIGHBOURS)] if len(rows) else [slope]
    found = np.zeros(len(duration))
    found[rows] = np.maximum.reduce(nearby) * duration[rows]
    return found
