"""Colours, dashes and fonts of all figures, and the canvas they are drawn on. Touches no global state of matplotlib.

Colours are those of Okabe and Ito, which colour-blind people can distinguish; each comes with a dash pattern, so that
the lines can be distinguished on grey paper as well.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import wraps
from io import BytesIO, StringIO
from typing import Any, ParamSpec, TypeVar

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure, SubFigure
from matplotlib.rcsetup import cycler

P = ParamSpec("P")
T = TypeVar("T")

BLUE, VERMILION, GREEN, _PURPLE, _ORANGE, _SKY = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9"
SLATE, VIOLET, AMBER = "#33475B", "#7A4FA3", "#F0C36D"
BLACK, INK, QUIET, MARK = "#000000", "#1B1B1B", "#5F5F5F", "#777777"  # lines; texts; what explains; what is no curve
EDGE, GAP, BAND, GRID = "#9A9A9A", "#A9A9A9", "#B4B4B4", "#E3E3E3"  # frames; areas; the true values; the grid
PALE, PALE_BLUE, PALE_YELLOW, PALE_RED, WHITE = "#F4F4F4", "#E8EFF6", "#F7F2E4", "#FBECEE", "#FFFFFF"  # areas
ALARM, ZONE = "#B00020", "#DCE9F2"  # what went wrong; zones of low adhesion

OBSERVER_LINES: tuple[dict[str, Any], ...] = (
    {"color": BLUE, "linestyle": "-", "linewidth": 1.5},
    {"color": VERMILION, "linestyle": (0, (6, 1.5)), "linewidth": 1.5},
    {"color": GREEN, "linestyle": (0, (1.2, 1.0)), "linewidth": 1.9},
    {"color": _PURPLE, "linestyle": (0, (5, 1.2, 1.2, 1.2)), "linewidth": 1.5},
    {"color": _ORANGE, "linestyle": (0, (9, 3)), "linewidth": 1.5},
    {"color": _SKY, "linestyle": (0, (4, 1.2, 1.2, 1.2, 1.2, 1.2)), "linewidth": 1.5},
)
# a band, on which all others lie; above it what is measured, then the estimates, noisy ones too
TRUE_LINE: dict[str, Any] = {"color": BAND, "linestyle": "-", "linewidth": 5.0, "zorder": 1.3}
ODOMETER_LINE: dict[str, Any] = {"color": BLACK, "linestyle": "-", "linewidth": 0.8, "zorder": 1.4}
REFERENCE_LINE: dict[str, Any] = {"color": BLACK, "linestyle": (0, (1, 3)), "linewidth": 1.2}
TRUE_LINE_ABOVE: dict[str, Any] = {"color": BLACK, "linestyle": "-", "linewidth": 1.3, "zorder": 2.5}  # over noise
NOISY_LINE: dict[str, Any] = {"linestyle": "-", "linewidth": 0.5, "alpha": 0.55, "zorder": 1.6}
WILD_LINE: dict[str, Any] = {"linewidth": 0.6, "alpha": 0.6, "zorder": 1.2}  # a diverged curve stays behind the others

PANEL_SIZE = (8.2, 3.4)  # inches
HEADLINE = 11.5  # font size [pt]
_DPI = 130  # dots per inch
TIME = "Time [s]"  # on the axis of every curve against time

RC: dict[str, Any] = {
    "font.family": "DejaVu Sans",  # the font that comes with matplotlib, so that pictures look the same everywhere
    "font.size": 9.5,
    "axes.labelsize": 9.5,
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
    "legend.fontsize": 8.5,
    "axes.prop_cycle": cycler(color=[line["color"] for line in OBSERVER_LINES]),
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    "axes.unicode_minus": True,
    "text.usetex": False,
    "savefig.bbox": None,
}


def styled(function: Callable[P, T]) -> Callable[P, T]:
    """Run a drawing function under our style and leave the caller's as it was.

    Args:
        function: draws something with matplotlib.

    Returns:
        A function with the same arguments.
    """

    @wraps(function)
    def run(*args: P.args, **kwargs: P.kwargs) -> T:
        with rc_context(RC):
            return function(*args, **kwargs)

    return run


def observer_line(observers: Sequence[str], observer: str) -> dict[str, Any]:
    """Colour, dashes and width of an observer: by its place among all observers, the same in every figure.

    Beyond the sixth observer colours come again, with other dashes.

    Args:
        observers: names of all observers of a run.
        observer: name of the one to draw.

    Returns:
        Arguments of ``Axes.plot``.
    """
    index, count = list(observers).index(observer), len(OBSERVER_LINES)
    dashed = OBSERVER_LINES[(index + index // count) % count]
    return {**dashed, "color": OBSERVER_LINES[index % count]["color"]}


def run_line(index: int) -> dict[str, Any]:
    """Colour, dashes and width of a run among others: the first lies broad below, later ones are distinguished by both.

    Args:
        index: place of the run, from 0.

    Returns:
        Arguments of ``Axes.plot``.
    """
    if index == 0:
        return dict(OBSERVER_LINES[0]) | {"linewidth": 2.6, "alpha": 0.75, "zorder": 1.9}
    count = len(OBSERVER_LINES)
    dashed = [line["linestyle"] for line in OBSERVER_LINES[1:]]
    colour = OBSERVER_LINES[index % count]
    return {"color": colour["color"], "linestyle": dashed[(index - 1 + index // count) % len(dashed)], "linewidth": 1.5}


class _NotebookFigure(Figure):
    """A figure that a notebook shows where it is the value of a cell; pyplot shows only its own."""

    def _repr_png_(self) -> bytes:
        return png(self)


class _NotebookAxes(Axes):
    """Axes whose figure a notebook shows where they are the value of a cell."""

    def _repr_png_(self) -> bytes:
        return png(self.figure)


def new_figure(size: tuple[float, float] = PANEL_SIZE) -> Figure:
    """An empty figure on a canvas of its own, without pyplot.

    Args:
        size: width and height [inch].

    Returns:
        The figure.
    """
    figure = _NotebookFigure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def headline(figure: Figure, text: str) -> None:
    """A title over a figure of several panels.

    Args:
        figure: the figure.
        text: the title.
    """
    figure.suptitle(text, fontsize=HEADLINE, fontweight="bold", x=0.01, ha="left")


def axes_or_new(ax: Axes | None, size: tuple[float, float] = PANEL_SIZE) -> Axes:
    """The axes given, or those of a new figure.

    Args:
        ax: axes, or None.
        size: width and height of a new figure [inch].
    """
    return ax if ax is not None else new_figure(size).add_subplot(axes_class=_NotebookAxes)


def png(figure: Figure | SubFigure, dpi: int = _DPI) -> bytes:
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
    before = whole.canvas, whole.dpi, whole.get_facecolor()
    try:
        canvas = FigureCanvasAgg(whole)
        whole.set(dpi=dpi, facecolor="white")
        canvas.print_png(buffer, metadata=metadata)  # `savefig` would draw it twice, once for the layout alone
    finally:
        whole.set_canvas(before[0])
        whole.set(dpi=before[1], facecolor=before[2])
    return buffer.getvalue()


def picture(figure: Figure | SubFigure, kind: str) -> bytes:
    """A figure as a file.

    Args:
        figure: the figure, or a part of it.
        kind: ``png`` or ``svg``, in which texts stay texts.
    """
    return _svg(figure) if kind == "svg" else png(figure)


def _svg(figure: Figure | SubFigure) -> bytes:
    """A figure as SVG; equal figures are equal bytes."""
    whole = figure.get_figure(root=True)
    assert whole is not None
    before, buffer = (whole.canvas, whole.get_facecolor()), StringIO()
    try:
        whole.set(facecolor="white")
        with rc_context({"svg.hashsalt": "figure", "svg.fonttype": "none"}):
            FigureCanvasSVG(whole).print_svg(buffer, metadata={"Date": None, "Creator": None})
    finally:
        whole.set_canvas(before[0])
        whole.set(facecolor=before[1])
    return buffer.getvalue().encode("utf-8")
