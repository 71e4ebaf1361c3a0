"""A sweep: one scenario run many times with some values changed, here or in several processes. Touches the folder it is
given.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

from cosim.errors import CosimError, ScenarioError
from cosim.run.described_components import describe_component
from cosim.run.outcome import INTERRUPTED, Outcome
from cosim.scenario.override import CASE
from cosim.studies.measures import Measure, error_measures, own_measures
from cosim.studies.runnable import RunnableScenario
from cosim.studies.sampling_plans import Mode, Range, Variation, variations
from cosim.studies.sweep_files import run_folder, write_index, write_run
from cosim.studies.sweep_journal import SweepJournal
from cosim.studies.sweep_result import SweepResult
from cosim.studies.sweep_runs import SweepRun
from cosim.studies.workers import Died, Raised, attempt, in_processes

Progress = Callable[[int, int], None]


class _Job(NamedTuple):
    scenario: RunnableScenario
    settings: Variation


@dataclass(frozen=True)
class Sweep:
    """A scenario and its variations, ready to run; made by `Scenario.vary`.

    Args:
        scenario: what is varied. variations: for each run the values that are changed, by name.
    """

    scenario: RunnableScenario
    variations: Sequence[Variation]

    def __len__(self) -> int:
        return len(self.variations)

    @property
    def names(self) -> list[str]:
        """Names of what is varied, in order of appearance."""
        return list(dict.fromkeys(name for variation in self.variations for name in variation))

    def varied(self, number: int) -> RunnableScenario:
        """The scenario of one run.

        Args:
            number: of the variation, from 0.
        """
        scenario = self.scenario.copy()
        for name, value in self.variations[number].items():
            scenario.set(name, value)
        return scenario

    def each(
        self, workers: int = 1, progress: Progress | None = None, without: Container[int] = ()
    ) -> Iterator[SweepRun]:
        """Run all variations and hand each over as soon as it is done, so that none needs to be kept.

        Args:
            workers: processes at a time; 1 runs in this process. In processes of their own, a run that crashes fails
                alone; results do not depend on their number.
            progress: called with the number done and the number in all.
            without: numbers of variations that are not run.

        Yields:
            The runs, in order with one worker, as they come with several.

        Raises:
            ScenarioError: `workers` is less than 1. KeyboardInterrupt: a run was interrupted; it has been handed over.
        """
        if workers < 1:
            raise ScenarioError(f"A sweep needs at least one worker (got workers={workers}).")
        numbers = [number for number in range(len(self)) if number not in without]
        jobs = [_Job(self.scenario, self.variations[number]) for number in numbers]
        one_by_one = ((place, attempt(_run, job)) for place, job in enumerate(jobs))
        results = one_by_one if workers == 1 else in_processes(_run, jobs, workers)
        for done, (place, found) in enumerate(results, start=len(self) - len(jobs) + 1):
            if progress is not None:
                progress(done, len(self))
            run = _entry(numbers[place], self.variations[numbers[place]], found)
            yield run
            if run.failure == INTERRUPTED:  # who interrupts a run of a sweep means the sweep
                raise KeyboardInterrupt

    def run(
        self,
        workers: int = 1,
        *,
        progress: Progress | None = None,
        measure: Mapping[str, Measure] | None = None,
        units: Mapping[str, str] | None = None,
        keep: bool = True,
        directory: str | Path | None = None,
        folders: bool = True,
        resume: bool = False,
    ) -> SweepResult:
        """Run all variations; one that fails does not stop the others.

        Args:
            workers: processes at a time; 1 runs in this process. A script that uses more needs
                ``if __name__ == "__main__":``.
            progress: called with the number done and the number in all.
            measure: own numbers to take of each outcome, ``{"name": function}``; called in this process.
            units: of these numbers, by name, for pictures.
            keep: keep the outcomes in memory; without them only measures are left, and what is in `directory`.
            directory: where each run is written as soon as it is done, ``run_000``, ``run_001``, ..., with an index at
                the end, also where the sweep is interrupted.
            folders: write a results folder for each run; without them `directory` holds the table only.
            resume: take the runs over that an earlier sweep left in `directory`, where scenario, settings and files are
                the same; those that failed are run again.

        Returns:
            The runs in order of the variations, with settings, measures, outcome or failure.

        Raises:
            ScenarioError: `workers` is less than 1, or `resume` without a `directory`.
            OutputError: results cannot be written.
        """
        if resume and directory is None:
            raise ScenarioError("A sweep is resumed from its folder: give directory=...")
        journal = None if directory is None else SweepJournal(Path(directory), self.variations, self.varied)
        done: dict[int, SweepRun] = {} if journal is None or not resume else journal.read()
        if journal is not None:
            journal.begin(done.values())
        result = SweepResult(self.scenario, self.names, [], dict(units or {}))
        try:
            for run in self.each(workers, progress, done.keys()):
                measured = _measured(run, measure or {})
                folder = None
                if directory is not None and folders:
                    folder = write_run(measured, Path(directory) / run_folder(run.number))
                done[run.number] = replace(measured, folder=folder, outcome=measured.outcome if keep else None)
                if journal is not None:
                    journal.add(done[run.number])
        finally:
            result = replace(result, runs=[done[number] for number in sorted(done)])
            if directory is not None and done:
                write_index(result, Path(directory))
        return result


def make_sweep(
    scenario: RunnableScenario,
    values: Mapping[str, Iterable[Any] | Range] | Sequence[Mapping[str, Any]],
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
                _check_parameters(varied, [*names, *sweep.names])
            cases.add(settings.get(CASE))
        except CosimError as error:
            error.args = (f"vary: run {number} ({_settings_text(settings)}): {error}", *error.args[1:])
            raise
    return sweep


def _settings_text(settings: Mapping[str, Any]) -> str:
    """Settings in one line."""
    return ", ".join(f"{name} = {value!r}" for name, value in settings.items())


def _check_parameters(scenario: RunnableScenario, names: Iterable[str]) -> None:
    """Parameters that are varied exist: found here, and not in every run."""
    tables = scenario.table().components
    for name in dict.fromkeys(n.partition(".")[0] for n in names if n.partition(".")[0] in tables):
        table = tables[name]
        if table.recording is None:
            describe_component(name, table, scenario.folder, f"{scenario.where}: components.{name}")


def _run(job: _Job) -> Outcome | str:
    """One run, or why it could not begin. What is doubtful is in the outcome, and not said for every run."""
    try:
        return job.scenario.run(overrides=job.settings, warn=_silent)
    except CosimError as error:
        return str(error)


def _silent(_text: str) -> None: ...


def _entry(number: int, settings: Variation, found: Any) -> SweepRun:
    if isinstance(found, Outcome):
        return SweepRun(number, settings, found, found.failure)
    reason = found.reason if isinstance(found, Died | Raised) else str(found)
    return SweepRun(number, settings, None, reason)


def _measured(run: SweepRun, measure: Mapping[str, Measure]) -> SweepRun:
    if run.outcome is None:
        return run
    own, faults = own_measures(run.outcome, measure)
    return replace(run, measures=error_measures(run.outcome) | own, faults=faults)
