"""The comparison of one signal: curves in, verdict out. Knows no results and no files."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cosim.comparison.curve import Curve
from cosim.comparison.points import Allowed, MatchedJumps, Points, compare_points
from cosim.comparison.signal_findings import jump_findings, number_findings, value_findings
from cosim.comparison.span import gap_findings, rounding, span_findings
from cosim.comparison.tolerance import Tolerance
from cosim.comparison.tube import band_of
from cosim.comparison.verdict import ComparisonFinding, Curves, SignalComparison

WORST = 5  # points that are kept
_WINDOW_STEPS, _WINDOW_SHARE, _WINDOW_TOLERANCES = 20.0, 0.01, 10.0  # how far off a jump is looked for


@dataclass(frozen=True)
class Task:
    """What is to be compared.

    Args:
        name: of the signal. unit: of both curves. reference, result: the curves. tolerance: for this signal.
        length: of the reference [s]. curves: whether to keep what pictures need.
    """

    name: str
    unit: str
    reference: Curve
    result: Curve
    tolerance: Tolerance
    length: float
    curves: bool = True


def compare_signal(task: Task) -> SignalComparison:
    """Compare one signal with its reference.

    Args:
        task: the signal with its reference and what is allowed.
    """
    allowed = _allowed_for(task)
    if _same(task.reference, task.result):
        return _equal(task, allowed)
    points, jumps = compare_points(task.reference, task.result, allowed)
    findings = _findings(task, points, jumps, allowed)
    judged = np.flatnonzero(points.judged)
    size = np.abs(points.error[judged])
    at = int(judged[np.argmax(size)]) if len(judged) else None
    return SignalComparison(
        task.name,
        task.unit,
        "differs" if findings else "within",
        task.tolerance,
        allowed.value,
        allowed.time,
        max_error=float(np.max(size)) if len(size) else float("nan"),
        max_error_at=float("nan") if at is None else float(points.time[at]),
        max_shift=float(np.max(np.abs(jumps.shift), initial=0.0)),
        rms_error=_rms(points, judged),
        share_outside=float(np.mean(size > allowed.value)) if len(size) else 0.0,
        worst=_worst(points, findings, at),
        findings=findings,
        curves=_curves(task, points, jumps, allowed) if task.curves else None,
    )


def _allowed_for(task: Task) -> Allowed:
    """What the tolerance means for this reference.

    Args:
        task: the signal with its reference and what is allowed.
    """
    scale = task.reference.scale
    time = task.tolerance.time_for(task.length)
    step = max(task.reference.step, task.result.step)
    window = max(_WINDOW_TOLERANCES * time, _WINDOW_STEPS * step, _WINDOW_SHARE * task.length, 1e-9)
    slack = rounding(task.reference.time[0], task.reference.time[-1]) if time > 0.0 else 0.0
    return Allowed(task.tolerance.value_for(scale), time + slack, scale, window)


def _same(one: Curve, two: Curve) -> bool:
    return np.array_equal(one.time, two.time) and np.array_equal(one.values, two.values, equal_nan=True)


def _equal(task: Task, allowed: Allowed) -> SignalComparison:
    reference = task.reference
    numbers = bool(reference.finite.any())
    curves = None
    if task.curves and numbers:
        error = np.where(reference.finite, 0.0, np.nan)
        low, high = reference.filled - allowed.value, reference.filled + allowed.value
        time, values = reference.time, reference.values
        curves = Curves(time, values, time, values, time, low, high, time, error, allowed.value)
    return SignalComparison(
        task.name,
        task.unit,
        "equal",
        task.tolerance,
        allowed.value,
        allowed.time,
        max_error=0.0 if numbers else float("nan"),
        max_error_at=float(reference.time[0]),
        rms_error=0.0 if numbers else float("nan"),
        curves=curves,
    )


def _findings(task: Task, points: Points, jumps: MatchedJumps, allowed: Allowed) -> list[ComparisonFinding]:
    found = span_findings(task.name, task.reference, task.result, allowed.time)
    found += number_findings(task.name, points)
    found += jump_findings(task.name, task.unit, points, jumps, allowed)
    found += value_findings(task.name, task.unit, points, allowed)
    found += gap_findings(task.name, task.reference, task.result, allowed.value, allowed.time)
    return sorted(found, key=lambda f: (-f.size / f.allowed if f.allowed > 0.0 else -np.inf, f.time))


def _rms(points: Points, judged: np.ndarray) -> float:
    """Time-weighted: the error of a point counts for half the way to the points before and after it."""
    if not len(judged):
        return float("nan")
    largest = float(np.max(np.abs(points.error[judged])))
    if largest == 0.0 or not np.isfinite(largest):
        return largest
    square = (points.error[judged] / largest) ** 2  # scaled, so that a diverged signal does not overflow
    duration = np.diff(points.time[judged])
    total = float(np.sum(duration))
    if total == 0.0:
        return largest * float(np.sqrt(np.mean(square)))
    return largest * float(np.sqrt(np.sum(0.5 * (square[1:] + square[:-1]) * duration) / total))


def _worst(
    points: Points, findings: list[ComparisonFinding], at: int | None
) -> list[tuple[float, float, float, float]]:
    """The worst point of each run of points outside, or the worst of all where none is."""
    if at is None:
        return []
    rows = [at]
    for finding in (f for f in findings if f.kind == "value"):
        inside = np.flatnonzero((points.time >= finding.time) & (points.time <= finding.end) & points.judged)
        rows.append(int(inside[np.argmax(np.abs(points.error[inside]))]))
    rows = list(dict.fromkeys(rows))[:WORST]
    columns = (points.time, points.reference, points.result, points.error)
    return [(float(t), float(a), float(b), float(e)) for t, a, b, e in zip(*(c[rows] for c in columns), strict=True)]


def _curves(task: Task, points: Points, jumps: MatchedJumps, allowed: Allowed) -> Curves | None:
    """Curves for pictures: the tube is drawn around the reference, whichever side is the finer one."""
    reference, result = task.reference, task.result
    if not reference.finite.any() or not result.finite.any():
        return None
    cuts = jumps.reference.row if _is_whole(reference, jumps) else np.zeros(0, dtype=int)
    starts, ends = np.append(0, cuts + 1), np.append(cuts + 1, len(reference.time))
    piece = np.searchsorted(cuts, np.arange(len(reference.time)))
    band = band_of(reference, reference.time, allowed.time, starts[piece], ends[piece])
    low, high, time = band.low - allowed.value, band.high + allowed.value, reference.time
    if len(cuts):  # a row without numbers between pieces, where lines break
        low, high = (np.insert(line, cuts + 1, np.nan) for line in (low, high))
        time = np.insert(time, cuts + 1, reference.time[cuts + 1])
    return Curves(
        reference.time,
        reference.values,
        result.time,
        result.values,
        time,
        low,
        high,
        points.time,
        points.error,
        allowed.value,
    )


def _is_whole(reference: Curve, jumps: MatchedJumps) -> bool:
    """Whether the rows of the jumps are those of the reference itself, not those of its projection onto a coarser
    curve.
    """
    rows = jumps.reference.row
    return not len(rows) or (
        int(rows[-1]) + 1 < len(reference.time) and np.array_equal(reference.time[rows], jumps.reference.begin)
    )
