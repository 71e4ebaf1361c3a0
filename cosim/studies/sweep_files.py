"""A sweep as files: a results folder for each run, and an index of all. Touches only the folder it is given."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cosim.errors import OutputError
from cosim.report.live.render import live_page
from cosim.report.page.page_files import page_bytes
from cosim.report.page.picture_files import Pictures, picture_kind, write_numbered
from cosim.results.results_folder import FIGURES
from cosim.studies.live_sweep import sweep_page
from cosim.studies.warnings_of_runs import PAGE
from fmus.tables.plain_data import jsonable

if TYPE_CHECKING:
    from cosim.run.outcome import Outcome
    from cosim.studies.sweep_runs import SweepRun, SweepRuns

_INDEX_CSV, _INDEX_JSON = "index.csv", "index.json"
MOST_PAGES = 60
"""Runs of a sweep up to which each has a page of its own; of others `cosim open` makes it."""


def run_folder(number: int) -> str:
    """Name of a run's folder.

    Args:
        number: of the run.
    """
    return f"run_{number:03d}"


def write_outcome(outcome: Outcome, settings: Mapping[str, Any], folder: Path, *, report: bool) -> None:
    """Write the results of a run.

    Args:
        outcome: of the run. settings: that were changed. folder: of this run. report: whether its page is written.

    Raises:
        OutputError: the folder cannot be written.
    """
    outcome.with_summary(sweep_settings=dict(settings)).write(folder, report=report)


@dataclass(frozen=True)
class WrittenRun:
    """What is taken of an outcome where it was run; its results are written there, so that its rows need not travel and
    workers write side by side.

    Args:
        take: of the outcome. settings, folder, report: as for `write_outcome`.
    """

    take: Callable[[Outcome], Any]
    settings: Mapping[str, Any]
    folder: Path
    report: bool

    def __call__(self, outcome: Outcome) -> Any:
        """What is taken; the error, where the results cannot be written, which ends the study and not this run alone.

        Args:
            outcome: of the run.
        """
        try:
            write_outcome(outcome, self.settings, self.folder, report=self.report)
        except OutputError as error:
            return error
        return self.take(outcome)


def write_sweep(result: SweepRuns, directory: Path) -> dict[str, Path]:
    """Write all runs that are in memory, the index and a page; paths by kind.

    Args:
        result, directory: as of `write_index`, with its errors.
    """
    runs = list(result.runs)
    for place, run in enumerate(runs):
        if run.outcome is not None:
            runs[place] = replace(run, folder=directory / run_folder(run.number))
            folder = directory / run_folder(run.number)
            write_outcome(run.outcome, run.settings, folder, report=len(runs) <= MOST_PAGES)
    return write_index(replace(result, runs=runs), directory)


def write_index(result: SweepRuns, directory: Path) -> dict[str, Path]:
    """Write the table as CSV, as JSON and as a page to explore; paths by kind.

    Args:
        result: the runs.
        directory: the folder; created where it does not exist.

    Raises:
        OutputError: the folder cannot be written.
    """
    paths = {"csv": directory / _INDEX_CSV, "json": directory / _INDEX_JSON}
    rows = [row | {"folder": _folder(run, directory)} for row, run in zip(result.table(), result.runs, strict=True)]
    try:
        directory.mkdir(parents=True, exist_ok=True)
        _write_csv(paths["csv"], rows)
        data = {
            "scenario": result.scenario.name,
            "varied": list(result.names),
            "warnings": [warning.to_data() for warning in result.warnings],
            "runs": [_entry(r, directory) for r in result.runs],
        }
        paths["json"].write_text(json.dumps(jsonable(data), indent=2, allow_nan=False) + "\n", encoding="utf-8")
        paths["page"] = directory / PAGE
        paths["page"].write_bytes(page_bytes(live_page(sweep_page(result, directory))))
    except OSError as error:
        raise OutputError(f"The sweep cannot be written to {directory}: {error.strerror or error}.") from error
    return paths


def write_figures(result: SweepRuns, directory: Path, figures: Pictures) -> dict[str, Path]:
    """Write a picture for each measure that tables show to ``figures/``; paths by measure.

    Args:
        result: the runs. directory: of the sweep. figures: see `Pictures`; False for none.

    Raises:
        OutputError: the folder cannot be written.
    """
    if not figures:
        return {}
    from cosim.studies.sweep_drawing import draw_measures  # noqa: PLC0415 - matplotlib only for those who draw

    kind = picture_kind(figures)
    return write_numbered(draw_measures(result, kind), directory / FIGURES, kind)


def _write_csv(path: Path, rows: list[dict[str, Any]]) -> None:
    with path.open("w", newline="", encoding="utf-8", errors="backslashreplace") as file:
        writer = csv.DictWriter(file, list(rows[0]) if rows else ["run"], lineterminator="\n")
        writer.writeheader()
        writer.writerows({key: "" if value is None else value for key, value in row.items()} for row in rows)


def _entry(run: SweepRun, directory: Path) -> dict[str, Any]:
    return {
        "run": run.number,
        "folder": _folder(run, directory),
        "settings": dict(run.settings),
        "measures": dict(run.measures),
        "failure": run.failure,
        "faults": list(run.faults),
        "warnings": list(run.warnings),
    }


def _folder(run: SweepRun, directory: Path) -> str | None:
    """Its folder as seen from the index."""
    if run.folder is None:
        return None
    return run.folder.name if run.folder.parent == directory else str(run.folder)
