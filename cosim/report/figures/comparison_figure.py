"""Pictures of a comparison: both curves in the tolerance tube, the error in its band, the worst point enlarged.

Draws on the axes it is given, or on a figure of its own.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection

from cosim.comparison.verdict import ComparisonFinding, Curves, SignalComparison
from cosim.drawing.style import (
    ALARM,
    AMBER,
    BLACK,
    BLUE,
    GRID,
    MARK,
    TIME,
    axes_or_new,
    headline,
    new_figure,
    picture,
    styled,
)
from cosim.report.figures.drawing import curve, legend_above, thin
from cosim.report.figures.scales import bounded, value_limits
from fmus.tables.numbers import number

WIDTH, HEIGHT = 7.2, 6.6  # inches, of the whole picture
REFERENCE = {"color": BLACK, "linestyle": "-", "linewidth": 1.0}
_RESULT = {"color": BLUE, "linestyle": (0, (6, 1.5)), "linewidth": 1.3}
_DOTTED = 60  # rows at most that are drawn as dots as well
ROOM = 1.25  # of an axis above what it must show
SPIKE = 50.0  # an error so many times as large as the band hides the band; the axis then is that of the error
SHARE = 0.02  # of the run that a zoom shows at least
ROWS = 12.0  # of the reference that a zoom shows at least on either side
_SHIFTS = 4.0  # allowed times that a zoom shows at least on either side
_LARGEST_SHARE = 0.3  # of the run that a zoom shows at most


@styled
def comparison_figure(
    signal: SignalComparison, ax: Axes | None = None, window: tuple[float, float] | None = None
) -> Axes:
    """Reference and result over the tolerance tube, against time.

    Args:
        signal: the comparison, with its curves. ax: axes to draw on; None for a figure of its own.
        window: from when to when [s]; None for the whole run.

    Returns:
        The axes; without curves they say so.
    """
    ax, signal = axes_or_new(ax), signal.as_shown()
    curves = signal.curves
    if curves is None:
        return _empty(ax, signal)
    begin, end = window or _span(curves)
    limits = _value_limits(curves, begin, end)
    _draw_tube(ax, curves, begin, end, limits, 1.6 if window is None else 0.3)
    for name, line, time, values in (
        ("reference", REFERENCE, curves.reference_time, curves.reference),
        ("result", _RESULT, curves.result_time, curves.result),
    ):
        rows = _around(time, begin, end)
        few = window is not None and np.count_nonzero(rows) <= _DOTTED
        dots = {"marker": ".", "markersize": 4} if few else {}
        curve(ax, time[rows], bounded(values[rows]), limits, label=name, **line, **dots)
    _mark_findings(ax, signal, begin, end)
    if limits is not None:
        ax.set_ylim(*limits)
    return _finish(ax, begin, end, _axis_name("value", signal))


@styled
def _comparison_error_figure(signal: SignalComparison, ax: Axes | None = None) -> Axes:
    """Result minus reference with the band it may lie in, against time; arguments as for `comparison_figure`."""
    ax = axes_or_new(ax)
    curves = signal.curves
    if curves is None:
        return _empty(ax, signal)
    allowed, error = curves.allowed, bounded(curves.error)
    largest = float(np.max(np.abs(error[np.isfinite(error)]), initial=0.0))
    limit = ROOM * max(largest, allowed) or 1.0
    if allowed > 0.0:
        band = f"allowed: {number(allowed)}"
        ax.axhspan(-allowed, allowed, color=AMBER, alpha=0.55, linewidth=0, zorder=0.5, label=band)
    ax.axhline(0.0, color=MARK, linewidth=0.7, zorder=1)
    drawn = {"color": BLUE, "linewidth": 1.1, "label": "result minus reference"}
    curve(ax, curves.error_time, error, (-limit, limit), **drawn)
    if np.isfinite(signal.max_error_at) and not signal.passed:
        ax.axvline(signal.max_error_at, color=ALARM, linewidth=0.8, linestyle=(0, (2, 2)), label="largest")
    ax.set_ylim(-limit, limit)
    return _finish(ax, *_span(curves), _axis_name("error", signal))


@styled
def comparison_picture(signal: SignalComparison, kind: str) -> bytes:
    """Curves in their tube, the error in its band, and the worst point enlarged, as a file.

    Args:
        signal: the comparison, with its curves. kind: of file, ``png`` or ``svg``.
    """
    signal, figure = signal.as_shown(), new_figure((WIDTH, HEIGHT))
    headline(figure, f"{signal.name}: {signal.status}")
    whole, error, zoom = figure.subplots(3, 1, height_ratios=(1.15, 0.8, 1.15))
    comparison_figure(signal, whole)
    _comparison_error_figure(signal, error)
    window = _worst_window(signal)
    comparison_figure(signal, zoom, window)
    for ax in (whole, error):
        ax.set_xlabel("")
    if window is not None:
        whole.axvspan(*window, color=GRID, linewidth=0, zorder=0.2, label="enlarged below")
        legend_above(whole)
        legend_above(zoom, ["reference", "result", "tolerance tube"])
    return picture(figure, kind)


def _worst_window(signal: SignalComparison) -> tuple[float, float] | None:
    """From when to when the worst point is worth a close look [s]; None without curves, or where nothing is the
    worst.
    """
    curves = signal.curves
    if curves is None or not len(curves.reference_time):
        return None
    begin, end = _span(curves)
    finding = _worst_finding(signal)
    centre, width = (signal.max_error_at, 0.0) if finding is None else _centre(finding)
    if not np.isfinite(centre) or not end > begin:
        return None
    steps = np.diff(np.unique(curves.reference_time))
    step = float(np.median(steps)) if len(steps) else 0.0
    allowed = signal.allowed_time if np.isfinite(signal.allowed_time) else 0.0
    half = max(0.5 * SHARE * (end - begin), ROWS * step, _SHIFTS * allowed)
    half = min(half, 0.5 * _LARGEST_SHARE * (end - begin)) if len(steps) > 2 * ROWS else 0.5 * (end - begin)
    return max(begin, centre - half), min(end, centre + min(width, half) + half)


def _centre(finding: ComparisonFinding) -> tuple[float, float]:
    """Where a finding is largest and how far a late jump reaches from there [s]; else where it begins, and its length
    [s].
    """
    if not np.isfinite(finding.worst):
        return finding.time, finding.end - finding.time
    return finding.worst, finding.size if finding.kind == "jump_time" else 0.0


def _worst_finding(signal: SignalComparison) -> ComparisonFinding | None:
    """The first finding that has an instant."""
    return next((f for f in signal.findings if np.isfinite(f.time)), None)


def _axis_name(what: str, signal: SignalComparison) -> str:
    return f"{what.capitalize()} [{signal.unit or '1'}]"


def _span(curves: Curves) -> tuple[float, float]:
    times = [t for t in (curves.reference_time, curves.result_time) if len(t)]
    if not times:
        return 0.0, 1.0
    return float(min(np.nanmin(t) for t in times)), float(max(np.nanmax(t) for t in times))


def _around(time: np.ndarray, begin: float, end: float) -> np.ndarray:
    """Rows within a window, and the ones next to it so that lines reach its edges; shape (rows,)."""
    first, last = np.searchsorted(time, begin, "left"), np.searchsorted(time, end, "right")
    rows = np.zeros(len(time), dtype=bool)
    rows[max(int(first) - 1, 0) : int(last) + 1] = True
    return rows


def _value_limits(curves: Curves, begin: float, end: float) -> tuple[float, float] | None:
    """Lower and upper end of the axis: reference and tube whole, the result as far as it does not squash them."""
    reference = curves.reference[_around(curves.reference_time, begin, end)]
    inside = (curves.tube_time >= begin) & (curves.tube_time <= end)
    tube = [curves.lower[inside], curves.upper[inside]]
    result = curves.result[_around(curves.result_time, begin, end)]
    finite = bounded(result[np.isfinite(result)])
    anchors = [reference, *tube]
    known = np.concatenate([bounded(a[np.isfinite(a)]) for a in anchors])
    if len(finite) and (
        not len(known) or np.ptp(np.concatenate([known, finite])) <= SPIKE * max(float(np.ptp(known)), 1e-300)
    ):
        anchors.append(finite)
    return value_limits(anchors, [result])


def _pieces(curves: Curves, begin: float, end: float) -> Iterator[slice]:
    """Segments of the tube that touch a window; NaN rows separate them."""
    bad = np.flatnonzero(np.isnan(curves.tube_time) | np.isnan(curves.lower) | np.isnan(curves.upper))
    for before, after in pairwise([-1, *bad.tolist(), len(curves.tube_time)]):
        rows = slice(before + 1, after)
        time = curves.tube_time[rows]
        if len(time) and time[0] <= end and time[-1] >= begin:
            yield rows


def _draw_tube(
    ax: Axes, curves: Curves, begin: float, end: float, limits: tuple[float, float] | None, edge: float
) -> None:
    """The tube as one area for each piece; its edge keeps a narrow one visible."""
    shapes = []
    reach = (
        (-np.inf, np.inf)
        if limits is None
        else (limits[0] - SPIKE * np.ptp(limits), limits[1] + SPIKE * np.ptp(limits))
    )
    for rows in _pieces(curves, begin, end):
        time, lower, upper = curves.tube_time[rows], curves.lower[rows], curves.upper[rows]
        near = _around(time, begin, end)
        low_time, low = thin(time[near], np.clip(lower[near], *reach))
        high_time, high = thin(time[near], np.clip(upper[near], *reach))
        shapes.append(np.column_stack([np.append(low_time, high_time[::-1]), np.append(low, high[::-1])]))
    if shapes:
        surface: dict[str, Any] = {
            "facecolor": AMBER,
            "edgecolor": AMBER,
            "linewidth": edge,
            "alpha": 0.55,
            "zorder": 0.5,
        }
        ax.add_collection(PolyCollection(shapes, label="tolerance tube", **surface), autolim=False)


def _mark_findings(ax: Axes, signal: SignalComparison, begin: float, end: float) -> None:
    """When something was found: along the bottom, each from its begin to its end."""
    found = [(f.time, f.end) for f in signal.findings if np.isfinite(f.time) and f.time <= end and not f.end < begin]
    if found:
        across = ax.get_xaxis_transform()
        times = [(max(a, begin), min(b, end) if np.isfinite(b) else a) for a, b in found]
        ax.vlines([a for a, _ in times], 0.0, 0.07, transform=across, color=ALARM, linewidth=1.4)
        ax.hlines([0.012] * len(times), *np.transpose(times), transform=across, color=ALARM, linewidth=3.0)
        ax.plot([], [], color=ALARM, linewidth=3.0, label="outside")


def _finish(ax: Axes, begin: float, end: float, name: str) -> Axes:
    ax.set_xlabel(TIME)
    ax.set_ylabel(name)
    for axis in (ax.xaxis, ax.yaxis):  # every number in full: an offset above the axis would stand in the legend
        axis.set_major_formatter(lambda value, _: f"{value:.10g}")
    if end > begin:
        ax.set_xlim(begin, end)
    legend_above(ax)
    return ax


def _empty(ax: Axes, signal: SignalComparison) -> Axes:
    """Axes that say that there is nothing to draw."""
    ax.set(xlabel=TIME, ylabel=_axis_name("value", signal), yticks=[])
    ax.text(0.5, 0.5, f"{signal.name}: {signal.status}, no curves", transform=ax.transAxes, ha="center", va="center")
    return ax
