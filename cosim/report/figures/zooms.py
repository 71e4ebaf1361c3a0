"""The zoom figures of a report as PNG, with their texts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cosim.drawing.style import ALARM, BAND, BLACK, MARK, TIME, WHITE, ZONE, new_figure, observer_line, png, styled
from cosim.evaluation.roles import estimate, estimation_error, label, recorded
from cosim.evaluation.spec import ReportSpec
from cosim.report.figures.drawing import FAR, legend_above
from cosim.report.figures.scales import BOUND, bounded, error_scale, slip_in_percent
from cosim.report.zoom_windows import MOST, ZoomWindow, notable_windows
from cosim.results.result import BaliseRecord, Result
from fmus.tables.numbers import number

ZOOM_KEYS = tuple(f"zoom_{i}" for i in range(1, MOST + 1))
"""Stems of the file names, in order of time."""
_VIEWS = {"errors": "Speed error and position error", "slip": "Speed error and slip"}


_SIZE, _ONE_PANEL = (5.6, 4.3), (5.6, 2.8)  # inches
_TRUE: dict[str, Any] = {"color": BAND, "linewidth": 4.0, "zorder": 1.5}  # a band, on which the estimates lie
_STAMP: dict[str, Any] = {"color": BLACK, "linewidth": 0.9, "zorder": 1.4}
_DELIVERY: dict[str, Any] = {"color": BLACK, "linewidth": 0.9, "linestyle": (0, (2, 2)), "zorder": 1.4}
_MISSED: dict[str, Any] = {"color": MARK, "linewidth": 0.9, "linestyle": (0, (1, 2)), "zorder": 1.4}
_MOST_TELEGRAMS = 60  # in a window; more would be a hatching


_Curves = dict[str, np.ndarray]
"""Values by observer, shape (rows,)."""


@styled
def _zoom_figure(result: Result, spec: ReportSpec, window: ZoomWindow) -> Figure:
    """One or two panels over a window of time: speed error, and position error or slip."""
    panels = [panel for panel in _panels(result, spec, window) if panel[1]]
    figure = new_figure(_SIZE if len(panels) > 1 else _ONE_PANEL)
    if not panels:
        return figure
    axes = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    rows = _rows(result.time, window)
    for ax, (text, curves, true) in zip(axes, panels, strict=True):
        _background(ax, result, spec, window)
        if true is not None:
            ax.plot(result.time[rows], true[rows], **_TRUE)
            axes[0].plot([], [], label="true", **_TRUE)  # for the legend
        shown = {o: values[rows] for o, values in curves.items()}
        own = None if window.about is None else shown.get(window.about)
        _draw(ax, result.time[rows], shown, spec, _reach(list(shown.values()), own))
        others = [] if true is None else [true[rows]]
        _limits(ax, [*shown.values(), *others], _reach([*shown.values(), *others], own), zero=true is None)
        ax.set_ylabel(text)
    axes[-1].set_xlabel(TIME)
    axes[-1].set_xlim(window.start, window.end)
    axes[-1].ticklabel_format(axis="x", useOffset=False)
    legend_above(axes[0])
    return figure


def _panels(result: Result, spec: ReportSpec, window: ZoomWindow) -> list[tuple[str, _Curves, np.ndarray | None]]:
    """Label, curves and true curve of each panel."""
    speed = ("Speed error [m/s]", _errors(result, spec, "speed"), None)
    slip = {o: slip_in_percent(v) for o in spec.observers if (v := estimate(result, o, "slip")) is not None}
    true_slip = recorded(result, spec.true_slip)
    if window.view == "slip" and slip:
        return [speed, ("Slip [%]", slip, None if true_slip is None else slip_in_percent(true_slip))]
    return [speed, ("Position error [m]", _errors(result, spec, "position"), None)]


def _errors(result: Result, spec: ReportSpec, quantity: Any) -> _Curves:
    found = {o: estimation_error(result, spec, o, quantity) for o in spec.observers}
    return {o: bounded(e) for o, e in found.items() if e is not None}


def _rows(time: np.ndarray, window: ZoomWindow) -> np.ndarray:
    """Indices of the rows in a window, and one more on either side, so that curves reach its edges."""
    first, beyond = np.searchsorted(time, window.start, "left") - 1, np.searchsorted(time, window.end, "right") + 1
    return np.arange(max(int(first), 0), min(int(beyond), len(time)))


def _reach(curves: list[np.ndarray], own: np.ndarray | None) -> float:
    """Largest size on the axis: of the curves which work or, where it is about one, that one while it is a number."""
    largest = 0.0 if own is None else float(np.max(np.abs(own[np.abs(own) < BOUND]), initial=0.0))
    return max(error_scale(curves).limit, largest)


def _draw(ax: Axes, time: np.ndarray, curves: _Curves, spec: ReportSpec, reach: float) -> None:
    pairs = np.flatnonzero(np.diff(time) == 0.0)
    for observer, values in curves.items():
        line = observer_line(spec.observers, observer)
        shown = _cut(values, reach)
        ax.plot(time, shown, label=label(spec, observer), **line)
        moved = pairs[shown[pairs] != shown[pairs + 1]]
        mark: dict[str, Any] = {
            "linestyle": "",
            "marker": "o",
            "markersize": 3.2,
            "color": line["color"],
            "zorder": 3.0,
        }
        ax.plot(time[moved], shown[moved], markerfacecolor=WHITE, **mark)
        ax.plot(time[moved], shown[moved + 1], **mark)


def _cut(values: np.ndarray, reach: float) -> np.ndarray:
    """Values without those that are not finite, and without heights no picture can hold."""
    return np.clip(np.where(np.isfinite(values), values, np.nan), -FAR * reach, FAR * reach)


def _limits(ax: Axes, curves: list[np.ndarray], reach: float, *, zero: bool) -> None:
    """Limits that hold all curves but those which left the scale."""
    finite = [c[np.isfinite(c) & (np.abs(c) <= reach)] for c in curves]
    ends = [(float(np.min(c)), float(np.max(c))) for c in finite if len(c)]
    if zero:
        ax.axhline(0.0, color=MARK, linewidth=0.7, zorder=1)
        ends.append((0.0, 0.0))
    low, high = min((e[0] for e in ends), default=0.0), max((e[1] for e in ends), default=0.0)
    room = 0.08 * (high - low) or 0.1 * max(abs(low), 1e-9)
    ax.set_ylim(low - room, high + room)


def _background(ax: Axes, result: Result, spec: ReportSpec, window: ZoomWindow) -> None:
    """Low-adhesion zones, stamps and deliveries."""
    inside = [z for z in spec.zones if z[1] > window.start and z[0] < window.end]
    for start, end in inside:
        text = "low adhesion" if (start, end) == inside[0] else "_"
        ax.axvspan(start, end, color=ZONE, linewidth=0, zorder=0, label=text)
    seen: set[str] = set()
    for event in _in_window(result, window):
        for instant, text, line in _instants(event):
            ax.axvline(instant, label="_" if text in seen else text, **line)
            seen.add(text)


def _in_window(result: Result, window: ZoomWindow) -> list[BaliseRecord]:
    near = [e for e in result.events if e.stamp <= window.end and max(e.stamp, e.delivered_at) >= window.start]
    return sorted(near, key=lambda e: abs(e.stamp - window.time))[:_MOST_TELEGRAMS]


def _instants(event: BaliseRecord) -> list[tuple[float, str, dict[str, Any]]]:
    """Instants of a telegram: time [s], text for the legend, line."""
    if event.kind == "missed":
        return [(event.stamp, "missed balise", _MISSED)]
    false = {"color": ALARM, "linewidth": 1.4} if event.kind == "false" else {}
    kind = "false telegram" if false else "balise"
    if not event.delivered_at > event.stamp:
        return [(event.stamp, kind, _STAMP | false)]
    return [
        (event.stamp, f"{kind}, passed", _STAMP | false),
        (event.delivered_at, f"{kind}, delivered", _DELIVERY | false),
    ]


@dataclass(frozen=True, slots=True)
class Zoom:
    """A drawn zoom.

    Args:
        key: stem of its file name. title: what it is about. caption: what else is in it. png: the picture.
    """

    key: str
    title: str
    caption: str
    png: bytes


def draw_zooms(result: Result, spec: ReportSpec) -> list[Zoom]:
    """All zoom figures of a run in order of time; none where it has no errors.

    Args:
        result: the run.
        spec: roles of the signals, labels, phases and zones.
    """
    windows = notable_windows(result, spec)
    pictures = [png(_zoom_figure(result, spec, window)) for window in windows]
    return [
        Zoom(key, window.reasons[0], _caption(window), picture)
        for key, window, picture in zip(ZOOM_KEYS, windows, pictures, strict=False)
    ]


def _caption(window: ZoomWindow) -> str:
    span = f"{_VIEWS[window.view]}, {number(window.start, 4)} s to {number(window.end, 4)} s."
    return " ".join([span, *(f"{reason}." for reason in window.reasons[1:])])
