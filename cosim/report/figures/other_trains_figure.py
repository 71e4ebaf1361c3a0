"""Figure of other trains of a run: how far each is from the true one. Draws on the axes it is given, or on its own."""

from __future__ import annotations

from matplotlib.axes import Axes

from cosim.drawing.style import MARK, axes_or_new, observer_line, styled
from cosim.evaluation.roles import estimate, label, recorded
from cosim.evaluation.spec import ReportSpec
from cosim.report.figures.drawing import curve, legend_above, time_axis
from cosim.report.figures.panel import Panel
from cosim.report.figures.scales import bounded
from cosim.results.result import Result


@styled
def other_trains_figure(result: Result, spec: ReportSpec, ax: Axes | None = None) -> Axes:
    """Position of the other trains minus that of the true one in m, against time.

    Args:
        result: the run. spec: roles. ax: axes to draw on; None for a figure of its own.

    Returns:
        The axes.
    """
    ax = axes_or_new(ax)
    true = recorded(result, spec.true_position)
    ax.axhline(0.0, color=MARK, linewidth=0.7, zorder=1)
    for train in spec.other_trains:
        position = estimate(result, train, "position")
        if position is not None and true is not None:
            line = observer_line(spec.other_trains, train)
            curve(ax, result.time, bounded(position) - bounded(true), None, label=label(spec, train), **line)
    ax.set_ylabel("Ahead of the true train [m]")
    time_axis(ax, result)
    legend_above(ax)
    return ax


class OtherTrainsPanel(Panel):
    """Other trains of the run."""

    name = "other_trains"
    title = "Other trains"
    caption = "How far the other trains of the run are ahead of the one that is observed."
    place = 3.5

    @staticmethod
    def draw(result: Result, spec: ReportSpec, ax: Axes | None) -> Axes:  # noqa: D102 - see Panel
        return other_trains_figure(result, spec, ax)

    @staticmethod
    def available(result: Result, spec: ReportSpec) -> bool:  # noqa: D102 - see Panel
        found = [estimate(result, train, "position") for train in spec.other_trains]
        return recorded(result, spec.true_position) is not None and any(position is not None for position in found)
