"""Judges of indicators: on in time, or never on. An indicator holds its value from one row to the next. Imports NumPy
only.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cosim.expectations.judged import Judged, at, given
from cosim.expectations.run import Run, span

if TYPE_CHECKING:
    from cosim.scenario.expectation_tables import OffExpectation, OnExpectation

BETWEEN_0_AND_1, BETWEEN_1_AND_2 = 0.5, 1.5
LEVELS = {
    "slip_indicator": BETWEEN_1_AND_2,
    "condition": BETWEEN_1_AND_2,
    "adhesion_level": BETWEEN_1_AND_2,
    "axle_slipping": BETWEEN_0_AND_1,
    "sanding_request": BETWEEN_0_AND_1,
    "adhesion_degraded": BETWEEN_0_AND_1,
}
"""Thresholds of the shipped models' indicators, by name of the output: halfway between nominal and degraded, off and
on.
"""
ROUNDING = 1e-9


def shipped_threshold(signal: str) -> float | None:
    """Threshold of an indicator of a shipped model, by the name of the signal; None where it is no such indicator."""
    return LEVELS.get(signal.rpartition(".")[2].partition("[")[0])


def judge_on(item: OnExpectation, run: Run) -> list[Judged]:
    """On at `before` at the latest; an indicator that is on when the window begins is on in time."""
    name = f"{item.signal} on by {given(item.before)} s{span(item.start, None)}"
    values, threshold = run.recorded(item.signal), _threshold(item)
    start = run.start if item.start is None else item.start
    first = first_on(run.result.time, values, threshold, start)
    window = run.window(item.start, item.before)
    common: dict[str, Any] = {"check": item.check, "limit": item.before, "unit": "s"}
    if first is None or (first > item.before + ROUNDING * max(1.0, abs(item.before)) and window.reached < item.before):
        text = window.unreached if window.reached < item.before else "never on"
        return [Judged(name, passed=False, text=f"{text} (threshold {given(threshold)})", **common)]
    passed = first <= item.before + ROUNDING * max(1.0, abs(item.before))
    already = " already, when the window begins" if first == start else ""
    text = f"on at {given(first, 's')}{already}, expected by {given(item.before, 's')}"
    return [Judged(name, passed=passed, measured=first, when=first, text=text, **common)]


def judge_off(item: OffExpectation, run: Run) -> list[Judged]:
    """Never on within the window."""
    name = f"{item.signal} off{span(item.start, item.end)}"
    values, threshold, window = run.recorded(item.signal), _threshold(item), run.window(item.start, item.end)
    common: dict[str, Any] = {"check": item.check, "limit": 0.0, "unit": "s"}
    if window.reached < window.start or window.reached == window.start < window.end:
        return [Judged(name, passed=False, text=window.unreached, **common)]
    time, shown = _held(run.result.time, values, window.start, window.end)
    bad = np.isnan(shown)
    if bad.any():
        when = float(time[np.argmax(bad)])
        return [Judged(name, passed=False, when=when, text=f"not a number at {given(when)} s", **common)]
    on = shown > threshold
    if not on.any():
        text = f"stays off (threshold {given(threshold)})" + (f"; {window.unreached}" if window.broken else "")
        return [Judged(name, passed=not window.broken, measured=0.0, text=text, **common)]
    until = np.append(time[1:], min(window.end, max(window.reached, window.start)))
    seconds, when = float(np.sum((until - time)[on])), float(time[np.argmax(on)])
    text = f"on for {given(seconds, 's')}{at(when, 'first at')}, expected never"
    return [Judged(name, passed=False, measured=seconds, when=when, text=text, **common)]


def first_on(time: np.ndarray, values: np.ndarray, threshold: float, start: float) -> float | None:
    """When an indicator is first on, from `start` on [s]; `start` itself where it is on already; None where it never
    is.

    Args:
        time: not decreasing [s], shape (rows,). values: shape (rows,), each held until the next row.
        threshold: on is above it. start: [s].
    """
    held_time, held = _held(time, values, start, float("inf"))
    on = np.flatnonzero(held > threshold)
    return float(held_time[on[0]]) if len(on) else None


def _held(time: np.ndarray, values: np.ndarray, start: float, end: float) -> tuple[np.ndarray, np.ndarray]:
    """Times and values from `start` to `end`, both included; the value held at `start` counts from there."""
    slack = ROUNDING * max(1.0, abs(start))
    first = max(int(np.searchsorted(time, start + slack, "right")) - 1, 0)
    last = int(np.searchsorted(time, end + slack, "right"))
    return np.maximum(time[first:last], start), values[first:last]


def _threshold(item: OnExpectation | OffExpectation) -> float:
    return item.threshold if item.threshold is not None else shipped_threshold(item.signal) or BETWEEN_0_AND_1
