"""Figures of a comparison of observers: how large their errors are, and what they cost. Draws on axes given, or on its
own.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from typing import TYPE_CHECKING, Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cosim.drawing.style import MARK, axes_or_new, new_figure, observer_line, styled

if TYPE_CHECKING:
    from cosim.observer_benchmark.observer_scores import ObserverScore

MARKERS = "osD^vP*Xph"
"""A shape for each observer beside its colour."""


@styled
def _errors_figure(scores: Sequence[ObserverScore], ax: Axes | None = None) -> Axes:
    """Speed errors of observers in m/s on a logarithmic axis: rms and largest over the whole run, rms just before
    telegrams.
    """
    ax = axes_or_new(ax, (8.2, 1.4 + 0.45 * len(scores)))
    names = [score.name for score in scores]
    labelled: set[str] = set()
    for place, score in enumerate(scores):
        _draw_line(ax, place, score, observer_line(names, score.name)["color"], labelled)
    if any(_points(score) for score in scores):
        ax.set_xscale("log")
    ax.set_yticks(range(len(scores)), [score.label for score in scores])
    ax.set_ylim(len(scores) - 0.5, -0.5)
    ax.set_xlabel("Speed error [m/s]")
    handles, labels = ax.get_legend_handles_labels()
    if handles:
        ax.legend(handles, labels, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, frameon=False)
    return ax


def _draw_line(ax: Axes, place: int, score: ObserverScore, colour: Any, labelled: set[str]) -> None:
    """The line of one observer; what has no label in the legend yet gets one."""
    points = _points(score)
    for what, (value, marker, face) in points.items():
        ax.plot(
            [value],
            [place],
            marker,
            markersize=8,
            markeredgecolor=colour,
            color=colour if face else "none",
            label=None if what in labelled else what,
            linestyle="none",
        )
        labelled.add(what)
    if len(points) > 1:
        ends = [value for value, _, _ in points.values()]
        ax.hlines(place, min(ends), max(ends), color=colour, linewidth=1.0, zorder=1)
    if not points:
        word = "no numbers" if score.failure else "no speed"
        ax.annotate(word, (0.02, place), xycoords=("axes fraction", "data"), va="center", color=MARK)


def _points(score: ObserverScore) -> dict[str, tuple[float, str, bool]]:
    """What to draw of an observer: value, marker, and whether it is filled."""
    speed = None if score.whole is None else score.whole.speed
    at = score.speed_at_balises
    values = {
        "rms": (None if speed is None else speed.rms, "o", True),
        "rms just before telegrams": (None if at is None else at.rms, "D", False),
        "largest": (None if speed is None else speed.max_abs, "|", True),
    }
    return {
        what: (v, marker, face)
        for what, (v, marker, face) in values.items()
        if v is not None and isfinite(v) and v > 0.0
    }


@styled
def _cost_figure(scores: Sequence[ObserverScore], ax: Axes | None = None) -> Axes:
    """Cost in us per communication step against the rms speed error in m/s; left and low is good."""
    ax = axes_or_new(ax, (8.2, 4.0))
    names = [score.name for score in scores]
    for number, score in enumerate(scores):
        error, cost = score.speed_rms, score.cost
        if error is None or cost is None or not isfinite(error) or error <= 0.0:
            continue
        colour = observer_line(names, score.name)["color"]
        marker = MARKERS[number % len(MARKERS)]
        ax.plot([error], [cost], marker, markersize=9, color=colour, label=score.label, linestyle="none")
        ax.vlines(error, min(score.costs), max(score.costs), color=colour, linewidth=1.0)
    handles, labels = ax.get_legend_handles_labels()
    if handles:
        ax.set_xscale("log")
        ax.legend(handles, labels, loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    ax.set_ylim(0.0, 1.15 * max((max(score.costs) for score in scores if score.costs), default=1.0))
    ax.set_xlabel("rms speed error [m/s]")
    ax.set_ylabel("Cost per communication step [µs]")
    return ax


@styled
def observers_picture(scores: Sequence[ObserverScore]) -> Figure:
    """Both figures, one above the other.

    Args:
        scores: the observers, each with its numbers.
    """
    figure = new_figure((9.0, 5.4 + 0.45 * len(scores)))
    upper, lower = figure.subplots(2, 1, height_ratios=[1.0 + 0.45 * len(scores), 3.6])
    _errors_figure(scores, upper)
    _cost_figure(scores, lower)
    return figure
