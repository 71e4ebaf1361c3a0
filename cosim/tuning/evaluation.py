"""Costs of candidates over seeds: jobs of the one engine of runs, done as members of a batch where that can be."""

from __future__ import annotations

import json
import pickle
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from math import inf, isfinite
from pathlib import Path
from typing import Any

import numpy as np

from cosim.errors import RunError, ScenarioError
from cosim.results.results_folder import write_results
from cosim.run.outcome import Outcome
from cosim.runs.engine import Done, run_jobs
from cosim.runs.executors import Executor, make_executor
from cosim.runs.job import Ended, Failure, Job
from cosim.runs.journal import Journal
from cosim.runs.keys import code_content, digest, table_content
from cosim.runs.run import Run
from cosim.simulation.scenario import Scenario
from cosim.tuning.costs import Cost
from cosim.tuning.parameters import Tunable
from cosim.tuning.replays import Replays, make_replays
from cosim.tuning.seeded_scenarios import Seeded

_ROWS = 500
"""Of a run, for the directions that change nothing: so many show enough."""


@dataclass(frozen=True)
class _Evaluated:
    """The cost of one candidate with one seed.

    Args:
        cost: infinite where the run failed, or shows no finite one. why: the reason for that, or None.
        instant: from when on something is no finite number [s]; None where that is not the reason.
        signals: that the cost depends on, at some instants, in units of their own sizes, where they were asked for.
        missing: what a run that ended does not show, although the cost needs it: no other candidate will.
    """

    cost: float = inf
    why: str | None = None
    instant: float | None = None
    signals: Sequence[float] | None = None
    missing: str | None = None


@dataclass(frozen=True)
class _Evaluate:
    """What is taken of the outcome of a candidate.

    Args:
        cost: of a run. observer: component that is tuned, or None. with_signals: whether signals are wanted too.
    """

    cost: Cost
    observer: str | None = None
    with_signals: bool = False

    def __call__(self, outcome: Outcome) -> _Evaluated | None:
        if outcome.failure is not None:
            return None
        signals = _signals(outcome, self.observer, self.cost).tolist() if self.with_signals else None
        try:
            cost = self.cost.of(outcome)
        except ScenarioError as error:
            return _Evaluated(missing=str(error))
        if isfinite(cost):
            return _Evaluated(cost, signals=signals)
        return _Evaluated(inf, *_not_finite(outcome, self.cost, cost), signals)


@dataclass(frozen=True)
class _Evaluation(Run):
    """The run of a candidate with one seed.

    Args:
        number: of the seed. candidate: values by name; None for the scenario as it is.
    """

    number: int = 0
    candidate: Mapping[str, float] | None = None

    @property
    def key(self) -> str:
        """Digest of what the run follows from, recordings apart: they follow from the scenario too."""
        return digest(self.rests_on, json.dumps(dict(self.settings), sort_keys=True))

    @property
    def seed(self) -> int | None:
        """Number of the seed, by which that of the scenario is moved."""
        return self.number


