"""Colours, dashes and fonts of all figures, and the canvas they are drawn on. Touches no global state of matplotlib.

Colours are those of Okabe and Ito, which colour-blind people can tell apart; each comes with a dash pattern, so that
the lines can be told apart on grey paper as well.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import wraps
from io import BytesIO
from typing import Any, ParamSpec, TypeVar

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure, SubFigure

P = ParamSpec("P")
T = TypeVar("T")

OBSERVER_LINES: tuple[dict[str, Any], ...] = (
    {"color": "#0072B2", "linestyle": "-", "linewidth": 1.5},
    {"color": "#D55E00", "linestyle": (0, (6, 1.5)), "linewidth": 1.5},
    {"color": "#009E73", "linestyle": (0, (1.2, 1.0)), "linewidth": 1.9},
    {"color": "#CC79A7", "linestyle": (0, (5, 1.2, 1.2, 1.2)), "linewidth": 1.5},
    {"color": "#E69F00", "linestyle": (0, (9, 3)), "linewidth": 1.5},
    {"color": "#56B4E9", "linestyle": (0, (4, 1.2, 1.2, 1.2, 1.2, 1.2)), "linewidth": 1.5},
)
# a band, on which the estimates lie
TRUE_LINE: dict[str, Any] = {"color": "#B4B4B4", "linestyle": "-", "linewidth": 5.0}
ODOMETER_LINE: dict[str, Any] = {"color": "#000000", "linestyle": "-", "linewidth": 0.8}
REFERENCE_LINE: dict[str, Any] = {"color": "#000000", "linestyle": (0, (1, 3)), "linewidth": 1.2}
TRUE_LINE_ABOVE: dict[str, Any] = {"color": "#000000", "linestyle": "-", "linewidth": 1.3, "zorder": 2.5}  # over noise
NOISY_LINE: dict[str, Any] = {"linestyle": "-", "linewidth": 0.5, "alpha": 0.55, "zorder": 1.6}
WILD_LINE: dict[str, Any] = {"linewidth": 0.6, "alpha": 0.6, "zorder": 1.2}  # a diverged curve stays behind the others
ZONE_COLOUR = "#DCE9F2"
ALARM_COLOUR = "#B00020"

PANEL_SIZE = (8.2, 3.4)  # inches
DPI = 130  # dots per inch

RC: dict[str, Any] = {
    "font.family": "DejaVu Sans",  # the font that comes with matplotlib, so that pictures look the same everywhere
    "font.size": 9.5,
    "axes.labelsize": 9.5,
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
    "legend.fontsize": 8.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#E3E3E3",
    "grid.linewidth": 0.6,
    "axes.unicode_minus": True,
    "text.usetex": False,
    "savefig.bbox": None,
}


def styled(function: Callable[P, T]) -> Callable[P, T]:
    """Run a drawing function under our style and leave the caller's as it was."""

    @wraps(function)
    def run(*args: P.args, **kwargs: P.kwargs) -> T:
        with rc_context(RC):
            return function(*args, **kwargs)

    return run


def observer_line(observers: Sequence[str], observer: str) -> dict[str, Any]:
    """Colour, dashes and width of an observer: by its place among all observers, the same in every figure."""
    return dict(OBSERVER_LINES[list(observers).index(observer) % len(OBSERVER_LINES)])


def run_line(index: int) -> dict[str, Any]:
    """Colour, dashes and width of a run among others: the first lies broad below, later ones are told apart by both."""
    if index == 0:
        return dict(OBSERVER_LINES[0]) | {"linewidth": 2.6, "alpha": 0.75, "zorder": 1.9}
    count = len(OBSERVER_LINES)
    dashed = [line["linestyle"] for line in OBSERVER_LINES[1:]]
    colour = OBSERVER_LINES[index % count]
    return {"color": colour["color"], "linestyle": dashed[(index - 1 + index // count) % len(dashed)], "linewidth": 1.5}


def new_figure(size: tuple[float, float] = PANEL_SIZE) -> Figure:
    """An empty figure on a canvas of its own, without pyplot.

    Args:
        size: width and height [inch].
    """
    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def axes_or_new(ax: Axes | None, size: tuple[float, float] = PANEL_SIZE) -> Axes:
    """The axes given, or those of a new figure."""
    return ax if ax is not None else new_figure(size).add_subplot()


def png(figure: Figure | SubFigure, dpi: int = DPI) -> bytes:
    """A figure as PNG, without time stamps, so that equal figures are equal bytes.

    Args:
        figure: the figure, or a part of it.
        dpi: resolution [1/inch].

    Returns:
        The picture, as the bytes of a file.
    """
    buffer = BytesIO()
    metadata: dict[str, Any] = {"Software": None}
    whole = figure.get_figure(root=True)
    assert whole is not None
    whole.savefig(buffer, format="png", dpi=dpi, metadata=metadata, facecolor="white")
    return buffer.getvalue()
