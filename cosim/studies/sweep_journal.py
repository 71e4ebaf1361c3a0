"""The journal of a sweep: a line for each run as soon as it is done, from which a later one goes on. Touches that file
only.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from math import nan
from pathlib import Path
from typing import Any, Literal

from cosim.errors import OutputError
from cosim.results.summary_file import restored
from cosim.scenario.saving import scenario_text
from cosim.studies.runnable import RunnableScenario
from cosim.studies.sampling_plans import Variation
from cosim.studies.sweep_runs import SweepRun
from fmus.tables.plain_data import jsonable
from plant_models.user_file import option_files

JOURNAL = "runs.jsonl"


class SweepJournal:
    """The file ``runs.jsonl`` in the folder of a sweep.

    Args:
        directory: the folder; created where it does not exist. variations: the values that each run changes, by name.
        varied: gives the scenario of a run by the number of its variation.
    """

    def __init__(
        self, directory: Path, variations: Sequence[Variation], varied: Callable[[int], RunnableScenario]
    ) -> None:
        self.path = directory / JOURNAL
        self._variations, self._varied = variations, varied

    def read(self) -> dict[int, SweepRun]:
        """The runs of an earlier sweep that are runs of this one as well, by number in this one; those that failed left
        out. A last line that was cut off is no run.

        Raises:
            OutputError: the file cannot be read.
        """
        entries = {entry["key"]: entry for entry in read_lines(self.path)}
        known = {number: entries.get(self.key(number)) for number in range(len(self._variations))} if entries else {}
        return {
            number: self._run(number, entry)
            for number, entry in known.items()
            if entry is not None and entry["failure"] is None
        }

    def begin(self, runs: Iterable[SweepRun]) -> None:
        """Write the file anew with the runs that are done already.

        Args:
            runs: of an earlier sweep.

        Raises:
            OutputError: the file cannot be written.
        """
        write_lines(self.path, "w", map(self._entry, runs))

    def add(self, run: SweepRun) -> None:
        """Add a run.

        Args:
            run: with its measures.

        Raises:
            OutputError: the file cannot be written.
        """
        write_lines(self.path, "a", [self._entry(run)])

    def key(self, number: int) -> str:
        """What a run follows from: the text of its scenario, and size and age of the files it names.

        Args:
            number: of the variation.
        """
        return scenario_key(self._varied(number))

    def _entry(self, run: SweepRun) -> dict[str, Any]:
        return {
            "key": self.key(run.number),
            "settings": dict(run.settings),
            "measures": dict(run.measures),
            "failure": run.failure,
            "faults": list(run.faults),
            "folder": None if run.folder is None else str(run.folder),
        }

    def _run(self, number: int, entry: dict[str, Any]) -> SweepRun:
        measures = {name: nan if value is None else float(value) for name, value in entry["measures"].items()}
        folder = None if entry["folder"] is None else Path(entry["folder"])
        settings = self._variations[number]
        return SweepRun(number, settings, None, None, measures, tuple(entry["faults"]), folder)


def scenario_key(scenario: RunnableScenario) -> str:
    """What a run follows from: the text of its scenario, and size and age of the files it names, as a digest.

    Args:
        scenario: of the run.
    """
    digest = hashlib.sha256(scenario_text(scenario.table(), scenario.folder).encode())
    for place in _files(scenario):
        digest.update(f"{place} {place.stat().st_size} {place.stat().st_mtime_ns}".encode())
    return digest.hexdigest()


def read_lines(path: Path) -> list[dict[str, Any]]:
    """The entries of a journal, in order; none where there is no file. A last line that was cut off is no entry.

    Args:
        path: of the file.

    Raises:
        OutputError: the file cannot be read.
    """
    try:
        lines = path.read_text(encoding="utf-8").splitlines() if path.is_file() else []
    except OSError as error:
        raise OutputError(f"{path} cannot be read: {error.strerror or error}.") from error
    entries: list[dict[str, Any]] = []
    for line in lines:
        with suppress(json.JSONDecodeError):
            entries.append(restored(json.loads(line)))
    return entries


def write_lines(path: Path, mode: Literal["a", "w"], entries: Iterable[dict[str, Any]]) -> None:
    """Write entries of a journal, one a line.

    Args:
        path: of the file; its folder is created where it does not exist. mode: ``w`` anew, ``a`` behind what is there.
        entries: plain data.

    Raises:
        OutputError: the file cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open(mode, encoding="utf-8") as file:
            file.writelines(json.dumps(jsonable(entry), allow_nan=False) + "\n" for entry in entries)
    except OSError as error:
        raise OutputError(f"{path} cannot be written: {error.strerror or error}.") from error


def _files(scenario: RunnableScenario) -> list[Path]:
    """Files that the components are made from."""
    tables = scenario.table().components.values()
    named = [
        str(entry)
        for table in tables
        for entry in (table.fmu, table.recording, table.model, table.observer, *option_files(table.options).values())
        if entry
    ]
    places = [scenario.folder / name.partition(".py:")[0] for name in named]
    python = [place.with_name(f"{place.name}.py") for place in places]
    return sorted(place for place in (*places, *python) if place.is_file())