class Evaluator(AbstractContextManager["Evaluator"]):
    """Evaluates candidates.

    Args:
        by_seed: the scenario with each seed. tunable: what is tuned. cost: of a run. directory: of recordings and
            journal. observer: component that is tuned, or None.
        workers, scheduler: see `make_executor`. resume, retry: see `Journal`.
    """

    def __init__(
        self,
        by_seed: Mapping[int, Seeded],
        tunable: Tunable,
        cost: Cost,
        directory: Path,
        *,
        observer: str | None = None,
        workers: int = 1,
        scheduler: str | None = None,
        resume: bool = False,
        retry: bool = False,
    ) -> None:
        self.by_seed, self.tunable, self.cost, self.observer = by_seed, tunable, cost, observer
        self.directory, self.runs, self.replayed = directory, 0, False
        self.failures: dict[str, list[str]] = {}
        self._journal = Journal(directory, resume=resume, retry=retry)
        self._known: dict[str, _Evaluated] = {}
        self._contents: dict[int, str] = {}
        self._bases: dict[int, Scenario] = {}
        self._replays: dict[int, Replays] = {}
        some = [self._job(None, seed) for seed in list(by_seed)[:1]]  # candidates differ from it in numbers only
        self._executor = make_executor(workers, scheduler, apart=any(map(_apart, some)))

    def costs(
        self,
        candidates: Sequence[Mapping[str, Any] | None],
        seeds: Sequence[int],
        label: Mapping[str, Any],
        step: Callable[[], None] = lambda: None,
    ) -> np.ndarray:
        """Costs of candidates with each seed, shape (m, seeds); infinite where a run failed or shows no finite one.

        Args:
            candidates: values by name; None for the scenario as it is. seeds: of those prepared.
            label: what the journal says of them besides.
            step: called after each run.

        Raises:
            ScenarioError: a run that ended does not show the cost.
        """
        jobs = [self._job(candidate, seed) for candidate in candidates for seed in seeds]
        found = [one.cost for one in self._evaluated(jobs, label, step)]
        return np.array(found).reshape(len(candidates), len(seeds))

    def effects(self, candidates: Sequence[Mapping[str, Any]], seed: int) -> list[np.ndarray | None]:
        """What the cost depends on with each candidate, shape (k,); None where a run failed.

        Of an observer these are its outputs, else all signals and the cost itself, which may depend on more.

        Args:
            candidates: values by name. seed: of those prepared.
        """
        jobs = [self._job(candidate, seed, with_signals=True) for candidate in candidates]
        found = self._evaluated(jobs, {"search": "directions"})
        unit = abs(found[0].cost) or 1.0
        ends = [[] if self.observer is not None else [one.cost / unit] for one in found]
        return [None if o.signals is None else np.append(o.signals, end) for o, end in zip(found, ends, strict=True)]

    def replays(self, seeds: Sequence[int]) -> list[Replays]:
        """The observer beside the recordings of these seeds; none where candidates are not replayed.

        Args:
            seeds: of those prepared.
        """
        self._prepare(seeds)
        return [self._replays[seed] for seed in seeds] if self.replayed else []

    def __exit__(self, *_: object) -> None:
        """Let the worker processes end."""
        self._executor.__exit__(None, None, None)

    def _job(self, candidate: Mapping[str, Any] | None, seed: int, *, with_signals: bool = False) -> _Evaluation:
        settings = {} if candidate is None else self.tunable.settings(candidate)
        take = _Evaluate(self.cost, self.observer, with_signals)
        rests_on = f"{self._content(seed)} {'signals' if with_signals else ''}"
        return _Evaluation(self.by_seed[seed].whole, settings, take, rests_on, seed, candidate)

    def _content(self, seed: int) -> str:
        if seed not in self._contents:
            played = "recorded" if self.by_seed[seed].parts is not None else "whole"
            whole = self.by_seed[seed].whole
            content = digest(table_content(whole.table(), whole.folder), code_content(self.cost.code))
            self._contents[seed] = f"{content} {played} {self.cost.text} {self.cost.signals}"
        return self._contents[seed]

    def _evaluated(
        self, jobs: Sequence[_Evaluation], label: Mapping[str, Any], step: Callable[[], None] = lambda: None
    ) -> list[_Evaluated]:
        """What became of each job, those that are alike done once; they are in the journal as soon as they are done."""
        alike = dict[str, int]()
        for job in jobs:
            alike[job.key] = alike.get(job.key, 0) + 1
        new = {job.key: job for job in jobs if job.key not in self._known}
        if any(self._journal.taken(job) is None for job in new.values()):
            self._prepare(sorted({job.number for job in new.values()}))
        wanted = [replace(job, scenario=self._bases.get(job.number, job.scenario)) for job in new.values()]
        for _ in range(sum(count for key, count in alike.items() if key not in new)):
            step()
        executor = _Members(self._replays, self._executor)
        for done in run_jobs(wanted, executor, self._journal, reduce=lambda _, _job, ended: _row(ended, label)):
            self._note(done)
            for _ in range(alike[done.job.key]):
                step()
        return [self._known[job.key] for job in jobs]

    def _note(self, done: Done) -> None:
        """Keep what a job left, and of one without a cost which candidate it was."""
        job, row = done.job, done.row
        assert isinstance(job, _Evaluation)
        self.runs += not done.resumed
        found = _Evaluated(inf, done.failure.reason) if done.failure is not None else _Evaluated(**row["evaluated"])
        self._known[job.key] = found if found.cost is not None else replace(found, cost=inf)
        if found.why is not None:
            values = ", ".join(f"{name} = {value:.6g}" for name, value in (job.candidate or {}).items())
            since = "" if found.instant is None else f" from t = {found.instant:g} s on"
            text = f"{values or 'the scenario as it is'}, seed {job.number}{since}"
            self.failures.setdefault(found.why, []).append(text)

    def _prepare(self, seeds: Sequence[int]) -> None:
        """Record the plant side with these seeds, as far as it has not been.

        Raises:
            RunError: a recording failed.
        """
        new = [seed for seed in seeds if seed not in self._bases]
        folders = {seed: self.directory / "recordings" / f"seed_{seed}" for seed in new}
        wanted = {seed: scenario for seed in new if (scenario := self.by_seed[seed].recording()) is not None}
        for done in run_jobs([Run(scenario) for scenario in wanted.values()], self._executor):
            seed = list(wanted)[done.number]
            if done.failure is not None:
                raise RunError(f"The plant side with seed {seed} could not be recorded: {done.failure.reason}")
            self.runs += 1
            write_results(done.row.result, folders[seed], ("npy",))
        self._bases |= {seed: self.by_seed[seed].base(folders[seed], self.cost) for seed in new}
        for seed in new:
            if self.by_seed[seed].candidate is not None and (self.replayed or not self._replays):
                found = self._make_replays(seed)
                self.replayed = found is not None
                if found is not None:
                    self._replays[seed] = found

    def _make_replays(self, seed: int) -> Replays | None:
        candidate = self.by_seed[seed].candidate
        names = list(self.tunable.settings(self.tunable.start))
        return None if candidate is None else make_replays(self._bases[seed], candidate.name, self.cost, names)


