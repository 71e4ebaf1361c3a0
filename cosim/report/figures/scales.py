"""Axis scales that one wild curve cannot squash. NumPy and units only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cosim.results.shown_unit import ShownUnit

_OFF_SCALE_RATIO = 100.0  # a curve this much larger than the next smaller one is left off the scale
_LOG_RATIO = 8.0  # sizes that differ by more than this need a logarithmic axis
ROOM = 1.3
_PERCENTILE = 99.0
_SMALLEST_SPAN = 1e-3  # of an axis, by the size of its values: what rounding changes is no curve
WINDOWS = 180  # of the logarithmic figure in a run
BOUND = 1e150  # what is larger is drawn as this, so that nothing overflows on the way to a picture


@dataclass(frozen=True, slots=True)
class ErrorScale:
    """A scale for error curves.

    Args:
        limit: the largest error on the axis.
        floor: the smallest one on a logarithmic axis of absolute errors, or None for a linear axis from -limit to
            limit.
    """

    limit: float
    floor: float | None = None


def bounded(values: np.ndarray) -> np.ndarray:
    """Values with those beyond all bounds cut; NaN stays.

    Args:
        values: values, shape (rows,).
    """
    return np.asarray(np.clip(values, -BOUND, BOUND))


def drawn(values: np.ndarray, unit: ShownUnit) -> np.ndarray:
    """Values as they are drawn; the slip of a locked wheel, which the ratio to the wheel's speed makes any size, is -1.

    Args:
        values: as they are kept, shape (rows,). unit: of the axis; one of pure numbers is that of a slip.
    """
    return unit.values(np.clip(values, -1.0, 1.0) if unit.kept == "1" else bounded(values))


def curve_size(values: np.ndarray) -> float:
    """Size that represents a curve: the 99th percentile of its finite absolute values; infinite where most are not
    finite.

    Args:
        values: values, shape (rows,).
    """
    finite = np.abs(bounded(values[np.isfinite(values)]))
    if not len(finite) or len(finite) * 2 < len(values):
        return float("inf")
    return float(np.percentile(finite, _PERCENTILE))


def error_scale(curves: Sequence[np.ndarray]) -> ErrorScale:
    """Scale for several error curves, taken after the start-up transient.

    Curves are taken from the smallest up until one is a hundred times its forerunner: that one has diverged and leaves
    the scale. Where the sizes that are left differ much, the axis is logarithmic.

    Args:
        curves: errors, each of shape (rows,); values that are not finite are left out.
    """
    sizes = sorted(s for s in map(curve_size, curves) if np.isfinite(s))
    positive = [s for s in sizes if s > np.finfo(float).tiny]
    if not positive:
        return ErrorScale(1.0)
    kept = positive[:1]
    for size in positive[1:]:
        if size > _OFF_SCALE_RATIO * kept[-1]:
            break
        kept.append(size)
    largest = max(_peak(curve) for curve in curves if curve_size(curve) <= kept[-1])
    limit = ROOM * min(largest, 3 * kept[-1])  # a single spike does not set the scale
    if kept[-1] <= _LOG_RATIO * kept[0]:
        return ErrorScale(limit)
    return ErrorScale(limit, max(0.1 * kept[0], 1e-8 * limit))


def window_length(times: Sequence[np.ndarray]) -> float:
    """Length of a window of the logarithmic figure: a round time [s], some hundred in a run.

    Args:
        times: instants of the curves [s], shape (rows,) each.
    """
    duration = max((float(time[-1] - time[0]) for time in times if len(time)), default=0.0)
    return float(f"{max(duration / WINDOWS, 1e-6):.0e}")


def running_maximum(time: np.ndarray, values: np.ndarray, window: float) -> tuple[np.ndarray, np.ndarray]:
    """Largest absolute value in each window of time.

    Args:
        time: not decreasing [s], shape (rows,). values: shape (rows,). window: length of a window [s].

    Returns:
        Middles of the windows that hold a row [s], and the largest value in each; NaN counts as infinite.
    """
    number = np.floor((time - time[:1]) / window).astype(int)
    starts = np.flatnonzero(np.diff(number, prepend=-1))
    size = np.where(np.isnan(values), np.inf, np.abs(values))
    return time[:1] + (number[starts] + 0.5) * window, np.maximum.reduceat(size, starts) if len(size) else size


def _peak(values: np.ndarray) -> float:
    finite = np.abs(bounded(values[np.isfinite(values)]))
    return float(np.max(finite)) if len(finite) else 0.0


def value_limits(anchors: Sequence[np.ndarray], others: Sequence[np.ndarray]) -> tuple[float, float] | None:
    """Limits for curves of which some can be trusted.

    The trusted curves are shown whole. Another one widens the axis to what it holds most of the time, by at most the
    same range again on either side; one that needs more than that has diverged and widens nothing.

    Args:
        anchors: trusted curves (the true value). others: estimates. Each of shape (rows,).

    Returns:
        Lower and upper limit, or None where there is no finite value.
    """
    low, high = _range(anchors, 0.0) or _range(others, 1.0) or (np.nan, np.nan)
    if not np.isfinite(low):
        return None
    span = max(high - low, _SMALLEST_SPAN * max(abs(low), abs(high)), 1e-12)
    wanted = [r for r in (_range([curve], 1.0) for curve in others) if r and r[0] >= low - span and r[1] <= high + span]
    low, high = min([low, *(r[0] for r in wanted)]), max([high, *(r[1] for r in wanted)])
    room = 0.06 * max(high - low, span)
    return low - room, high + room


def _range(curves: Sequence[np.ndarray], percent: float) -> tuple[float, float] | None:
    finite = [bounded(c[np.isfinite(c)]) for c in curves]
    ends = [(np.percentile(c, percent), np.percentile(c, 100 - percent)) for c in finite if len(c)]
    return (float(min(e[0] for e in ends)), float(max(e[1] for e in ends))) if ends else None
