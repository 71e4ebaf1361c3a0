"""Figures of faults: when one acts and who says so, and speed errors beside their bounds."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from cosim.drawing.style import MARK, axes_or_new, observer_line, styled
from cosim.evaluation.fault_detection import intervals
from cosim.evaluation.roles import estimate, label, recorded
from cosim.evaluation.spec import ReportSpec
from cosim.report.figures.drawing import logarithmic
from cosim.report.figures.panel import Panel, any_estimate
from cosim.report.figures.scales import bounded, running_maximum, window_length
from cosim.results.result import Result

BOUND = "error_bound"
ROW, REST = 0.38, 0.9  # height of the row of an observer, and of all that is not a row [inch]
_DECADES = 1e3  # from the bottom of the axis to the bound
_FILLED = 0.7  # share of a row that its bar fills


def _rows(result: Result, spec: ReportSpec) -> list[tuple[str, str, np.ndarray]]:
    """Text, colour and values of each row."""
    true = recorded(result, spec.true_fault)
    rows = [("fault acts", MARK, true)] if true is not None else []
    for observer in spec.observers:
        indicated = estimate(result, observer, spec.detection)
        if indicated is not None:
            rows.append((label(spec, observer), observer_line(spec.observers, observer)["color"], indicated))
    return rows


class FaultsPanel(Panel):
    """Bars against time where a fault acts, and below them one row an observer where it says so."""

    name = "faults"
    title = "Faults"
    caption = "When a fault acts, and when each observer says so."
    place = 3.4

    @classmethod
    @styled
    def draw(cls, result: Result, spec: ReportSpec, ax: Axes | None = None) -> Axes:  # noqa: D102 - see Panel
        return super().draw(result, spec, axes_or_new(ax, (8.2, REST + ROW * len(_rows(result, spec)))))

    @classmethod
    def plot(cls, result: Result, spec: ReportSpec, ax: Axes) -> None:  # noqa: D102 - see Panel
        rows = _rows(result, spec)
        for place, (_, colour, values) in enumerate(rows):
            bars = [(start, end - start) for start, end in intervals(result.time, values)]
            ax.broken_barh(bars, (place - _FILLED / 2, _FILLED), facecolor=colour, edgecolor=colour, linewidth=0.6)
        ax.set_yticks(range(len(rows)), [text for text, _, _ in rows])
        ax.set_ylim(max(len(rows), 1) - 0.5, -0.5)  # the first row on top

    @classmethod
    def available(cls, result: Result, spec: ReportSpec) -> bool:  # noqa: D102 - see Panel
        return any_estimate(result, spec, spec.detection) and recorded(result, spec.true_fault) is not None


class BoundsPanel(Panel):
    """Magnitude of the speed error as a share of the bound that its observer states at the same instant, the largest
    in each window of time, on a logarithmic axis; above 1 the bound is broken.
    """

    name = "bounds"
    title = "Speed error as a share of its bound"
    caption = "Largest in each window of time; above the line the bound that the observer stated was broken."
    place = 3.6

    @classmethod
    def plot(cls, result: Result, spec: ReportSpec, ax: Axes) -> None:  # noqa: D102 - see Panel
        true = recorded(result, spec.true_speed)
        window, largest = window_length([result.time]), 1.0
        for observer in spec.observers:
            bound, speed = estimate(result, observer, BOUND), estimate(result, observer, "speed")
            if bound is None or speed is None or true is None:
                continue
            with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
                share = np.where(speed == true, 0.0, np.abs(speed - true) / bound)
            middles, sizes = running_maximum(result.time, share, window)
            sizes = bounded(np.nan_to_num(sizes, posinf=np.inf))
            ax.plot(middles, sizes, label=label(spec, observer), **observer_line(spec.observers, observer))
            largest = max(largest, float(np.max(sizes, initial=0.0)))
        ax.axhline(1.0, color=MARK, linewidth=1.2, label="bound")
        logarithmic(ax)
        ax.set_ylim(1.0 / _DECADES, 1.5 * largest)
        ax.set_ylabel("|Speed error| / bound [1]")

    @classmethod
    def available(cls, result: Result, spec: ReportSpec) -> bool:  # noqa: D102 - see Panel
        return any_estimate(result, spec, BOUND) and recorded(result, spec.true_speed) is not None
