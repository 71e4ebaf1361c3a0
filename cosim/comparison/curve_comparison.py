"""The comparison of one signal: curves in, verdict out. Knows no results and no files."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cosim.comparison.curve import Curve
from cosim.comparison.jumps import Jumps
from cosim.comparison.points import Allowed, MatchedJumps, Points, compare_points, outside_between
from cosim.comparison.span import rounding, row_findings, runs, when
from cosim.comparison.tolerance import Tolerance
from cosim.comparison.tube import band_of
from cosim.comparison.verdict import ComparisonFinding, Curves, Kind, SignalComparison
from cosim.results.shown_unit import ShownUnit

_FEW_ROWS = 0.01
"""Share of the rows, on either hand, that are few."""
_SMALL, _ROUNDED = 0.01, 1e-3
"""Differences that are not worth a remark: a share of the standard deviation, and of the tolerance, which a baseline
rounds to half of that."""
_LEAST_SPREAD = 1e-9
"""Of the range: a standard deviation that is more than rounding."""
WORST = 5  # points that are kept
_WINDOW_STEPS, _WINDOW_SHARE, _WINDOW_TOLERANCES = 20.0, 0.01, 10.0  # how far off a jump is looked for


def _value_findings(name: str, unit: ShownUnit, points: Points, allowed: Allowed) -> list[ComparisonFinding]:
    """Runs of points outside the tube, each with its worst point."""
    rows = np.flatnonzero(points.evaluated)
    size = np.abs(points.error[rows])
    found = []
    for a, b in runs(size > allowed.value):
        inside = slice(a, b)
        worst = rows[inside][int(np.argmax(size[inside]))]
        count = int(np.count_nonzero(size[inside] > allowed.value))
        found.append(_value_finding(name, unit, points, (int(rows[a]), int(rows[b - 1])), int(worst), count, allowed))
    return found


def _number_findings(name: str, points: Points) -> list[ComparisonFinding]:
    """Runs of points where one side holds a number and the other none."""
    found = []
    for a, b in runs(points.no_number):
        begin, end = float(points.time[a]), float(points.time[b - 1])
        values = float(points.reference[a]), float(points.result[a])
        size = float(np.count_nonzero(points.no_number[a:b]))
        text = f"{name}: {when(begin, end)} {_kind_of_number(points, a)} ({size:.0f} points)"
        found.append(ComparisonFinding("nan", begin, end, *values, size, 0.0, text))
    return found


def _jump_findings(
    name: str, unit: ShownUnit, points: Points, jumps: MatchedJumps, allowed: Allowed
) -> list[ComparisonFinding]:
    """Jumps that are early or late, and jumps that one side has alone and that the values confirm."""
    found = _shift_findings(name, unit, jumps, allowed)
    found += _lone_findings(name, unit, "jump_missing", jumps.missing, points, allowed)
    found += _lone_findings(name, unit, "jump_extra", jumps.extra, points, allowed)
    return found


def _value_finding(
    name: str, unit: ShownUnit, points: Points, ends: tuple[int, int], worst: int, count: int, allowed: Allowed
) -> ComparisonFinding:
    begin, end, at = (float(points.time[row]) for row in (*ends, worst))
    error = float(points.error[worst])
    side = f"{unit.difference_text(abs(error))} too {'high' if error > 0.0 else 'low'}"
    limit = f"(allowed {unit.difference_text(allowed.value)})"
    where = f"outside the tube, {side} {limit}"
    if ends[1] > ends[0]:
        where = f"{count} points outside the tube, at worst {side} at {at:.9g} s {limit}"
    text = f"{name}: {when(begin, end)} {where}"
    return ComparisonFinding(
        "value",
        begin,
        end,
        float(points.reference[worst]),
        float(points.result[worst]),
        abs(error),
        allowed.value,
        text,
        at,
    )


def _shift_findings(name: str, unit: ShownUnit, jumps: MatchedJumps, allowed: Allowed) -> list[ComparisonFinding]:
    size = np.abs(jumps.shift)
    slack = rounding(*jumps.reference.end[-1:], *jumps.reference.begin[:1], 0.0)
    found = []
    for a, b in runs(size > allowed.time + slack):
        worst = a + int(np.argmax(size[a:b]))
        one, two = float(jumps.reference.end[worst]), float(jumps.result.end[worst])
        late = "late" if jumps.shift[worst] > 0.0 else "early"
        height = unit.difference_text(abs(float(jumps.reference.size[worst])))
        amount = f"{size[worst]:.4g} s {late} (allowed {allowed.time:.4g} s)"
        text = f"{name}: the jump of {height} at {one:.9g} s comes {amount}"
        if b - a > 1:
            span = when(float(jumps.reference.end[a]), float(jumps.reference.end[b - 1]))
            text = f"{name}: {span} {b - a} jumps at other instants, at worst {amount} at {one:.9g} s"
        last = float(max(jumps.reference.end[b - 1], jumps.result.end[b - 1]))
        begin = float(min(jumps.reference.end[a], jumps.result.end[a]))
        found.append(
            ComparisonFinding("jump_time", begin, last, one, two, float(size[worst]), allowed.time, text, min(one, two))
        )
    return found


def _lone_findings(
    name: str, unit: ShownUnit, kind: Kind, jumps: Jumps, points: Points, allowed: Allowed
) -> list[ComparisonFinding]:
    if not len(jumps):
        return []
    # One that is hardly larger than allowed may be a little smaller on the other side, and none there; one whose points
    # are within the tube is followed by the other side within its own rows.
    large = np.abs(jumps.size) > 2.0 * allowed.value
    confirmed = large & outside_between(points, allowed, jumps.begin, jumps.end)
    found = []
    for a, b in runs(confirmed):
        size = np.abs(jumps.size[a:b])
        worst = a + int(np.argmax(size))
        before, after = float(jumps.before[worst]), float(jumps.after[worst])
        whose = "missing" if kind == "jump_missing" else "only in the result"
        step = f"from {unit.text(before)} to {unit.text(after)} at {float(jumps.end[worst]):.9g} s"
        text = f"{name}: the jump {step} is {whose}"
        if b - a > 1:
            span = when(float(jumps.end[a]), float(jumps.end[b - 1]))
            text = f"{name}: {span} {b - a} jumps are {whose}, the largest {step}"
        values = (after, np.nan) if kind == "jump_missing" else (np.nan, after)
        begin, end, at = (float(jumps.end[row]) for row in (a, b - 1, worst))
        found.append(ComparisonFinding(kind, begin, end, *values, float(size[worst - a]), allowed.value, text, at))
    return found


def _kind_of_number(points: Points, row: int) -> str:
    one, two = float(points.reference[row]), float(points.result[row])
    if np.isnan(two) and not np.isnan(one):
        return "the result is not a number (NaN)"
    if np.isinf(two):
        return "the result is infinite"
    return "the reference is infinite" if np.isinf(one) else "the reference is not a number (NaN), the result is"


@dataclass(frozen=True)
class Task:
    """What is to be compared.

    Args:
        name: of the signal. unit: in which it is shown; the curves are kept in the one of SI. reference, result: the
        curves. tolerance: for this signal. allowed: difference in value that it allows. length: of the reference [s].
        curves: whether to keep what pictures need.
    """

    name: str
    unit: ShownUnit
    reference: Curve
    result: Curve
    tolerance: Tolerance
    allowed: float
    length: float
    curves: bool = True


def compare_signal(task: Task) -> SignalComparison:
    """Compare one signal with its reference.

    Args:
        task: the signal with its reference and what is allowed.
    """
    allowed = _allowed_for(task)
    if _equal_curves(task.reference, task.result):
        return _equal(task, allowed)
    points, jumps = compare_points(task.reference, task.result, allowed)
    findings = _findings(task, points, jumps, allowed)
    evaluated = np.flatnonzero(points.evaluated)
    size = np.abs(points.error[evaluated])
    at = int(evaluated[np.argmax(size)]) if len(evaluated) else None
    return SignalComparison(
        task.name,
        task.unit.kept,
        "differs" if findings else "within",
        task.tolerance,
        allowed.value,
        allowed.time,
        max_error=float(np.max(size)) if len(size) else float("nan"),
        max_error_at=float("nan") if at is None else float(points.time[at]),
        max_shift=float(np.max(np.abs(jumps.shift), initial=0.0)),
        rms_error=_rms(points, evaluated),
        share_outside=float(np.mean(size > allowed.value)) if len(size) else 0.0,
        worst=_worst(points, findings, at),
        findings=findings,
        curves=_curves(task, points, jumps, allowed) if task.curves else None,
        scale=allowed.scale,
        remark="" if findings else _without_numbers(task) or _remark(task, points, allowed),
        shown_in=task.unit,
    )


def _without_numbers(task: Task) -> str:
    """That there was nothing to compare, or that rows of the result between those of the reference hold no number."""
    missing = len(task.result.time) - int(np.count_nonzero(task.result.finite))
    if not task.reference.finite.any():
        return f"{task.name}: no row holds a number, so nothing was compared."
    if not missing or not task.reference.finite.all():
        return ""
    rows = f"{missing} of {len(task.result.time)} rows of the result"
    return f"{task.name}: {rows} hold no number, all of them between two rows of the reference."


def _remark(task: Task, points: Points, allowed: Allowed) -> str:
    """That the range is that of a few rows, and that the others differ by what counts for them."""
    values = task.reference.values[task.reference.finite]
    low, high = (float(value) for value in np.quantile(values, [_FEW_ROWS, 1.0 - _FEW_ROWS], method="nearest"))
    usual = values[(values >= low) & (values <= high)]
    spread, share = float(np.std(usual)), high - low
    if not _LEAST_SPREAD * allowed.scale < spread < allowed.value:
        return ""
    inside = points.evaluated & (points.reference >= low) & (points.reference <= high)
    error = float(np.max(np.abs(points.error[inside]), initial=0.0))
    if error <= max(_SMALL * spread, min(_ROUNDED * allowed.value, 0.5 * spread)):
        return ""
    far = int(np.count_nonzero((values < low - share) | (values > high + share)))
    rows = far or len(values) - len(usual)
    scale, rest, size, limit = map(task.unit.difference_text, (allowed.scale, share, error, allowed.value))
    return (
        f"{task.name}: {rows} of {len(values)} rows set its range of {scale}; the others have one of {rest} and differ "
        f"by up to {size}, which passes (allowed {limit}): state a tolerance for it."
    )


def _allowed_for(task: Task) -> Allowed:
    """What the tolerance means for this reference."""
    scale = task.reference.scale
    time = task.tolerance.time_for(task.length)
    step = max(task.reference.step, task.result.step)
    window = max(_WINDOW_TOLERANCES * time, _WINDOW_STEPS * step, _WINDOW_SHARE * task.length, 1e-9)
    slack = rounding(task.reference.time[0], task.reference.time[-1]) if time > 0.0 else 0.0
    return Allowed(task.allowed, time + slack, scale, window)


def _equal_curves(one: Curve, two: Curve) -> bool:
    return np.array_equal(one.time, two.time) and np.array_equal(one.values, two.values, equal_nan=True)


def _equal(task: Task, allowed: Allowed) -> SignalComparison:
    reference = task.reference
    numbers = bool(reference.finite.any())
    curves = None
    if task.curves and numbers:
        error = np.where(reference.finite, 0.0, np.nan)
        low, high = reference.filled - allowed.value, reference.filled + allowed.value
        time, values = reference.time, reference.values
        curves = Curves(time, values, time, values, time, low, high, time, error, allowed.value, reference.held)
    return SignalComparison(
        task.name,
        task.unit.kept,
        "equal",
        task.tolerance,
        allowed.value,
        allowed.time,
        max_error=0.0 if numbers else float("nan"),
        max_error_at=float(reference.time[0]),
        rms_error=0.0 if numbers else float("nan"),
        curves=curves,
        scale=allowed.scale,
        remark=_without_numbers(task),
        shown_in=task.unit,
    )


def _findings(task: Task, points: Points, jumps: MatchedJumps, allowed: Allowed) -> list[ComparisonFinding]:
    found = row_findings(task.name, task.unit, task.reference, task.result, allowed)
    found += _number_findings(task.name, points)
    found += _jump_findings(task.name, task.unit, points, jumps, allowed)
    found += _value_findings(task.name, task.unit, points, allowed)
    return sorted(found, key=lambda f: (-f.size / f.allowed if f.allowed > 0.0 else -np.inf, f.time))


def _rms(points: Points, evaluated: np.ndarray) -> float:
    """Time-weighted: the error of a point counts for half the way to the points before and after it."""
    if not len(evaluated):
        return float("nan")
    largest = float(np.max(np.abs(points.error[evaluated])))
    if largest == 0.0 or not np.isfinite(largest):
        return largest
    square = (points.error[evaluated] / largest) ** 2  # scaled, so that a diverged signal does not overflow
    duration = np.diff(points.time[evaluated])
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
        inside = np.flatnonzero((points.time >= finding.time) & (points.time <= finding.end) & points.evaluated)
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
        reference.held,
    )


def _is_whole(reference: Curve, jumps: MatchedJumps) -> bool:
    """Whether the rows of the jumps are those of the reference itself, not those of its projection onto a coarser
    curve.
    """
    rows = jumps.reference.row
    return not len(rows) or (
        int(rows[-1]) + 1 < len(reference.time) and np.array_equal(reference.time[rows], jumps.reference.begin)
    )