class _Members(AbstractContextManager["_Members"]):
    """Does candidates as members of a batch, all those of a seed together, and the other jobs elsewhere.

    Args:
        replays: by seed. others: where jobs of other seeds are done.
    """

    def __init__(self, replays: Mapping[int, Replays], others: Executor) -> None:
        self._replays, self._others = replays, others

    def each(self, jobs: Iterable[Job]) -> Iterator[tuple[Job, Ended]]:
        """One round, see `Executor.each`."""
        rest = list(jobs)
        for seed, replays in self._replays.items():
            mine = [job for job in rest if isinstance(job, _Evaluation) and job.number == seed]
            rest = [job for job in rest if job.seed != seed]
            for job, outcome in zip(mine, replays.outcomes([job.settings for job in mine]), strict=True):
                if isinstance(outcome, str):
                    yield job, Ended(failure=Failure(outcome))
                else:
                    yield job, Ended(job.take(outcome))
        yield from self._others.each(rest)

    def __exit__(self, *_: object) -> None:
        """The other executor is freed by whoever made it."""


def _apart(job: Run) -> bool:
    """Whether a run is done in a process of its own; a cost that cannot go there keeps it here."""
    try:
        return job.apart
    except (pickle.PicklingError, AttributeError, TypeError):
        return False


def _row(ended: Ended, label: Mapping[str, Any]) -> dict[str, Any]:
    """What the journal keeps of a candidate.

    Raises:
        ScenarioError: a run that ended does not show the cost.
    """
    found = ended.row
    if found is None:
        return dict(label)
    if found.missing is not None:
        raise ScenarioError(f"cost: {found.missing}")
    return {**label, "evaluated": {name: value for name, value in vars(found).items() if name != "missing"}}


def _not_finite(outcome: Outcome, cost: Cost, value: float) -> tuple[str, float | None]:
    """Why the cost of a run that ended is no finite number, and from when on [s]: of the signals that it names the one
    that is none first, for some can be missing.
    """
    known = outcome.result.table.dtype.names or ()
    columns = {name: outcome.result[name] for name in (*cost.signals, *cost.estimates) if name in known}
    first = {name: int(np.argmin(np.isfinite(c))) for name, c in columns.items() if not np.isfinite(c).all()}
    if not first:
        return f"the cost is {value:g}, although all signals that it names are finite", None
    name = min(first, key=first.__getitem__)
    return f"the cost is not finite, for {name} is not", float(outcome.result.time[first[name]])


def _signals(outcome: Outcome, observer: str | None, cost: Cost) -> np.ndarray:
    """What the cost depends on at some rows, one signal after the other, each in units of its own spread: signals that
    the cost names, outputs of the observer, or all.
    """
    table, time = outcome.result.table, outcome.result.time
    mine = [n for n in table.dtype.names or () if n != "time" and (observer is None or n.startswith(f"{observer}."))]
    names = [name for name in mine if name in cost.estimates] or [name for name in mine if not name.endswith("_std")]
    if observer is None:  # events, and so rows, may differ between candidates
        instants = np.linspace(float(time[0]), float(time[-1]), _ROWS)
        columns = [np.interp(instants, time, np.asarray(table[name], float)) for name in names]
    else:
        rows = np.unique(np.linspace(0, len(table) - 1, _ROWS).astype(int))
        columns = [np.asarray(table[name][rows], float) for name in names]
    return np.concatenate([column / (np.std(column) or 1.0) for column in columns]) if columns else np.empty(0)
