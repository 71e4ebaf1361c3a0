"""Figures of the speed error and the position error. Draws on the axes it is given, or on a figure of its own."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, NullLocator

from cosim.report.drawing import balise_ticks, curve, legend_above, mark_evaluation, shade_zones, time_axis
from cosim.report.metrics import error_size
from cosim.report.numbers import error_number, number
from cosim.report.roles import Quantity, estimation_error, label
from cosim.report.scales import ErrorScale, error_scale, running_maximum
from cosim.report.spec import ReportSpec
from cosim.report.style import WILD_LINE, axes_or_new, observer_line, styled
from cosim.results.result import Result

WINDOWS = 180  # of the logarithmic figure in a run
SPIKE = 3.0  # a curve that leaves the scale by this factor is named
FAR = 1e3  # sizes are cut this many times beyond a logarithmic axis


@styled
def speed_error_figure(result: Result, spec: ReportSpec, ax: Axes | None = None) -> Axes:
    """Estimated minus true speed in m/s, against time, with low-adhesion zones and balises.

    Args:
        result: the run. spec: roles. ax: axes to draw on; None for a figure of its own.

    Returns:
        The axes. An observer that leaves the scale is named in the legend with its largest error.
    """
    return _error_figure(result, spec, axes_or_new(ax), "speed", "m/s")


@styled
def position_error_figure(result: Result, spec: ReportSpec, ax: Axes | None = None) -> Axes:
    """Estimated minus true position in m, against time, with low-adhesion zones and balises.

    Args:
        result: the run. spec: roles. ax: axes to draw on; None for a figure of its own.

    Returns:
        The axes. An observer that leaves the scale is named in the legend with its largest error.
    """
    return _error_figure(result, spec, axes_or_new(ax), "position", "m")


def _error_figure(result: Result, spec: ReportSpec, ax: Axes, quantity: Quantity, unit: str) -> Axes:
    found = ((observer, estimation_error(result, spec, observer, quantity)) for observer in spec.observers)
    errors = {observer: error for observer, error in found if error is not None}
    settled = result.time >= spec.evaluate_after
    scale = error_scale([error[settled] for error in errors.values()])
    shade_zones(ax, spec)
    draw = _signed if scale.floor is None else _absolute
    for observer, error in errors.items():
        largest = error_size(result.time[settled], error[settled]).max_abs
        line, text = observer_line(spec.observers, observer), label(spec, observer)
        if largest > SPIKE * scale.limit:
            line, text = line | WILD_LINE, f"{text} ({_off_scale(largest, unit)})"
        draw(ax, result, error, scale, line | {"label": text})
    _apply(ax, scale, quantity, unit, _window(result))
    balise_ticks(ax, result)
    mark_evaluation(ax, result, spec)
    time_axis(ax, result)
    legend_above(ax)
    return ax


def _off_scale(largest: float, unit: str) -> str:
    size = error_number(largest, 2)
    return size if size == "diverged" else f"off scale: {size} {unit}"


def _window(result: Result) -> float:
    """Length of a window of the logarithmic figure: a round time [s], some hundred in a run."""
    duration = float(result.time[-1] - result.time[0]) if len(result.time) else 0.0
    return float(f"{max(duration / WINDOWS, 1e-6):.0e}")


def _signed(ax: Axes, result: Result, error: np.ndarray, scale: ErrorScale, line: dict[str, Any]) -> None:
    curve(ax, result.time, error, (-scale.limit, scale.limit), **line)


def _absolute(ax: Axes, result: Result, error: np.ndarray, scale: ErrorScale, line: dict[str, Any]) -> None:
    assert scale.floor is not None
    time, size = running_maximum(result.time, error, _window(result))
    ax.plot(time, np.clip(size, scale.floor / FAR, scale.limit * FAR), **line)


def _apply(ax: Axes, scale: ErrorScale, quantity: Quantity, unit: str, window: float) -> None:
    """Set the scale and say what it shows."""
    if scale.floor is None:
        ax.axhline(0.0, color="#888888", linewidth=0.7, zorder=1)
        ax.set_ylim(-scale.limit, scale.limit)
        ax.set_ylabel(f"{quantity.capitalize()} error [{unit}]")
        return
    ax.set_yscale("log")
    ax.set_ylim(scale.floor, scale.limit)
    ax.yaxis.set_minor_locator(NullLocator())
    ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: number(value, 1)))
    ax.set_ylabel(f"|{quantity} error| [{unit}]\nlargest in {number(window, 1)} s")
