"""Tuning as files: the tuned scenario, an overlay with the values, data, and a page of how it went. Touches only the
folder that it writes.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import tomli_w

from cosim.errors import OutputError
from cosim.report.live.render import live_page
from cosim.report.page.page_files import page_bytes
from cosim.report.page.picture_files import Pictures, picture_kind, write_pictures
from cosim.results.results_folder import FIGURES
from cosim.scenario.override import override
from cosim.tuning.tuning_page import tuning_page
from fmus.tables.plain_data import jsonable

if TYPE_CHECKING:
    from cosim.tuning.tuning_result import Tuning

SCENARIO, OVERLAY, DATA, PAGE = "tuned.toml", "overlay.toml", "tuning.json", "tuning.html"


def write_tuning(tuning: Tuning, settings: dict[str, object], directory: Path) -> dict[str, Path]:
    """Write what tuning found.

    Args:
        tuning: what was found. settings: the best values by the names of `Scenario.set`. directory: the folder.

    Returns:
        Paths by kind: ``scenario``, ``overlay``, ``data``, ``page``.

    Raises:
        OutputError: it cannot be written.
    """
    paths = {
        "scenario": directory / SCENARIO,
        "overlay": directory / OVERLAY,
        "data": directory / DATA,
        "page": directory / PAGE,
    }
    try:
        tuning.scenario.save(paths["scenario"])
        head = f"# {tuning.method}: {tuning.cost}; include this file behind the scenario\n"
        paths["overlay"].write_text(head + tomli_w.dumps(_tables(tuning, settings)), encoding="utf-8")
        data = json.dumps(jsonable(tuning.to_data()), indent=2, allow_nan=False) + "\n"
        paths["data"].write_text(data, encoding="utf-8")
        paths["page"].write_bytes(page_bytes(live_page(tuning_page(tuning))))
    except OSError as error:
        raise OutputError(f"{directory} cannot be written: {error.strerror or error}.") from error
    return paths


def write_figures(tuning: Tuning, directory: Path, figures: Pictures) -> dict[str, Path]:
    """Write a picture of the convergence to ``figures/``; its path by name.

    Args:
        tuning: what was found. directory: the folder. figures: see `Pictures`; False for none.

    Raises:
        OutputError: the folder cannot be written.
    """
    if not figures:
        return {}
    from cosim.tuning.tuning_drawing import draw_convergence  # noqa: PLC0415 - matplotlib only for those who draw

    kind = picture_kind(figures)
    return write_pictures(draw_convergence(tuning, kind), directory / FIGURES, kind, "convergence")


def _tables(tuning: Tuning, settings: dict[str, object]) -> dict[str, Any]:
    """The settings as the tables of a scenario file."""
    tables: dict[str, Any] = {"components": {name: {} for name in tuning.scenario.table().components}}
    for name, value in settings.items():
        override(tables, name, value)
    tables["components"] = {name: entries for name, entries in tables["components"].items() if entries}
    return tables
