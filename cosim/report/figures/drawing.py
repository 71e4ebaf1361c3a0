"""Strokes the figures share: curves, low-adhesion zones, balise ticks, legends. Draws on the axes it is given."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, NullLocator

from cosim.drawing.style import MARK, ZONE
from cosim.evaluation.spec import ReportSpec
from cosim.results.result import Result
from cosim.results.shown_unit import ShownUnit, shared_unit
from fmus.tables.numbers import number

_BUCKETS = 1500  # more points than a picture has columns add nothing but time and bytes
_MARGINS = 1.0  # width of a figure beside its axes [inch]
_LETTER_WIDTH, _HANDLE_WIDTH = 0.069, 0.66  # of a letter and of a line with the space around it in a legend [inch]
SPEED = ShownUnit("km/h", 1.0 / 3.6, 0.0, "m/s")
"""Of an axis of speeds none of which has a unit; likewise of forces and of slips."""
FORCE, SLIP = ShownUnit("N", kept="N"), ShownUnit()
FAR = 50.0  # values are cut this many axis heights away, so that a line to 1e300 can still be drawn


def axis_unit(result: Result, names: Iterable[str | None], otherwise: ShownUnit) -> ShownUnit:
    """The unit of an axis of signals of one kind: that in which all are shown, else the one in which they are kept.

    Args:
        result: the run. names: of the signals; what was not recorded does not count.
        otherwise: where none has a unit; that of pure numbers where it is one.
    """
    known = {s.name: s.shown for s in result.signals if s.unit != "1" or otherwise.kept == "1"}
    found = [known[name] for name in names if name in known]
    return shared_unit(found) if found else otherwise


def thin(time: np.ndarray, values: np.ndarray, buckets: int = _BUCKETS) -> tuple[np.ndarray, np.ndarray]:
    """Fewer points that draw the same picture: the first, lowest, highest and last of each bucket of rows.

    Args:
        time: [s], shape (rows,). values: shape (rows,). buckets: about one for each column of pixels.

    Returns:
        Time and values, at most four for each bucket.
    """
    if len(time) <= 4 * buckets:
        return time, values
    edges = np.linspace(0, len(time), buckets + 1).astype(int)
    low, high = np.where(np.isfinite(values), values, np.inf), np.where(np.isfinite(values), values, -np.inf)
    keep: set[int] = set()
    for a, b in pairwise(edges):
        keep |= {a, a + int(np.argmin(low[a:b])), a + int(np.argmax(high[a:b])), b - 1}
    rows = np.array(sorted(keep))
    return time[rows], values[rows]


def curve(ax: Axes, time: np.ndarray, values: np.ndarray, limits: tuple[float, float] | None, **line: Any) -> None:
    """Draw a curve; values that are not finite leave a gap, values far outside `limits` are cut.

    Args:
        ax: the axes.
        time: [s], shape (rows,).
        values: in the unit of the axes, shape (rows,).
        line: colour, dashes and width, as for ``Axes.plot``.
    """
    shown = np.where(np.isfinite(values), values, np.nan)
    if limits is not None:
        reach = FAR * (limits[1] - limits[0])
        shown = np.clip(shown, limits[0] - reach, limits[1] + reach)
    ax.plot(*thin(time, shown), **line)


def shade_zones(ax: Axes, spec: ReportSpec) -> None:
    """Shade the low-adhesion zones behind the curves.

    Args:
        ax: the axes.
        spec: with the zones.
    """
    for i, (start, end) in enumerate(spec.zones):
        ax.axvspan(start, end, color=ZONE, linewidth=0, zorder=0, label="low adhesion" if i == 0 else None)


def mark_evaluation(ax: Axes, result: Result, spec: ReportSpec) -> None:
    """Mark where the evaluation starts, if start-up is left out of it.

    Args:
        ax: the axes.
        result: the run.
        spec: says from when on errors count.
    """
    if len(result.time) and result.time[0] < spec.evaluate_after < result.time[-1]:
        ax.axvline(
            spec.evaluate_after, color=MARK, linewidth=0.9, linestyle=(0, (1, 2)), label="evaluated from here on"
        )


def logarithmic(ax: Axes) -> None:
    """A logarithmic ordinate with plain numbers at its decades.

    Args:
        ax: the axes.
    """
    ax.set_yscale("log")
    ax.yaxis.set_minor_locator(NullLocator())
    ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: number(value, 1)))


def legend_above(ax: Axes, leave_out: Sequence[str] = ()) -> None:
    """Put the legend above the axes, where it hides nothing, in as many columns as the figure is wide.

    Args:
        ax: the axes. leave_out: labels explained elsewhere.
    """
    handles, labels = ax.get_legend_handles_labels()
    entries = [(h, text) for h, text in zip(handles, labels, strict=True) if text not in leave_out]
    legend, figure = ax.get_legend(), ax.get_figure(root=True)
    if legend is not None:
        legend.remove()
    if entries and figure is not None:
        width = figure.get_figwidth() - _MARGINS
        legend = ax.legend(
            *zip(*entries, strict=True),
            loc="lower left",
            bbox_to_anchor=(0.0, 1.0),
            ncols=_columns([text for _, text in entries], width),
            frameon=False,
            borderaxespad=0.3,
            handlelength=3.2,
            columnspacing=1.4,
        )
        for line in legend.get_lines():  # thin and faint lines are hard to recognise when they are short
            line.set(alpha=1.0, linewidth=max(line.get_linewidth(), 1.3))


def _columns(labels: Sequence[str], width: float) -> int:
    """Most columns of a legend that fit into `width` [inch]; matplotlib fills it column by column."""
    for count in range(len(labels), 1, -1):
        columns = np.array_split(np.array([len(text) for text in labels]), count)
        if sum(_HANDLE_WIDTH + _LETTER_WIDTH * max(c, default=0) for c in columns) <= width:
            return count
    return 1
