"""One style of drawing: colours stand in one room, figures leave the caller's settings alone, equal figures are equal
bytes.
"""

from __future__ import annotations

import re
from io import BytesIO
from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure

import cosim
from cosim.drawing.style import OBSERVER_LINES, new_figure, png, styled

ROOM = Path(cosim.__file__).parent


def test_no_figure_has_colours_of_its_own() -> None:
    colour = re.compile(r"""["']#[0-9A-Fa-f]{3,8}["']""")
    drawing = {path for path in ROOM.rglob("*.py") if "matplotlib" in path.read_text(encoding="utf-8")}
    assert len(drawing) > 10
    own = {
        str(path.relative_to(ROOM)): found
        for path in drawing - {ROOM / "drawing" / "style.py"}
        if (found := colour.findall(path.read_text(encoding="utf-8")))
    }
    assert own == {}


def test_no_two_observers_have_equal_colours_or_equal_dashes() -> None:
    for key in ("color", "linestyle"):
        assert len({str(line[key]) for line in OBSERVER_LINES}) == len(OBSERVER_LINES)


def test_equal_figures_are_equal_bytes_and_the_settings_of_the_caller_stay() -> None:
    @styled
    def draw() -> bytes:
        assert mpl.rcParams["axes.spines.top"] is False
        figure = new_figure((2.0, 1.0))
        figure.add_subplot().plot([0.0, 1.0], [1.0, 0.0])
        return png(figure)

    before = dict(mpl.rcParams)
    assert draw() == draw()
    assert dict(mpl.rcParams) == before


def test_a_picture_drawn_once_is_that_of_savefig_and_the_figure_stays_as_it_was() -> None:
    def figure() -> Figure:
        made = new_figure((3.0, 2.0))
        made.set_facecolor("yellow")
        axes = made.add_subplot()
        axes.plot([0.0, 1.0], [0.0, 1e5], label="a")
        axes.legend()
        axes.set_xlabel("time [s]")
        return made

    twice, once, file = figure(), figure(), BytesIO()
    twice.savefig(file, format="png", dpi=90, metadata={"Software": None}, facecolor="white")
    before = once.canvas, once.dpi, once.get_facecolor()
    assert png(once, 90) == file.getvalue()
    assert (once.canvas, once.dpi, once.get_facecolor()) == before
