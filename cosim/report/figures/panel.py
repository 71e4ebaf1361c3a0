"""What a figure of the report is: a name, a title, a caption, whether a run has it, and how it is drawn."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

from matplotlib.axes import Axes

from cosim.evaluation.roles import estimate
from cosim.evaluation.spec import ReportSpec
from cosim.results.result import Result


class Panel(ABC):
    """A figure of the report. A class of it in a file of this room is in the report of each run that has it.

    Attributes:
        name: stem of its file name. title: short. caption: what to see in it.
        place: where it stands in the report, from small to large.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    caption: ClassVar[str]
    place: ClassVar[float] = 100.0

    def __init_subclass__(cls) -> None:
        lacking = [word for word in ("title", "caption") if "name" in vars(cls) and not hasattr(cls, word)]
        if lacking:
            raise TypeError(
                f"the figure {cls.__name__} has no {' and no '.join(lacking)}; write it as a class attribute"
            )

    @staticmethod
    @abstractmethod
    def draw(result: Result, spec: ReportSpec, ax: Axes | None) -> Axes:
        """Draw it.

        Args:
            result: the run. spec: roles of its signals. ax: axes to draw on; None for a figure of its own.

        Returns:
            The axes.
        """

    @staticmethod
    @abstractmethod
    def available(result: Result, spec: ReportSpec) -> bool:
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
