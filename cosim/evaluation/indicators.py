"""What the slip indicators said: how long they were on, and how soon after the rails became slippery. Imports NumPy
only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cosim.evaluation.metrics import FEWEST_INSTANTS, instants
from cosim.evaluation.roles import estimate
from cosim.evaluation.spec import ReportSpec
from cosim.results.result import Result

THRESHOLD = 1.5  # the indicator is 1 (nominal) or 2 (degraded)


@dataclass(frozen=True, slots=True)
class IndicatorStatistics:
    """A slip indicator over a run, from the start of the evaluation on.

    Args:
        observer: component name.
        on: share of the time it was on [1]; NaN with too few rows.
        on_outside: share of the time outside the low-adhesion zones it was on [1]; NaN where no time is outside.
        delays: for each zone the time from its start to the first indication within it [s], or None without any.
    """

    observer: str
    on: float
    on_outside: float
    delays: tuple[float | None, ...]


def on_intervals(time: np.ndarray, indicator: np.ndarray) -> list[tuple[float, float]]:
    """Intervals in which an indicator is on; its values hold until the next row.

    Args:
        time: [s], shape (rows,). indicator: 1 nominal, 2 degraded, shape (rows,).

    Returns:
        Disjoint intervals (start, end) [s] in order.
    """
    on = np.concatenate(([False], indicator > THRESHOLD, [False]))
    starts, ends = np.flatnonzero(~on[:-1] & on[1:]), np.flatnonzero(on[:-1] & ~on[1:])
    times = np.append(time, time[-1:])
    return [(float(times[i]), float(times[k])) for i, k in zip(starts, ends, strict=True) if times[k] > times[i]]


def on_share(time: np.ndarray, indicator: np.ndarray, start: float, end: float) -> float | None:
    """Share of an interval of time in which an indicator is on [1], or None where none of it was recorded.

    Args:
        time: [s], shape (rows,). indicator: 1 nominal, 2 degraded, shape (rows,). start, end: of the interval [s].
    """
    if not len(time) or not (start := max(start, float(time[0]))) < (end := min(end, float(time[-1]))):
        return None
    return _overlap(on_intervals(time, indicator), start, end) / (end - start)


def _overlap(intervals: Sequence[tuple[float, float]], start: float, end: float) -> float:
    return sum(max(0.0, min(end, b) - max(start, a)) for a, b in intervals)


def _delay(intervals: Sequence[tuple[float, float]], start: float, end: float) -> float | None:
    return next((max(a - start, 0.0) for a, b in intervals if b > start and a <= end), None)


def indicator_statistics(result: Result, spec: ReportSpec) -> list[IndicatorStatistics]:
    """Statistics of all observers whose slip indicator was recorded.

    Args:
        result: the run. spec: observers, low-adhesion zones, start of the evaluation.
    """
    found = ((observer, estimate(result, observer, "slip_indicator")) for observer in spec.observers)
    return [
        _one(result.time, values, observer, spec) for observer, values in found if values is not None and len(values)
    ]


def _one(time: np.ndarray, values: np.ndarray, observer: str, spec: ReportSpec) -> IndicatorStatistics:
    start, end = max(float(time[0]), spec.evaluate_after), float(time[-1])
    intervals = [(max(a, start), b) for a, b in on_intervals(time, values) if b > start]
    zones = [(max(a, start), min(b, end)) for a, b in spec.zones if b > start and a < end]
    inside = sum(_overlap(intervals, a, b) for a, b in zones)
    outside_time = (end - start) - sum(b - a for a, b in zones)
    total = _overlap(intervals, start, end)
    return IndicatorStatistics(
        observer,
        total / (end - start) if instants(time[time >= start]) >= FEWEST_INSTANTS else float("nan"),
        max(total - inside, 0.0) / outside_time if outside_time > 0 else float("nan"),
        tuple(_delay(intervals, a, b) for a, b in spec.zones),
    )
