"""Observers on one disturbed run, as a job among many, and what of many is left to choose by."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

from cosim.choice.allowance import Allowance
from cosim.choice.benchmark import ObserverBenchmark, benchmark_observers
from cosim.choice.candidates import Observers
from cosim.choice.choice import INTERRUPTED
from cosim.choice.disturbances import Disturbance, Journey, drawn
from cosim.errors import RunError
from cosim.runs.engine import run_jobs
from cosim.runs.executors import Executor
from cosim.runs.job import Ended, Failure, Job
from cosim.runs.keys import digest, table_content
from cosim.simulation.scenario import Scenario

HARDER = 2.0
"""How much larger all disturbances are in the runs that do not count."""


@dataclass(frozen=True)
class Trial(Job):
    """All observers on one run.

    Args:
        scenario: what is run. observers: as for `benchmark_observers`. allowance: what a position may be off.
        number: of the disturbance, 0 for none. factor: by which it is enlarged, 1 for those that count.
        recorded: folder of a run that is played in place of a new one.
    """

    scenario: Scenario
    observers: Observers
    allowance: Allowance
    number: int = 0
    factor: float = 1.0
    recorded: str | Path | None = None
    settings: Mapping[str, Any] = field(default_factory=dict)

    @property
    def key(self) -> str:
        """Digest of the scenario and the disturbance."""
        content = table_content(self.scenario.table(), self.scenario.folder)
        return digest(content, f"{self.number} {self.factor} {self.allowance}")

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
            disturb = partial(_enlarged, self.number, seed, self.factor)
        more = {"recorded": self.recorded, "warn": lambda _text: None, **more}
        return benchmark_observers(scenario, self.observers, disturb=disturb, allowance=self.allowance, **more)


def _undisturbed(_journey: Journey) -> Disturbance:
    """Nothing is wrong."""
    return Disturbance()


def _enlarged(number: int, seed: int, factor: float, journey: Journey) -> Disturbance:
    found = drawn(number, seed, journey)
    return found if factor == 1.0 else found.times(factor)


def tried(
    trials: Sequence[Trial], executor: Executor, report: Callable[[int], None]
) -> tuple[list[ObserverBenchmark], str]:
    """The scores of the trials, in their order, and why some are missing; empty where all are there.

    Args:
        trials: to be done. executor: where. report: called with the number done.
    """
    found: dict[int, ObserverBenchmark] = {}
    stopped = ""
    try:
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
        require_any(done.row)
    except RunError as error:
        return str(error)
    return ""


def require_any(benchmark: ObserverBenchmark) -> None:
    """Refuse a run in which no observer has a position error, although one could be set up.

    Args:
        benchmark: of the run.

    Raises:
        RunError: it is one.
    """
    failures = [score.failure for score in benchmark.scores if score.used is None]
    if len(failures) < len(benchmark.scores):
        return
    settled = (
        f"no row lies behind the start of the evaluation (report.evaluate_after = {benchmark.spec.evaluate_after:g} s)"
    )
    reason = settled if None in failures else failures[0]
    raise RunError(f"The run '{benchmark.disturbance.name}' says nothing of any observer: {reason}")
