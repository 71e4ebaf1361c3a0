"""A sweep: one scenario run many times with some values changed: a study of `cosim.runs`. Touches the folder it is
given.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import nan
from pathlib import Path
from typing import Any

from cosim.errors import CosimError, OutputError, ScenarioError
from cosim.run.described_components import describe_component
from cosim.run.outcome import Outcome
from cosim.runs.engine import Done, run_jobs
from cosim.runs.executors import make_executor
from cosim.runs.job import Ended, Job
from cosim.runs.journal import Journal
from cosim.runs.keys import code_content
from cosim.runs.run import Run, whole
from cosim.runs.runnable import RunnableScenario
from cosim.scenario.override import CASE
from cosim.studies.distributions import Distribution
from cosim.studies.measures import Measure, error_measures, own_measures, setting_text
from cosim.studies.sampling_plans import Mode, Variation, variations
from cosim.studies.sweep_files import MOST_PAGES, WrittenRun, run_folder, write_index, write_outcome
from cosim.studies.sweep_result import SweepResult
from cosim.studies.sweep_runs import SweepRun
from fmus.cli.progress import Progress, Report, reported
from fmus.tables.table import FirstScreen, Parts, Table, name_column

Measures = Callable[[Outcome], Mapping[str, float]]


@dataclass(frozen=True)
class Sweep(FirstScreen):
    """A scenario and its variations, ready to run; made by `Scenario.vary`.

    Args:
        scenario: what is varied. variations: for each run the values that are changed, by name.
    """

    scenario: RunnableScenario
    variations: Sequence[Variation]

    def __len__(self) -> int:
        return len(self.variations)

    def first_screen(self) -> Parts:
        """How many runs there will be, and what is varied."""
        columns = [name_column(name, name, write=setting_text) for name in ("run", *self.names)]
        rows = [[k, *map(settings.get, self.names)] for k, settings in enumerate(self.variations)]
        varied = ", ".join(self.names) or "nothing"
        return [f"{len(self)} runs of {self.scenario.name}, varied: {varied}.", Table("variations", columns, rows)]

    @property
    def names(self) -> list[str]:
        """Names of what is varied, in order of appearance."""
        return list(dict.fromkeys(name for variation in self.variations for name in variation))

    def varied(self, number: int) -> RunnableScenario:
        """The scenario of one run.

        Args:
            number: of the variation, from 0.
        """
        return self.scenario.with_settings(self.variations[number])

    def each(
        self, workers: int = 1, progress: Report | None = None, scheduler: str | None = None
    ) -> Iterator[SweepRun]:
        """Run all variations and hand each over as soon as it is done, so that none needs to be kept.

        Args:
            workers: processes at a time; results do not depend on their number. A single one is this process, or where
                the scenario calls FMUs of others or sets ``master.call_timeout`` a process of its own, so that a run
                that crashes or hangs fails alone.
            progress: called with the number done and the number in all.
            scheduler: address of a scheduler of `dask.distributed` whose workers do the runs.

        Yields:
            The runs, as they end.

        Raises:
            ScenarioError: `workers` is less than 1. RunError: the cluster cannot be used.
            KeyboardInterrupt: a run was interrupted; it has been handed over.
        """
        jobs = self._jobs(lambda *_: whole, "")
        with make_executor(workers, scheduler, apart=_apart(jobs)) as executor:
            for done in run_jobs(jobs, executor, progress=progress):
                warnings = () if done.row is None else tuple(done.row.warnings)
                yield SweepRun(done.number, done.job.settings, done.row, _reason(done), warnings=warnings)

    def run(
        self,
        workers: int = 1,
        *,
        progress: Progress = None,
        measure: Mapping[str, Measure] | None = None,
        units: Mapping[str, str] | None = None,
        keep: bool = True,
        directory: str | Path | None = None,
        folders: bool = True,
        resume: bool = False,
        retry: bool = False,
        scheduler: str | None = None,
        measures: Measures = error_measures,
    ) -> SweepResult:
        """Run all variations; one that fails does not stop the others.

        Args:
            workers: processes at a time, see `each`. A script whose own classes are run in them needs
                ``if __name__ == "__main__":``.
            progress: called with the number done and the number in all, once a run is in the table; by default a bar,
                where it lasts and somebody can see it; False for none.
            measure: own numbers to take of each outcome, ``{"name": function}``; called in this process.
            units: of these numbers, by name, for pictures.
            keep: keep the outcomes in memory; without them only measures are left, and what is in `directory`.
            directory: where the journal ``runs.jsonl`` gets a line for each run as soon as it is done, and each run is
                written, ``run_000``, ``run_001``, ..., with an index at the end, also where the sweep is interrupted.
            folders: write a results folder for each run; without them `directory` holds journal and table only.
            resume: take the runs over that an earlier sweep left in `directory`, where scenario, settings, the content
                of files and own measures with the files that they stand in are the same, unless they failed for a
                reason outside, such as an interruption.
            retry: with `resume`, run all again that failed.
            scheduler: address of a scheduler of `dask.distributed` whose workers do the runs: ``tcp://host:8786``.
            measures: numbers by name that are taken of each outcome where it is run: a function of a module.

        Returns:
            The runs in order of the variations, with settings, measures, outcome or failure.

        Raises:
            ScenarioError: `workers` is less than 1, or `resume` without a `directory`.
            OutputError: results cannot be written. RunError: the cluster cannot be used.
        """
        if resume and directory is None:
            raise ScenarioError("A sweep is resumed from its folder: give directory=...")
        folder = None if directory is None else Path(directory)
        pages, away = len(self.variations) <= MOST_PAGES, scheduler is not None
        rows = _Rows(measures, measure or {}, keep, folder, folders, pages, away)
        jobs = self._jobs(rows.take, code_content(measures, *rows.measure.values()))
        result = SweepResult(self.varied(0), self.names, [], dict(units or {}))  # which is whole in any case
        done: dict[int, SweepRun] = {}
        with make_executor(workers, scheduler, apart=_apart(jobs)) as executor, reported(progress, "run") as report:
            journal = None if folder is None else Journal(folder, resume=resume, retry=retry)
            try:
                for each in run_jobs(jobs, executor, journal, reduce=rows.row, fits=rows.fits, progress=report):
                    done[each.number] = rows.run(each)
            finally:
                result = replace(result, runs=[done[number] for number in sorted(done)])
                if folder is not None and done:
                    write_index(result, folder)
        return result

    def _jobs(self, take: Callable[[int, Variation], Callable[[Outcome], Any]], rests_on: str) -> list[Run]:
        each = enumerate(self.variations)
        return [Run(self.scenario, settings, take(number, settings), rests_on) for number, settings in each]


@dataclass
class _Rows:
    """What is kept of each run of a sweep: measures, what went wrong in taking them, warnings, where its results are.

    Args:
        measures: taken of an outcome where it is run. measure: the user's, taken here. keep: whether outcomes stay.
        directory: of the sweep, or None. folders: whether a results folder is written for each run, and pages: whether
            with a page in it. away: whether runs are done on machines that may not reach the directory.
    """

    measures: Measures
    measure: Mapping[str, Measure]
    keep: bool
    directory: Path | None
    folders: bool
    pages: bool
    away: bool
    outcomes: dict[int, Outcome] = field(default_factory=dict)

    @property
    def _written(self) -> Path | None:
        """Where each run is written."""
        return self.directory.absolute() if self.folders and self.directory is not None else None

    def take(self, number: int, settings: Variation) -> Callable[[Outcome], Any]:
        """What is taken of an outcome where it is run: all of it where it is needed here."""
        directory = self._written
        take = whole if self.keep or self.measure or (directory and self.away) else self.measures
        if directory is None or self.away:
            return take
        return WrittenRun(take, settings, directory / run_folder(number), self.pages)

    def row(self, number: int, job: Job, ended: Ended) -> dict[str, Any]:
        """The row of a run, whose results are written by then."""
        if isinstance(ended.row, OutputError):
            raise ended.row
        directory = self._written
        folder = None if directory is None or ended.row is None else run_folder(number)
        data = {"measures": ended.row or {}, "faults": [], "folder": folder, "warnings": list(ended.warnings)}
        if not isinstance(ended.row, Outcome):
            return data
        outcome = ended.row
        own, faults = own_measures(outcome, self.measure)
        if self.away and directory is not None:
            write_outcome(outcome, job.settings, directory / run_folder(number), report=self.pages)
        if self.keep:
            self.outcomes[number] = outcome
        return data | {"measures": {**self.measures(outcome), **own}, "faults": faults}

    def fits(self, number: int, row: Mapping[str, Any]) -> bool:
        """Whether the results of an earlier sweep's run stand in the folder that they would have in this one."""
        return self._written is None or bool(row["folder"] == run_folder(number))

    def run(self, done: Done) -> SweepRun:
        """A run that is done, with the outcome where it is kept."""
        row = done.row
        measures = {name: nan if value is None else float(value) for name, value in row["measures"].items()}
        folder = None if row["folder"] is None or self.directory is None else self.directory / row["folder"]
        outcome = self.outcomes.get(done.number)
        faults, warnings = tuple(row["faults"]), tuple(row.get("warnings", ()))  # an earlier journal has no warnings
        return SweepRun(
            done.number, done.job.settings, outcome, _reason(done), measures, faults, folder, warnings=warnings
        )


