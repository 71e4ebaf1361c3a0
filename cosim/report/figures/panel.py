"""What a figure of the report is: a name, a title, a caption, whether a run has it, and how it is drawn."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

from matplotlib.axes import Axes

from cosim.drawing.style import PANEL_SIZE, TIME, axes_or_new, styled
from cosim.evaluation.roles import estimate
from cosim.evaluation.spec import ReportSpec
from cosim.report.figures.drawing import legend_above
from cosim.results.result import Result


class Panel(ABC):
    """A figure of the report. A class of it in a file of this room is in the report of each run that has it.

    Attributes:
        name: stem of its file name. title: short. caption: what to see in it.
        place: where it stands in the report, from small to large. size: of a figure of its own [inch].
        over_time: its abscissa is the time of the run.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    caption: ClassVar[str]
    place: ClassVar[float] = 100.0
    size: ClassVar[tuple[float, float]] = PANEL_SIZE
    over_time: ClassVar[bool] = True

    def __init_subclass__(cls) -> None:
        lacking = [word for word in ("title", "caption") if "name" in vars(cls) and not hasattr(cls, word)]
        if lacking:
            raise TypeError(
                f"the figure {cls.__name__} has no {' and no '.join(lacking)}; write it as a class attribute"
            )

    @classmethod
    @styled
    def draw(cls, result: Result, spec: ReportSpec, ax: Axes | None = None) -> Axes:
        """Draw it, with the legend above.

        Args:
            result: the run. spec: roles of its signals. ax: axes to draw on; None for a figure of its own.

        Returns:
            The axes.
        """
        ax = axes_or_new(ax, cls.size)
        cls.plot(result, spec, ax)
        if cls.over_time:
            _time_axis(ax, result)
        legend_above(ax)
        return ax

    @classmethod
    @abstractmethod
    def plot(cls, result: Result, spec: ReportSpec, ax: Axes) -> None:
        """Draw all but the legend and the axis of time.

        Args:
            result: the run. spec: roles of its signals. ax: axes to draw on.
        """

    @classmethod
    @abstractmethod
    def available(cls, result: Result, spec: ReportSpec) -> bool:
        """Whether a run has something to draw.

        Args:
            result: the run. spec: roles of its signals.
        """


def any_estimate(result: Result, spec: ReportSpec, *signals: str) -> bool:
    """Whether an observer of the report estimates one of these signals.

    Args:
        result: the run. spec: roles of its signals. signals: names of outputs.
    """
    return any(estimate(result, observer, signal) is not None for observer in spec.observers for signal in signals)


def _time_axis(ax: Axes, result: Result) -> None:
    """Label the time axis and give it the length of the run."""
    ax.set_xlabel(TIME)
    if len(result.time) and result.time[-1] > result.time[0]:
        ax.set_xlim(float(result.time[0]), float(result.time[-1]))
