"""Which observer: all of them side by side, on a nominal run and on disturbed ones, the best on more, and an answer."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from cosim.choice.allowance import Allowance
from cosim.choice.benchmark import ObserverBenchmark
from cosim.choice.choice import INTERRUPTED, Choice
from cosim.choice.ranking import Row, contenders, ranked
from cosim.choice.rows import merged, row_of
from cosim.choice.trial import HARDER, Trial, require_any, tried
from cosim.errors import ScenarioError
from cosim.run.backends import Notify
from cosim.runs.executors import Executor, make_executor
from cosim.simulation.scenario import Scenario
from cosim.starter.starter_file import StarterWishes, starter

SEEDS, FURTHER = 4, 24
"""Disturbed runs of all, so that each error has both signs, and those that the best get besides."""
Progress = Callable[[str, int, int], None]


def choose(
    scenario: Scenario,
    observers: Sequence[Any] | None = None,
    *,
    seeds: int = SEEDS,
    further: int = FURTHER,
    allowance: Allowance | None = None,
    record: str | Path | None = None,
    recorded: str | Path | None = None,
    workers: int = 1,
    progress: Progress | None = None,
    warn: Notify | None = None,
    building: Notify | None = None,
) -> Choice:
    """Find the observer to use: each is run nominally, and on disturbed runs with errors of both signs.

    What is disturbed and how much, `cosim.choice.disturbances.drawn` says. The plant stays as it is. The best of them
    then run on further seeds, since a rare failure is not seen on a few: `cosim.choice.ranking.contenders`. Where one
    falls, those that come up in its place do so too.

    Args:
        scenario: with or without observers of its own.
        observers: as for `benchmark_observers`; None for the scenario's own and every preset of all train observers.
        seeds: disturbed runs of all; with 0 the nominal run alone decides, which is mostly wrong.
        further: disturbed runs of the best besides.
        allowance: what a position may be off; None for SUBSET-041.
        record: folder for the nominal recording. recorded: folder of a run to be played in all runs, in place of new
            ones with other seeds.
        workers: processes at a time for the disturbed runs.
        progress: called with what is done now, the number of runs done and the number in all, as far as it is known.
        warn: receives what is doubtful about the nominal run.
        building: receives the observers that are compiled for the first time; by default the log ``cosim``.

    Raises:
        ScenarioError: an observer is unknown, none fits, or nothing says where the train truly is.
        RunError: the undisturbed run of the plant side failed. CosimError: the scenario cannot be set up.
    """
    for name, count in (("seeds", seeds), ("further", further)):
        if count < 0:
            raise ScenarioError(f"{name} must not be negative, got {count}.")
    report = progress or (lambda _what, _done, _all: None)
    granted, total = allowance or Allowance(), 1 + 2 * seeds + (further if seeds else 0)
    first = Trial(scenario, observers, granted, recorded=recorded)
    nominal = first.played(
        record=record,
        warn=warn,
        building=building,
        progress=lambda _what, _done, rows: report(
            f"nominal run of {rows - 1} observers and presets, each compiled once", 0, total
        ),
    )
    if any(score.failure is None for score in nominal.scores):
        require_any(nominal)
    with make_executor(workers) as executor:
        search = _Search(first, executor, report, total, [nominal])
        search.stopped = INTERRUPTED if nominal.interrupted else ""
        rows = search.run(seeds, further)
    report("done", total, total)
    done = {benchmark.disturbance.name: benchmark.disturbance for benchmark in search.found}
    return Choice(scenario, rows, nominal, tuple(done.values()), granted, search.stopped)


@dataclass
class _Search:
    """The disturbed runs of a choice, in rounds.

    Args:
        first: the nominal trial. executor: where runs are done. report: of progress. total: number of runs to be
            expected. found: what is known so far, the nominal run first. stopped: why no more follow, or empty.
    """

    first: Trial
    executor: Executor
    report: Progress
    total: int
    found: list[ObserverBenchmark]
    stopped: str = field(default="", init=False)

    def run(self, seeds: int, further: int) -> list[Row]:
        """All rows on the seeds, what is safe also on harder ones, the best on further ones; in order."""
        self._round("disturbed", self._rows(), range(1, seeds + 1))
        rows = merged(self._rows())
        self._round("harder", [row for row in rows if row.safe], range(1, seeds + 1), HARDER)
        kept = {row.score.name: row.also for row in rows}
        had: set[str] = set()
        while further and seeds and not self.stopped:
            rows = self._rows(kept)
            best = [row for row in contenders(rows) if row.score.name not in had]
            if not best:
                break
            had |= {row.score.name for row in best}
            self._round(f"further, {len(best)} of the best", best, range(seeds + 1, seeds + further + 1))
        return ranked(self._rows(kept))

    def _round(self, what: str, rows: Sequence[Row], numbers: Sequence[int], factor: float = 1.0) -> None:
        """Run these rows, as far as they came through so far, on disturbances of these numbers."""
        again = {row.score.name: row.candidate.asked for row in rows if row.used and not row.failures}
        if not again or self.stopped:
            return
        trials = [replace(self.first, observers=again, number=number, factor=factor) for number in numbers]
        before = len(self.found)
        self.total = max(self.total, before + len(trials))
        others, self.stopped = tried(
            trials, self.executor, lambda done: self.report(what, min(before + done, self.total), self.total)
        )
        self.found += others

    def _rows(self, kept: Mapping[str, Sequence[str]] | None = None) -> list[Row]:
        """What the runs say of each observer; of those kept, with the presets that are the same."""
        names = [score.name for score in self.found[0].scores]
        every = [row_of(self.first.scenario.where, name, self.found) for name in names]
        return every if kept is None else [replace(r, also=kept[r.score.name]) for r in every if r.score.name in kept]


def scenario_for_fmu(path: str | Path, assumed: Sequence[str] = ()) -> Scenario:
    """The scenario that `cosim new` writes for a plant FMU; no file is written.

    Args:
        path: of the FMU. assumed: what is known of its variables, as for `StarterWishes`.

    Raises:
        CosimError: the FMU cannot be read, or nothing in it looks like a train.
    """
    file = Path(path).resolve()
    made = starter(file, file.with_suffix(".toml"), StarterWishes(assumed=assumed))
    if made.kind == "observer":
        raise ScenarioError(
            f"{path} is an observer and no train. To see it beside the others: cosim new {file.name}, your train into "
            f"that scenario, then cosim choose {file.stem}.toml."
        )
    if made.kind != "train":
        raise ScenarioError(f"{path}: no train in it, so there is nothing to choose for. {' '.join(made.remarks)}")
    tables = _without_observers(tomllib.loads(made.text)) | {"title": file.name}
    return Scenario(folder=file.parent, where=f"{file.stem}.toml", **tables)


def _without_observers(data: dict[str, Any]) -> dict[str, Any]:
    """The tables of a starter without its observer, which is a guess as the mass is that it was given."""
    guessed = {name for name, table in data["components"].items() if "observer" in table}
    kept = dict(data, components={name: table for name, table in data["components"].items() if name not in guessed})
    lines = [line.partition(" -> ") for line in data["connections"] if isinstance(line, str)]
    left = [
        (source, [t for t in targets.split(", ") if t.partition(".")[0] not in guessed]) for source, _, targets in lines
    ]
    tables = [line for line in data["connections"] if not isinstance(line, str)]
    kept["connections"] = [
        *(f"{source} -> {', '.join(targets)}" for source, targets in left if targets),
        *(table for table in tables if table["to"].partition(".")[0] not in guessed),
    ]
    kept["report"] = {key: value for key, value in data.get("report", {}).items() if key != "observers"}
    kept.pop("expect", None)
    return kept
