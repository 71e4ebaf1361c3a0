"""Figures of the speed error and the position error. Draws on the axes it is given, or on a figure of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from matplotlib.axes import Axes

from cosim.drawing.style import ALARM, BLACK, MARK, WILD_LINE, observer_line
from cosim.evaluation.event_counts import accepted_stamps
from cosim.evaluation.metrics import error_size
from cosim.evaluation.roles import Quantity, estimation_error, label
from cosim.evaluation.spec import ReportSpec
from cosim.report.figures.drawing import curve, logarithmic, mark_evaluation, shade_zones
from cosim.report.figures.panel import Panel
from cosim.report.figures.scales import ErrorScale, error_scale, running_maximum, window_length
from cosim.results.result import Result
from fmus.tables.numbers import error_number, number

SPIKE = 3.0  # a curve that leaves the scale by this factor is named
FAR = 1e3  # sizes are cut this many times beyond a logarithmic axis


@dataclass(frozen=True)
class ErrorCurve:
    """An error against time, and how it is drawn.

    Args:
        time: [s], shape (rows,). error: shape (rows,). settled: rows after the start-up, which set the scale, shape
            (rows,).
        line: colour, dashes, width. text: for the legend.
    """

    time: np.ndarray
    error: np.ndarray
    settled: np.ndarray
    line: dict[str, Any]
    text: str


def draw_errors(ax: Axes, curves: Sequence[ErrorCurve], quantity: Quantity, unit: str) -> None:
    """Draw errors on a scale that none of them can squash, linear with sign or logarithmic without, and label the axis.

    Args:
        ax: the axes. curves: what to draw. quantity, unit: of the error.
    """
    scale = error_scale([c.error[c.settled] for c in curves])
    window = window_length([c.time for c in curves])
    for c in curves:
        largest = error_size(c.time[c.settled], c.error[c.settled]).max_abs
        wild = largest > SPIKE * scale.limit
        line = (
            c.line
            | (WILD_LINE if wild else {})
            | {"label": f"{c.text} ({_off_scale(largest, unit)})" if wild else c.text}
        )
        if scale.floor is None:
            curve(ax, c.time, c.error, (-scale.limit, scale.limit), **line)
        else:
            _absolute(ax, c, scale, line, window)
    _apply(ax, scale, quantity, unit, window)


def _off_scale(largest: float, unit: str) -> str:
    size = error_number(largest, 2)
    return size if size == "diverged" else f"off scale: {size} {unit}"


def _absolute(ax: Axes, c: ErrorCurve, scale: ErrorScale, line: dict[str, Any], window: float) -> None:
    assert scale.floor is not None
    time, size = running_maximum(c.time, c.error, window)
    ax.plot(time, np.clip(size, scale.floor / FAR, scale.limit * FAR), **line)


def _apply(ax: Axes, scale: ErrorScale, quantity: Quantity, unit: str, window: float) -> None:
    """Set the scale and say what it shows."""
    if scale.floor is None:
        ax.axhline(0.0, color=MARK, linewidth=0.7, zorder=1)
        ax.set_ylim(-scale.limit, scale.limit)
        ax.set_ylabel(f"{quantity.capitalize()} error [{unit}]")
        return
    logarithmic(ax)
    ax.set_ylim(scale.floor, scale.limit)
    ax.set_ylabel(f"|{quantity} error| [{unit}]\nlargest in {number(window, 1)} s")


class _ErrorPanel(Panel):
    """Estimated minus true value, with low-adhesion zones and balises. An observer that leaves the scale is named in
    the legend with its largest error.
    """

    quantity: ClassVar[Quantity]
    unit: ClassVar[str]

    @classmethod
    def plot(cls, result: Result, spec: ReportSpec, ax: Axes) -> None:
        settled = result.time >= spec.evaluate_after
        shade_zones(ax, spec)
        curves = [
            ErrorCurve(result.time, error, settled, observer_line(spec.observers, observer), label(spec, observer))
            for observer, error in cls._errors(result, spec).items()
        ]
        draw_errors(ax, curves, cls.quantity, cls.unit)
        _balise_ticks(ax, result)
        mark_evaluation(ax, result, spec)

    @classmethod
    def available(cls, result: Result, spec: ReportSpec) -> bool:
        return bool(cls._errors(result, spec))

    @classmethod
    def _errors(cls, result: Result, spec: ReportSpec) -> dict[str, np.ndarray]:
        found = {observer: estimation_error(result, spec, observer, cls.quantity) for observer in spec.observers}
        return {observer: error for observer, error in found.items() if error is not None}


class SpeedErrorPanel(_ErrorPanel):
    """Estimated minus true speed [m/s], against time."""

    name = "speed_error"
    title = "Speed error"
    caption = (
        "Estimated minus true speed. The scale follows the observers that work; one that leaves it "
        "is named in the legend."
    )
    place = 2
    quantity, unit = "speed", "m/s"


class PositionErrorPanel(_ErrorPanel):
    """Estimated minus true position [m], against time."""

    name = "position_error"
    title = "Position error"
    caption = "Estimated minus true position, on a scale chosen in the same way."
    place = 3
    quantity, unit = "position", "m"


def _balise_ticks(ax: Axes, result: Result) -> None:
    """Ticks along the bottom where balises were passed and used; false telegrams stand taller."""
    used = accepted_stamps(result.events)
    false = [event.stamp for event in result.events if event.kind == "false"]
    across = ax.get_xaxis_transform()
    if used:
        ax.vlines(used, 0.0, 0.035, transform=across, color=BLACK, linewidth=0.6)
        ax.plot([], [], "|", color=BLACK, label="balises")
    if false:
        ax.vlines(false, 0.0, 0.09, transform=across, color=ALARM, linewidth=1.6)
        ax.plot([], [], "|", color=ALARM, markersize=10, markeredgewidth=1.6, label="false telegrams")
