"""Tuning as files: the tuned scenario, an overlay with the values, data, and a picture of the convergence. Touches only
the folder that it writes.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import tomli_w

from cosim.drawing.style import OBSERVER_LINES, axes_or_new, png, styled
from cosim.errors import OutputError
from cosim.scenario.override import override
from fmus.tables.plain_data import jsonable

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from cosim.tuning.tuning_result import Tuning

SCENARIO, OVERLAY, DATA, PICTURE = "tuned.toml", "overlay.toml", "tuning.json", "convergence.png"


def write_tuning(tuning: Tuning, settings: dict[str, object], directory: Path) -> dict[str, Path]:
    """Write what tuning found.

    Args:
        tuning: what was found. settings: the best values by the names of `Scenario.set`. directory: the folder.

    Returns:
        Paths by kind: ``scenario``, ``overlay``, ``data``, ``picture``.

    Raises:
        OutputError: it cannot be written.
    """
    paths = {
        "scenario": directory / SCENARIO,
        "overlay": directory / OVERLAY,
        "data": directory / DATA,
        "picture": directory / PICTURE,
    }
    try:
        tuning.scenario.save(paths["scenario"])
        head = f"# {tuning.method}: {tuning.cost}; include this file behind the scenario\n"
        paths["overlay"].write_text(head + tomli_w.dumps(_tables(tuning, settings)), encoding="utf-8")
        data = json.dumps(jsonable(tuning.to_data()), indent=2, allow_nan=False) + "\n"
        paths["data"].write_text(data, encoding="utf-8")
        paths["picture"].write_bytes(png(convergence_figure(tuning).figure))
    except OSError as error:
        raise OutputError(f"{directory} cannot be written: {error.strerror or error}.") from error
    return paths


def _tables(tuning: Tuning, settings: dict[str, object]) -> dict[str, Any]:
    """The settings as the tables of a scenario file."""
    tables: dict[str, Any] = {"components": {name: {} for name in tuning.scenario.table().components}}
    for name, value in settings.items():
        override(tables, name, value)
    tables["components"] = {name: entries for name, entries in tables["components"].items() if entries}
    return tables


@styled
def convergence_figure(tuning: Tuning, ax: Axes | None = None) -> Axes:
    """Best cost over the number of candidates, one line a search, the cost before as a level.

    Args:
        tuning: what was found. ax: axes to draw on; None for a figure of its own.
    """
    ax = axes_or_new(ax, (7.0, 3.6))
    for place, search in enumerate(tuning.searches):
        style = OBSERVER_LINES[place % len(OBSERVER_LINES)]
        ax.step(search.evaluations, search.costs, where="post", label=f"search {search.seed}", **style)
    before = sum(tuning.before) / len(tuning.before)
    ax.axhline(before, color="black", linewidth=0.8, label="before")
    if min([before, *(cost for search in tuning.searches for cost in search.costs)]) > 0.0:
        ax.set_yscale("log")
    ax.set_xlabel("Candidates")
    ax.set_ylabel("Cost")
    ax.set_title(tuning.cost, fontsize="medium")  # too long for the side of the axes
    ax.legend()
    return ax
