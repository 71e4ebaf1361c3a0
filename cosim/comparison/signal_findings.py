"""From points and jumps to findings: neighbours merged into one, each with a line for people. NumPy only."""

from __future__ import annotations

import numpy as np

from cosim.comparison.jumps import Jumps
from cosim.comparison.points import Allowed, MatchedJumps, Points, outside_between
from cosim.comparison.span import rounding
from cosim.comparison.verdict import ComparisonFinding, Kind

MOST_RUNS = (
    20  # runs of points outside the tube that are told one by one; more of them are joined over the gaps between
)


def value_findings(name: str, unit: str, points: Points, allowed: Allowed) -> list[ComparisonFinding]:
    """Runs of points outside the tube, each with its worst point.

    Args:
        name: name of the signal.
        unit: its unit.
        points: the points that were held against the tube.
        allowed: error and shift that are allowed.
    """
    rows = np.flatnonzero(points.judged)
    size = np.abs(points.error[rows])
    found = []
    for a, b in _runs(size > allowed.value):
        inside = slice(a, b)
        worst = rows[inside][int(np.argmax(size[inside]))]
        count = int(np.count_nonzero(size[inside] > allowed.value))
        found.append(_value_finding(name, unit, points, (int(rows[a]), int(rows[b - 1])), int(worst), count, allowed))
    return found


def number_findings(name: str, points: Points) -> list[ComparisonFinding]:
    """Runs of points where one side holds a number and the other none.

    Args:
        name: name of the signal.
        points: the points that were held against the tube.
    """
    found = []
    for a, b in _runs(points.no_number):
        begin, end = float(points.time[a]), float(points.time[b - 1])
        values = float(points.reference[a]), float(points.result[a])
        size = float(np.count_nonzero(points.no_number[a:b]))
        text = f"{name}: {_when(begin, end)} {_kind_of_number(points, a)} ({size:.0f} points)"
        found.append(ComparisonFinding("nan", begin, end, *values, size, 0.0, text))
    return found


def jump_findings(
    name: str, unit: str, points: Points, jumps: MatchedJumps, allowed: Allowed
) -> list[ComparisonFinding]:
    """Jumps that are early or late, and jumps that one side has alone and that the values confirm.

    Args:
        name: name of the signal.
        unit: its unit.
        points: the points that were held against the tube.
        jumps: the jumps of both sides, paired.
        allowed: error and shift that are allowed.
    """
    found = _shift_findings(name, unit, jumps, allowed)
    found += _lone_findings(name, unit, "jump_missing", jumps.missing, points, allowed)
    found += _lone_findings(name, unit, "jump_extra", jumps.extra, points, allowed)
    return found


def with_unit(value: float, unit: str) -> str:
    """A number as people read it; pure numbers without a unit.

    Args:
        value: in this unit.
        unit: ``1`` for pure numbers.
    """
    return f"{value:.4g}" if unit in ("", "1") else f"{value:.4g} {unit}"


def _value_finding(
    name: str, unit: str, points: Points, ends: tuple[int, int], worst: int, count: int, allowed: Allowed
) -> ComparisonFinding:
    begin, end, at = (float(points.time[row]) for row in (*ends, worst))
    error = float(points.error[worst])
    side = f"{with_unit(abs(error), unit)} too {'high' if error > 0.0 else 'low'}"
    limit = f"(allowed {with_unit(allowed.value, unit)})"
    where = f"outside the tube, {side} {limit}"
    if ends[1] > ends[0]:
        where = f"{count} points outside the tube, at worst {side} at {at:.9g} s {limit}"
    text = f"{name}: {_when(begin, end)} {where}"
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


def _shift_findings(name: str, unit: str, jumps: MatchedJumps, allowed: Allowed) -> list[ComparisonFinding]:
    size = np.abs(jumps.shift)
    slack = rounding(*jumps.reference.end[-1:], *jumps.reference.begin[:1], 0.0)
    found = []
    for a, b in _runs(size > allowed.time + slack):
        worst = a + int(np.argmax(size[a:b]))
        one, two = float(jumps.reference.end[worst]), float(jumps.result.end[worst])
        late = "late" if jumps.shift[worst] > 0.0 else "early"
        height = with_unit(abs(float(jumps.reference.size[worst])), unit)
        amount = f"{size[worst]:.4g} s {late} (allowed {allowed.time:.4g} s)"
        text = f"{name}: the jump of {height} at {one:.9g} s comes {amount}"
        if b - a > 1:
            span = _when(float(jumps.reference.end[a]), float(jumps.reference.end[b - 1]))
            text = f"{name}: {span} {b - a} jumps at other instants, at worst {amount} at {one:.9g} s"
        last = float(max(jumps.reference.end[b - 1], jumps.result.end[b - 1]))
        begin = float(min(jumps.reference.end[a], jumps.result.end[a]))
        found.append(
            ComparisonFinding("jump_time", begin, last, one, two, float(size[worst]), allowed.time, text, min(one, two))
        )
    return found


def _lone_findings(
    name: str, unit: str, kind: Kind, jumps: Jumps, points: Points, allowed: Allowed
) -> list[ComparisonFinding]:
    if not len(jumps):
        return []
    # One that is hardly larger than allowed may be a little smaller on the other side, and none there; one whose points
    # are within the tube is followed by the other side within its own rows.
    large = np.abs(jumps.size) > 2.0 * allowed.value
    confirmed = large & outside_between(points, allowed, jumps.begin, jumps.end)
    found = []
    for a, b in _runs(confirmed):
        size = np.abs(jumps.size[a:b])
        worst = a + int(np.argmax(size))
        before, after = float(jumps.before[worst]), float(jumps.after[worst])
        whose = "missing" if kind == "jump_missing" else "only in the result"
        step = f"from {with_unit(before, unit)} to {with_unit(after, unit)} at {float(jumps.end[worst]):.9g} s"
        text = f"{name}: the jump {step} is {whose}"
        if b - a > 1:
            span = _when(float(jumps.end[a]), float(jumps.end[b - 1]))
            text = f"{name}: {span} {b - a} jumps are {whose}, the largest {step}"
        values = (after, np.nan) if kind == "jump_missing" else (np.nan, after)
        begin, end, at = (float(jumps.end[row]) for row in (a, b - 1, worst))
        found.append(ComparisonFinding(kind, begin, end, *values, float(size[worst - a]), allowed.value, text, at))
    return found


def _runs(marked: np.ndarray) -> list[tuple[int, int]]:
    """Runs [a, b) of marked entries; where there are many, joined over the smallest gaps."""
    rows = np.flatnonzero(marked)
    if not len(rows):
        return []
    gaps = np.diff(rows)
    widest = 1 if len(gaps) < MOST_RUNS else max(1, int(np.partition(gaps, -MOST_RUNS)[-MOST_RUNS]))
    cuts = np.flatnonzero(gaps > widest) + 1
    return [(int(part[0]), int(part[-1]) + 1) for part in np.split(rows, cuts)]


def _when(begin: float, end: float) -> str:
    return f"at {begin:.9g} s" if begin == end else f"from {begin:.9g} to {end:.9g} s"


def _kind_of_number(points: Points, row: int) -> str:
    one, two = float(points.reference[row]), float(points.result[row])
    if np.isnan(two) and not np.isnan(one):
        return "the result is not a number (NaN)"
    if np.isinf(two):
        return "the result is infinite"
    return "the reference is infinite" if np.isinf(one) else "the reference is not a number (NaN), the result is"