def _reason(done: Done) -> str | None:
    return None if done.failure is None else done.failure.reason


def _apart(jobs: Sequence[Run]) -> bool:
    """Whether a run may take its process along; those that differ in numbers only are alike in this."""
    worded = [job for job in jobs if any(isinstance(value, str) for value in job.settings.values())]
    return any(job.apart for job in (*jobs[:1], *worded))


def make_sweep(
    scenario: RunnableScenario,
    values: Mapping[str, Iterable[Any] | Distribution] | Sequence[Mapping[str, Any]],
    mode: Mode,
    count: int | None,
    seed: int,
) -> Sweep:
    """A sweep whose every variation is a valid scenario; arguments as for `Scenario.vary`.

    Args:
        scenario: the scenario.
        values: values or ranges by name of the setting.
        mode: ``grid``, ``zip``, ``latin`` or ``random``, see `Scenario.vary`.
        count: number of runs where they are drawn.
        seed: of the drawing.

    Raises:
        CosimError: a name or a value cannot be.
    """
    sweep = Sweep(scenario.copy(), variations(values, mode, count, seed))
    cases: set[Any] = set()
    for number, settings in enumerate(sweep.variations):
        try:
            varied = sweep.varied(number)
            varied.table()
            names = sweep.scenario.cases[settings[CASE]] if CASE in settings else ()
            if number == 0 or (CASE in settings and settings[CASE] not in cases):
                check_parameters(varied, [*names, *sweep.names])
            cases.add(settings.get(CASE))
        except CosimError as error:
            changed = ", ".join(f"{name} = {value!r}" for name, value in settings.items())
            error.args = (f"vary: run {number} ({changed}): {error}", *error.args[1:])
            raise
    return sweep


def check_parameters(scenario: RunnableScenario, names: Iterable[str]) -> None:
    """Parameters that are varied exist: found here, and not in every run.

    Args:
        scenario: with their values. names: of settings.

    Raises:
        CosimError: a component has no such parameter, or cannot be described.
    """
    tables = scenario.table().components
    for name in dict.fromkeys(n.partition(".")[0] for n in names if n.partition(".")[0] in tables):
        table = tables[name]
        if table.recording is None:
            describe_component(name, table, scenario.folder, f"{scenario.where}: components.{name}")
