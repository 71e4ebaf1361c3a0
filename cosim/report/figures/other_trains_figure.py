"""Figure of other trains of a run: how far each is from the true one. Draws on the axes it is given, or on its own."""

from __future__ import annotations

from matplotlib.axes import Axes

from cosim.drawing.style import MARK, observer_line
from cosim.evaluation.roles import estimate, label, recorded
from cosim.evaluation.spec import ReportSpec
from cosim.report.figures.drawing import curve
from cosim.report.figures.panel import Panel
from cosim.report.figures.scales import bounded
from cosim.results.result import Result


class OtherTrainsPanel(Panel):
    """Position of the other trains minus that of the true one in m, against time."""

    name = "other_trains"
    title = "Other trains"
    caption = "How far the other trains of the run are ahead of the one that is observed."
    place = 3.5

    @classmethod
    def plot(cls, result: Result, spec: ReportSpec, ax: Axes) -> None:  # noqa: D102 - see Panel
        true = recorded(result, spec.true_position)
        ax.axhline(0.0, color=MARK, linewidth=0.7, zorder=1)
        for train in spec.other_trains:
            position = estimate(result, train, "position")
            if position is not None and true is not None:
                line = observer_line(spec.other_trains, train)
                curve(ax, result.time, bounded(position) - bounded(true), None, label=label(spec, train), **line)
        ax.set_ylabel("Ahead of the true train [m]")

    @classmethod
    def available(cls, result: Result, spec: ReportSpec) -> bool:  # noqa: D102 - see Panel
        found = [estimate(result, train, "position") for train in spec.other_trains]
        return recorded(result, spec.true_position) is not None and any(position is not None for position in found)
