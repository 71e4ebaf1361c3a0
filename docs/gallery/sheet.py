"""A sheet of the gallery: what was published and what an independent implementation gave beside what is measured here,
with a reason where they differ, and a figure.

Used by the numbered scripts of the folders here, one folder a thesis. A script makes one sheet and ends with
``sheet.finish()``, which prints the table and leaves ``NN_name.json`` and ``NN_name.png`` in the folder given by
``--out``, or in ``results/gallery/FOLDER``.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterable
from math import isfinite
from pathlib import Path
from typing import Any

import matplotlib as mpl
from shared.line import EQUAL_WITHIN, Line, table
from shared.small_picture import save_small

from cosim.drawing.style import RC
from fmus.tables.table import Table, text_column

mpl.use("Agg")
mpl.rcParams.update(RC)


class Sheet:
    """Collects lines and a figure of one script.

    Args:
        script: the script's ``__file__``. title: of the page. source: figures, tables or equations of the thesis it is
        about.
    """

    def __init__(self, script: str, title: str, source: str) -> None:
        place = Path(script).resolve()
        self.name = place.stem
        self.title, self.source = title, source
        self.lines: list[Line] = []
        parser = argparse.ArgumentParser(description=title)
        usual = Path("results/gallery") / place.parent.name
        parser.add_argument("--out", type=Path, default=usual, help="folder for the table and the figure")
        self.out: Path = parser.parse_args().out

    def add(
        self,
        quantity: str,
        unit: str,
        published: float | str | None,
        measured: float | str,
        why: str = "",
        *,
        repeats: float = EQUAL_WITHIN,
        independent: float | str | None = None,
    ) -> None:
        """Add a line; see `Line`.

        Raises:
            ValueError: the measured number is not finite, or a reason is missing.
        """
        number = measured if isinstance(measured, str) else float(measured)
        line = Line(quantity, unit, published, number, why, repeats, independent)
        if not isinstance(number, str) and not isfinite(number):
            raise ValueError(f"{self.name}: {quantity} is {number}.")
        if line.differs() and not why:
            beside = f"published {published}" + ("" if independent is None else f", independent {independent}")
            raise ValueError(f"{self.name}: {quantity}: measured {number}, {beside}; give the reason.")
        self.lines.append(line)

    def finish(self, figure: Any = None, *axes: Any, grids: Iterable[Any] = (), fontsize: float = 8.0) -> None:
        """Print the table and write both files.

        Args:
            figure: a matplotlib figure, or None for a table alone. axes: those of its axes that get a light grid and a
            legend. grids: further ones that get the grid alone. fontsize: of the legends [pt].
        """
        for axis in axes:
            axis.legend(fontsize=fontsize)
        for axis in (*axes, *grids):
            axis.grid(alpha=0.3)
        self.out.mkdir(parents=True, exist_ok=True)
        print(f"{self.title} ({self.source})\n\n{sheet_text(self.lines)}")
        content = {"title": self.title, "source": self.source, "figure": figure is not None}
        content["lines"] = [line.content() for line in self.lines]
        (self.out / f"{self.name}.json").write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
        if figure is not None:
            save_small(figure, self.out / f"{self.name}.png")


def sheet_text(lines: list[Line]) -> str:
    """The lines as aligned text, reasons below."""
    headings, *rows = table([line.content() for line in lines])
    reasons = dict.fromkeys(line.why for line in lines if line.why)
    columns = [text_column(heading, heading) for heading in headings]
    return Table("lines", columns, rows, notes=[f"- {reason}" for reason in reasons]).text()
