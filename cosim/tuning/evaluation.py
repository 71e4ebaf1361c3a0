"""Costs of candidates over seeds: run here or in worker processes, each written to a journal as soon as it is there,
and taken from it where it stands there already.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from math import inf, isfinite, nan
from pathlib import Path
from typing import Any

import numpy as np

from cosim.errors import CosimError, RunError, ScenarioError
from cosim.results.results_folder import write_results
from cosim.run.outcome import INTERRUPTED, Outcome
from cosim.runs.executors import make_executor
from cosim.runs.job import Job
from cosim.runs.journal import read_lines, write_line
from cosim.runs.keys import digest, table_content
from cosim.simulation.scenario import Scenario
from cosim.tuning.costs import Cost
from cosim.tuning.parameters import Tunable
from cosim.tuning.replays import Replays, make_replays
from cosim.tuning.seeded_scenarios import Seeded

JOURNAL = "evaluations.jsonl"
EARLIER = "evaluations.earlier.jsonl"
"""Those of the search before, which was not resumed."""
ROWS = 500
"""Of a run, for the directions that change nothing: so many tell enough."""


@dataclass(frozen=True)
class Evaluated:
    """The cost of one candidate with one seed.

    Args:
        cost: infinite where the run failed. failure: why, or None. estimates: of the observer at some instants, in
            units of their own sizes, where they were asked for.
        unreadable: whether a run that ended does not show the cost: no other candidate will.
    """

    cost: float
    failure: str | None = None
    estimates: np.ndarray | None = None
    unreadable: bool = False


@dataclass(frozen=True)
class _Job(Job):
    """One run: recorded to a folder, or judged."""

    scenario: Scenario
    settings: Mapping[str, Any]
    cost: Cost | None = None
    folder: Path | None = None
    observed: str | None = None
    number: int | None = None

    @property
    def key(self) -> str:
        """The evaluator keeps keys and journal itself."""
        return ""

    @property
    def seed(self) -> int | None:
        """Seed of the run."""
        return self.number

    def do(self) -> Evaluated:
        """Record it, or say what it costs."""
        return _do(self)


class Evaluator:
    """Evaluates candidates.

    Args:
        by_seed: the scenario with each seed. tunable: what is tuned. cost: of a run. directory: of recordings and
            journal. workers: processes at a time, 1 for this one. resume: whether the journal of an earlier search is
            taken over.
    """

    def __init__(
        self,
        by_seed: Mapping[int, Seeded],
        tunable: Tunable,
        cost: Cost,
        directory: Path,
        *,
        workers: int = 1,
        resume: bool = False,
    ) -> None:
        self.by_seed, self.tunable, self.cost, self.directory = by_seed, tunable, cost, directory
        self.runs = 0
        self.failures: dict[str, int] = {}
        self._executor = make_executor(workers)
        self._journal = directory / JOURNAL
        self._known = {entry["key"]: entry for entry in read_lines(self._journal)} if resume else {}
        directory.mkdir(parents=True, exist_ok=True)
        if not resume and self._journal.is_file() and self._journal.stat().st_size:
            self._journal.replace(directory / EARLIER)  # whoever forgot to resume has lost nothing
        self._journal.touch()
        self._keys: dict[int, str] = {}
        self._bases: dict[int, Scenario] = {}
        self._replays: dict[int, Replays] = {}
        self.replayed = False

    def prepare(self, seeds: Sequence[int], progress: Callable[[int, int], None] | None = None) -> None:
        """Record the plant side with these seeds, as far as it has not been.

        Args:
            seeds: of those prepared. progress: called with the number done and the number in all.

        Raises:
            RunError: a recording failed.
        """
        new = [seed for seed in seeds if seed not in self._bases]
        folders = {seed: self.directory / "recordings" / f"seed_{seed}" for seed in new}
        wanted = {seed: self.by_seed[seed].recording() for seed in new}
        jobs = [(s, _Job(scenario, {}, folder=folders[s])) for s, scenario in wanted.items() if scenario is not None]
        for done, (place, answer) in enumerate(self._answers([job for _, job in jobs]), start=1):
            if answer.failure is not None:
                raise RunError(f"The plant side with seed {jobs[place][0]} could not be recorded: {answer.failure}")
            if progress is not None:
                progress(done, len(jobs))
        self._bases |= {seed: self.by_seed[seed].base(folders[seed], self.cost) for seed in new}
        for seed in new:
            if self.by_seed[seed].candidate is not None and (self.replayed or not self._replays):
                found = self._make_replays(seed)
                self.replayed = found is not None
                if found is not None:
                    self._replays[seed] = found

    def costs(
        self,
        candidates: Sequence[Mapping[str, Any] | None],
        seeds: Sequence[int],
        label: Mapping[str, Any],
        step: Callable[[], None] = lambda: None,
    ) -> np.ndarray:
        """Costs of candidates with each seed, shape (m, seeds); infinite where a run failed.

        Args:
            candidates: values by name; None for the scenario as it is. seeds: of those prepared.
            label: what the journal says of them besides.
            step: called after each run.

        Raises:
            ScenarioError: a run that ended does not show the cost.
        """
        found = np.full((len(candidates), len(seeds)), nan)
        unknown = self._take_known(candidates, seeds, found, step)
        if unknown:
            self.prepare(sorted({seeds[places[0][1]] for places in unknown.values()}))
        keys = list(unknown)
        jobs = [self._job(candidates[i], seeds[j]) for (i, j), *_ in unknown.values()]
        for number, answer in self._answers(jobs):
            key = keys[number]
            i, j = unknown[key][0]
            if answer.unreadable:
                raise ScenarioError(f"cost: {answer.failure}")
            for place in unknown[key]:
                found[place] = answer.cost
                step()
            self._note(answer.failure)
            entry = {**label, "candidate": i, "seed": seeds[j], "values": candidates[i], "cost": answer.cost}
            self._known[key] = entry | {"failure": answer.failure, "key": key}
            write_line(self._journal, self._known[key])
        return found

    def _take_known(
        self,
        candidates: Sequence[Mapping[str, Any] | None],
        seeds: Sequence[int],
        found: np.ndarray,
        step: Callable[[], None],
    ) -> dict[str, list[tuple[int, int]]]:
        """Fill in costs that the journal holds; places of the others by key, for equal candidates are run once."""
        unknown: dict[str, list[tuple[int, int]]] = {}
        for i, candidate in enumerate(candidates):
            for j, seed in enumerate(seeds):
                key = self._key(seed, candidate)
                if key in self._known:
                    found[i, j] = self._taken(self._known[key])
                    step()
                else:
                    unknown.setdefault(key, []).append((i, j))
        return unknown

    def estimates(self, candidates: Sequence[Mapping[str, Any]], seed: int, observed: str) -> list[Evaluated]:
        """What the observer estimates with each candidate.

        Args:
            candidates: values by name. seed: of those prepared. observed: component whose outputs are compared.
        """
        self.prepare([seed])
        jobs = [self._job(candidate, seed, observed) for candidate in candidates]
        answers = dict(self._answers(jobs))
        return [answers[place] for place in range(len(jobs))]

    def replays(self, seeds: Sequence[int]) -> list[Replays]:
        """The observer beside the recordings of these seeds; none where candidates are not replayed.

        Args:
            seeds: of those prepared.
        """
        self.prepare(seeds)
        return [self._replays[seed] for seed in seeds] if self.replayed else []

    def close(self) -> None:
        """Let the worker processes end."""
        self._executor.__exit__(None, None, None)

    def _job(self, candidate: Mapping[str, Any] | None, seed: int, observed: str | None = None) -> _Job:
        settings = {} if candidate is None else self.tunable.settings(candidate)
        return _Job(self._bases[seed], settings, self.cost, observed=observed, number=seed)

    def _make_replays(self, seed: int) -> Replays | None:
        candidate = self.by_seed[seed].candidate
        names = list(self.tunable.settings(self.tunable.start))
        return None if candidate is None else make_replays(self._bases[seed], candidate.name, self.cost, names)

    def _answers(self, jobs: Sequence[_Job]) -> Iterator[tuple[int, Evaluated]]:
        """Answers as they come: of replays first, all candidates of a seed together."""
        others = list(range(len(jobs)))
        for seed, replays in self._replays.items():
            mine = [n for n in others if jobs[n].seed == seed]
            others = [n for n in others if n not in set(mine)]
            for place, outcome in zip(mine, replays.outcomes([jobs[n].settings for n in mine]), strict=True):
                self.runs += 1
                yield place, Evaluated(inf, outcome) if isinstance(outcome, str) else _judged(outcome, jobs[place])
        for place, answer in self._in_runs([jobs[n] for n in others]):
            yield others[place], answer

    def _in_runs(self, jobs: Sequence[_Job]) -> Iterator[tuple[int, Evaluated]]:
        places = {id(job): place for place, job in enumerate(jobs)}
        for job, ended in self._executor.each(jobs):
            self.runs += 1
            place, answer = places[id(job)], ended.row
            if ended.failure is not None:
                yield place, Evaluated(inf, ended.failure.reason)
                continue
            if answer.failure == INTERRUPTED:  # who interrupts a run means the search
                raise KeyboardInterrupt
            yield place, answer

    def _key(self, seed: int, candidate: Mapping[str, Any] | None) -> str:
        if seed not in self._keys:
            played = "recorded" if self.by_seed[seed].parts is not None else "whole"
            whole = self.by_seed[seed].whole
            content = table_content(whole.table(), whole.folder)
            self._keys[seed] = f"{digest(content)} {played} {self.cost.text} {self.cost.signals}"
        said = None if candidate is None else self.tunable.settings(candidate)
        return hashlib.sha256(f"{self._keys[seed]} {json.dumps(said, sort_keys=True)}".encode()).hexdigest()

    def _taken(self, entry: Mapping[str, Any]) -> float:
        self._note(entry["failure"])
        return inf if entry["cost"] is None else float(entry["cost"])

    def _note(self, failure: str | None) -> None:
        if failure is not None:
            self.failures[failure] = self.failures.get(failure, 0) + 1


@contextmanager
def closing(evaluator: Evaluator) -> Iterator[Evaluator]:
    """The evaluator, closed at the end.

    Args:
        evaluator: whose workers end then.
    """
    try:
        yield evaluator
    finally:
        evaluator.close()


def _do(job: _Job) -> Evaluated:
    """One run, here or in a worker."""
    try:
        outcome = job.scenario.run(overrides=job.settings, warn=_silent)
    except CosimError as error:
        return Evaluated(inf, str(error))
    if outcome.failure is not None:
        return Evaluated(inf, outcome.failure)
    if job.folder is not None:
        write_results(outcome.result, job.folder, ("npy",))
        return Evaluated(nan)
    return _judged(outcome, job)


def _judged(outcome: Outcome, job: _Job) -> Evaluated:
    assert job.cost is not None
    estimates = None if job.observed is None else _estimates(outcome, job.observed, job.cost)
    try:
        cost = job.cost.of(outcome)
    except ScenarioError as error:
        return Evaluated(inf, str(error), estimates, unreadable=True)
    return Evaluated(cost, None, estimates) if isfinite(cost) else Evaluated(inf, "the cost is not finite", estimates)


def _estimates(outcome: Outcome, observed: str, cost: Cost) -> np.ndarray:
    """What the cost sees of an observer at some rows, one signal after the other, each in units of its own spread."""
    table = outcome.result.table
    rows = np.unique(np.linspace(0, len(table) - 1, ROWS).astype(int))
    mine = [name for name in table.dtype.names or () if name.startswith(f"{observed}.")]
    names = [name for name in mine if name in cost.seen] or [name for name in mine if not name.endswith("_std")]
    columns = [np.asarray(table[name][rows], float) for name in names]
    return np.concatenate([column / (np.std(column) or 1.0) for column in columns]) if columns else np.empty(0)


def _silent(_text: str) -> None: ...
