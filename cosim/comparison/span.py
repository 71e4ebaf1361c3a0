"""Where the rows of two results begin, end and leave out something: nobody sees what the result does there. NumPy only;
texts come from here too.
"""

from __future__ import annotations

import numpy as np

from cosim.comparison.curve import BESIDE, Curve
from cosim.comparison.jumps import NEIGHBOURS
from cosim.comparison.points import Allowed
from cosim.comparison.tube import band_of
from cosim.comparison.verdict import ComparisonFinding, Kind
from cosim.results.shown_unit import ShownUnit

_MOST_RUNS = (
    20  # runs of points outside the tube that are reported one by one; more of them are joined over the gaps between
)


def rounding(*times: float) -> float:
    """How much two instants may differ by rounding alone [s].

    Args:
        times: instants [s].
    """
    return 8.0 * float(np.finfo(float).eps) * max(abs(time) for time in times)


def runs(marked: np.ndarray) -> list[tuple[int, int]]:
    """Runs [a, b) of marked entries; where there are many, joined over the smallest gaps.

    Args:
        marked: which entries are, shape (n,).
    """
    rows = np.flatnonzero(marked)
    if not len(rows):
        return []
    gaps = np.diff(rows)
    widest = 1 if len(gaps) < _MOST_RUNS else max(1, int(np.partition(gaps, -_MOST_RUNS)[-_MOST_RUNS]))
    cuts = np.flatnonzero(gaps > widest) + 1
    return [(int(part[0]), int(part[-1]) + 1) for part in np.split(rows, cuts)]


def when(begin: float, end: float) -> str:
    """An instant or a time span as people read it.

    Args:
        begin, end: [s].
    """
    return f"at {begin:.9g} s" if begin == end else f"from {begin:.9g} to {end:.9g} s"


def row_findings(
    name: str, unit: ShownUnit, reference: Curve, result: Curve, allowed: Allowed
) -> list[ComparisonFinding]:
    """Other begins and ends, gaps, and what the reference does between two rows of the result.

    Args:
        name: of the signal. unit: in which it is shown. reference, result: the curves.
        allowed: difference that is allowed.
    """
    found = _span_findings(name, reference, result, allowed.time)
    gaps = _gap_findings(name, reference, result, allowed.value, allowed.time)
    return [*found, *gaps, *_unseen_findings(name, unit, (reference, result), allowed, gaps)]


def _span_findings(name: str, reference: Curve, result: Curve, allowed: float) -> list[ComparisonFinding]:
    """Starts and ends that are further apart than the allowed time [s]."""
    found = []
    ends: tuple[tuple[float, float, Kind, Kind, str], ...] = (
        (float(reference.time[0]), float(result.time[0]), "starts_early", "starts_late", "starts"),
        (float(reference.time[-1]), float(result.time[-1]), "ends_early", "ends_late", "ends"),
    )
    for one, two, early, late, verb in ends:
        size = abs(two - one)
        if size > allowed + rounding(one, two):
            text = (
                f"{name}: {verb} at {two:.9g} s instead of {one:.9g} s, {size:.4g} s "
                f"{'later' if two > one else 'earlier'}"
            )
            found.append(
                ComparisonFinding(
                    late if two > one else early, min(one, two), max(one, two), one, two, size, allowed, text
                )
            )
    return found


_GAP_STEPS = 10  # usual steps without a row make a gap, where the other has at least so many rows


def _gap_findings(
    name: str, reference: Curve, result: Curve, allowed: float, allowed_time: float
) -> list[ComparisonFinding]:
    """Intervals in which one side has no rows where the other has many that are not on the straight line over the
    gap.

    Args:
        name: name of the signal.
        reference: curve of the reference.
        result: curve of the result.
        allowed: error that is allowed.
        allowed_time: shift that is allowed [s].
    """
    found = []
    for lacking, full, who in ((reference, result, "reference"), (result, reference, "result")):
        for row in _gaps(lacking, full):
            begin, end = float(lacking.time[row]), float(lacking.time[row + 1])
            a, b = np.searchsorted(full.time, begin, side="right"), np.searchsorted(full.time, end)
            band = band_of(lacking, full.time[a:b], allowed_time)
            values = full.filled[a:b]
            off = float(np.max(np.maximum(values - band.high, band.low - values)))
            if off > allowed:
                text = f"{name}: the {who} has no rows from {begin:.9g} to {end:.9g} s, the other has {b - a} there"
                found.append(
                    ComparisonFinding("gap", begin, end, np.nan, np.nan, end - begin, _GAP_STEPS * lacking.step, text)
                )
    return found


def _unseen_findings(
    name: str, unit: ShownUnit, sides: tuple[Curve, Curve], allowed: Allowed, known: list[ComparisonFinding]
) -> list[ComparisonFinding]:
    """Where the reference moves between two rows of the result, beyond the gaps that are known.

    Args:
        name: of the signal. unit: in which it is shown. sides: reference and result.
        allowed: difference that is allowed. known: the gaps.
    """
    reference = sides[0]
    off = _unseen(*sides, allowed.time)
    for gap in known:
        off[(reference.time > gap.time) & (reference.time < gap.end)] = 0.0
    found = []
    for a, b in runs(off > allowed.value):
        worst = a + int(np.argmax(off[a:b]))
        begin, end, at = (float(reference.time[row]) for row in (a, b - 1, worst))
        size, limit = map(unit.difference_text, (float(off[worst]), allowed.value))
        amount = f"by {size}" if begin == end else f"at worst by {size} at {at:.9g} s"
        what = f"the reference moves between two rows of the result, {amount} (allowed {limit})"
        text = f"{name}: {when(begin, end)} {what}; too few rows to be compared"
        found.append(ComparisonFinding("gap", begin, end, np.nan, np.nan, float(off[worst]), allowed.value, text, at))
    return found


def _gaps(lacking: Curve, full: Curve) -> np.ndarray:
    rows = np.flatnonzero(np.diff(lacking.time) > _GAP_STEPS * lacking.step)
    if not len(rows):
        return rows
    begin = np.searchsorted(full.time, lacking.time[rows], side="right")
    return np.asarray(rows[np.searchsorted(full.time, lacking.time[rows + 1]) - begin >= _GAP_STEPS])


def _unseen(reference: Curve, result: Curve, tolerance: float) -> np.ndarray:
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
