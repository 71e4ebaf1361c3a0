"""Which observer: all of them side by side, on a nominal run and on disturbed ones, and an answer."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

from cosim.choice.allowance import Allowance, UsedAllowance
from cosim.choice.benchmark import ObserverBenchmark, benchmark_observers
from cosim.choice.candidates import BenchmarkCandidate
from cosim.choice.choice import INTERRUPTED, Choice
from cosim.choice.disturbances import Disturbance, Journey, drawn
from cosim.choice.ranking import NOTHING, Row, ranked
from cosim.errors import RunError, ScenarioError
from cosim.run.checked_observers import presets_of_other_plants
from cosim.runs.engine import run_jobs
from cosim.runs.executors import make_executor
from cosim.runs.job import Ended, Failure, Job
from cosim.runs.keys import digest, table_content
from cosim.simulation.scenario import Scenario
from cosim.starter.starter_file import starter

SEEDS, HARDER = 4, 2.0
"""Disturbed runs that count, so that each error has both signs; and how much larger all is in the one that does not."""
Progress = Callable[[str, int, int], None]


def _undisturbed(_journey: Journey) -> Disturbance:
    """Nothing is wrong."""
    return Disturbance()


@dataclass(frozen=True)
class Trial(Job):
    """All observers on one run.

    Args:
        scenario: what is run. observers: as for `benchmark_observers`. allowance: what a position may be off.
        number: of the disturbance, 0 for none. size: of it, 1 for those that count.
        recorded: folder of a run that is played in place of a new one.
    """

    scenario: Scenario
    observers: Sequence[Any] | None
    allowance: Allowance
    number: int = 0
    size: float = 1.0
    recorded: str | Path | None = None
    settings: Mapping[str, Any] = field(default_factory=dict)

    @property
    def key(self) -> str:
        """Digest of the scenario and the disturbance."""
        content = table_content(self.scenario.table(), self.scenario.folder)
        return digest(content, f"{self.number} {self.size} {self.allowance}")

    def do(self) -> Ended:
        """The scores, without the rows of the runs."""
        found = self.played()
        interrupted = Failure("interrupted", outside=True) if found.interrupted else None
        return Ended(replace(found, outcomes={}), interrupted)

    def played(self, **more: Any) -> ObserverBenchmark:
        """The scores.

        Args:
            more: other arguments of `benchmark_observers`.
        """
        scenario = self.scenario.copy()
        seed = scenario.table().seed
        disturb: Callable[[Journey], Disturbance] = _undisturbed
        if self.number:
            scenario.set("seed", seed + self.number)
            disturb = partial(drawn, self.number, seed, size=self.size)
        more = {"recorded": self.recorded, "warn": lambda _text: None, **more}
        return benchmark_observers(scenario, self.observers, disturb=disturb, allowance=self.allowance, **more)


def choose(
    scenario: Scenario,
    observers: Sequence[Any] | None = None,
    *,
    seeds: int = SEEDS,
    allowance: Allowance | None = None,
    record: str | Path | None = None,
    recorded: str | Path | None = None,
    workers: int = 1,
    progress: Progress | None = None,
    warn: Callable[[str], None] | None = None,
) -> Choice:
    """Find the observer to use: each is run nominally, and on disturbed runs with errors of both signs.

    What is disturbed and how much, `cosim.choice.disturbances.drawn` says. The plant stays as it is.

    Args:
        scenario: with or without observers of its own.
        observers: as for `benchmark_observers`; None for the scenario's own and every preset of all train observers.
        seeds: disturbed runs that count; with 0 the nominal run alone decides, which is mostly wrong.
        allowance: what a position may be off; None for SUBSET-041.
        record: folder for the nominal recording. recorded: folder of a run to be played in all runs, in place of new
            ones with other seeds.
        workers: processes at a time for the disturbed runs.
        progress: called with what is done now, the number of runs done and the number in all.
        warn: receives what is doubtful about the nominal run.

    Raises:
        ScenarioError: an observer is unknown, none fits, or nothing says where the train truly is.
        RunError: the undisturbed run of the plant side failed. CosimError: the scenario cannot be set up.
    """
    if seeds < 0:
        raise ScenarioError(f"seeds must not be negative, got {seeds}.")
    report = progress or (lambda _what, _done, _all: None)
    granted, total = allowance or Allowance(), seeds + 2
    report("nominal", 0, total)
    nominal = Trial(scenario, observers, granted, recorded=recorded).played(record=record, warn=warn, recorded=recorded)
    again = [_asked(nominal.candidates[score.name]) for score in nominal.scores if score.failure is None]
    trials = [Trial(scenario, again, granted, number, recorded=recorded) for number in range(1, seeds + 1)]
    trials.append(Trial(scenario, again, granted, seeds + 1, HARDER, recorded=recorded))
    found, stopped = [nominal], INTERRUPTED if nominal.interrupted else ""
    if again:
        _require_any(nominal)
    if again and not stopped:
        others, stopped = _tried(trials, workers, lambda done: report("disturbed", done + 1, total))
        found += others
    rows = ranked([_row(scenario, score.name, found) for score in nominal.scores])
    done = tuple(benchmark.disturbance for benchmark in found)
    report("done", total, total)
    return Choice(scenario, rows, nominal, done, granted, stopped)


def scenario_for_fmu(path: str | Path) -> Scenario:
    """The scenario that `cosim new` writes for a plant FMU; no file is written.

    Args:
        path: of the FMU.

    Raises:
        CosimError: the FMU cannot be read, or nothing in it looks like a train.
    """
    file = Path(path).resolve()
    made = starter(file, file.with_suffix(".toml"))
    if made.kind != "train":
        raise ScenarioError(f"{path}: no train in it, so there is nothing to choose for. {' '.join(made.remarks)}")
    return Scenario(folder=file.parent, where=f"{file.stem}.toml", **tomllib.loads(made.text))


def _asked(candidate: BenchmarkCandidate) -> Any:
    """What names an observer for another run."""
    model = candidate.table.observer
    if candidate.origin == "scenario" or model is None:
        return candidate.name
    return model if model.stated is not None else str(candidate.table.label)


def _tried(trials: Sequence[Trial], workers: int, report: Callable[[int], None]) -> tuple[list[ObserverBenchmark], str]:
    """The scores of the trials, in their order, and why some are missing; empty where all are there."""
    found: dict[int, ObserverBenchmark] = {}
    stopped = ""
    try:
        with make_executor(workers) as executor:
            for done in run_jobs(trials, executor, progress=lambda number, _all: report(number)):
                failure = _failure(done)
                stopped = stopped or failure
                if not failure:
                    found[done.number] = done.row
    except KeyboardInterrupt:
        stopped = INTERRUPTED
    return [found[number] for number in sorted(found)], stopped


def _failure(done: Any) -> str:
    """Why a disturbed run counts for no observer, in words; empty where it counts."""
    if done.row is None and done.failure is not None:
        return f"A disturbed run failed: {done.failure.reason}"
    try:
        _require_any(done.row)
    except RunError as error:
        return str(error)
    return ""


def _require_any(benchmark: ObserverBenchmark) -> None:
    """Raise a RunError where no observer has a position error in a run, although one could be set up."""
    failures = [score.failure for score in benchmark.scores if score.used is None]
    if len(failures) < len(benchmark.scores):
        return
    settled = (
        f"no row lies behind the start of the evaluation (report.evaluate_after = {benchmark.spec.evaluate_after:g} s)"
    )
    reason = settled if None in failures else failures[0]
    raise RunError(f"The run '{benchmark.disturbance.name}' says nothing of any observer: {reason}")


def _row(scenario: Scenario, name: str, found: Sequence[ObserverBenchmark]) -> Row:
    """An observer over all runs."""
    used: dict[str, UsedAllowance] = {}
    harder: dict[str, UsedAllowance] = {}
    failures: dict[str, str] = {}
    for benchmark in found:
        run = benchmark.disturbance.name
        score = next((score for score in benchmark.scores if score.name == name), None)
        if score is None or (score.used is None and benchmark is found[0]):
            continue
        (harder if _is_harder(benchmark.disturbance) else used)[run] = score.used or NOTHING
        if score.failure is not None and not _is_harder(benchmark.disturbance):
            failures[run] = score.failure
    nominal = found[0]
    score = next(score for score in nominal.scores if score.name == name)
    candidate = nominal.candidates[name]
    remarks = presets_of_other_plants({name: candidate.table}, scenario.where) if used else ()
    return Row(score, candidate, used, harder, failures, remarks)


def _is_harder(disturbance: Disturbance) -> bool:
    return disturbance.name.startswith("harder")
