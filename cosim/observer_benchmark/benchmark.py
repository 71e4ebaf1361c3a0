"""Comparison of observers: one recorded run of the plant side, played back to each observer in turn."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable, Sequence
from contextlib import ExitStack
from math import inf
from pathlib import Path
from typing import Any

from cosim.balises.recorded import read_layout
from cosim.errors import CosimError, RunError, ScenarioError
from cosim.evaluation.result_warnings import largest_tolerable
from cosim.evaluation.spec import ReportSpec
from cosim.observer_benchmark.benchmark_scores import BenchmarkScores
from cosim.observer_benchmark.candidates import BenchmarkCandidate, find_candidates
from cosim.observer_benchmark.observer_scores import CertifiedGap, ObserverScore, divergence, longest_gap, measured
from cosim.observer_benchmark.playback import ScenarioParts, find_parts, playback_scenario, recording_scenario
from cosim.results.load_result import load_result
from cosim.results.result import Result
from cosim.results.results_folder import write_results
from cosim.run.certificates import check_certificates
from cosim.run.expected_gaps import expected_gap
from cosim.run.layouts import make_layout
from cosim.run.outcome import INTERRUPTED, Outcome
from cosim.run.run_seeds import with_seeds
from cosim.scenario.schema import step_count
from cosim.simulation.scenario import Scenario

Progress = Callable[[str, int, int], None]
_MICROSECONDS = 1e6


class ObserverBenchmark(BenchmarkScores):
    """Observers beside one recorded run; arguments as for `BenchmarkScores`."""

    def write(self, directory: str | Path) -> dict[str, Path]:
        """Write page, picture and data to a folder.

        Args:
            directory: the folder; created where it does not exist.

        Returns:
            Paths by kind: ``page``, ``picture``, ``data``.

        Raises:
            OutputError: the folder cannot be written.
        """
        from cosim.report.page.observer_page import write_benchmark  # noqa: PLC0415 - matplotlib only for those who write

        return write_benchmark(self, directory)


def benchmark_observers(
    scenario: Scenario,
    observers: Sequence[Any] | None = None,
    *,
    record: str | Path | None = None,
    recorded: str | Path | None = None,
    repeat: int = 1,
    progress: Progress | None = None,
    warn: Callable[[str], None] | None = None,
) -> ObserverBenchmark:
    """Run the plant side of a scenario once and play it back to several observers, each alone.

    Args:
        scenario: with or without observers of its own.
        observers: names of components of the scenario or of shipped observers, ``file.py:Class``, classes or instances.
            None: the scenario's own, and all shipped train observers whose inputs and event the scenario can serve.
        record: folder for the recording, an ordinary results folder; by default it is thrown away.
        recorded: folder of an earlier recording (or of any run of this scenario) to be played back instead of a new
            run.
        repeat: runs of each observer; the cost per step is the median of them.
        progress: called with what is done now, the number done and the number in all.
        warn: receives what is doubtful about the recorded run.

    Returns:
        Scores; an observer that fails is among them with the reason.

    Raises:
        ScenarioError: an observer is unknown, or the scenario has none. RunError: the run of the plant side failed.
        CosimError: the scenario cannot be set up.
    """
    if repeat < 1:
        raise ScenarioError(f"repeat must be at least 1, got {repeat}.")
    parts = find_parts(scenario)
    candidates, notes = find_candidates(scenario, parts, observers)
    if not candidates:
        raise ScenarioError(f"{scenario.where}: no observer fits this scenario. " + " ".join(notes))
    report = progress or (lambda _what, _done, _all: None)
    total = len(candidates) * repeat + 1
    with ExitStack() as stack:
        report("recording", 0, total)
        folder = Path(recorded) if recorded is not None else None
        if folder is None:
            folder = Path(record) if record is not None else Path(stack.enter_context(tempfile.TemporaryDirectory()))
            _record(recording_scenario(scenario, parts), folder, warn, keep=record is not None)
        notes = [*_loop_notes(parts, load_result(folder)), *notes]
        judge = _Judge(scenario, parts, folder, repeat, lambda what, done: report(what, done + 1, total))
        scores = judge.scores(candidates)
        interrupted = len(scores) < len(candidates)
        if interrupted:
            notes.append(f"Interrupted; not judged: {', '.join(c.name for c in candidates[len(scores) :])}.")
        report("done", total, total)
    spec = _spec_of_all(parts.table.title, judge.outcomes.values())
    return ObserverBenchmark(scenario.name, spec, tuple(scores), tuple(notes), judge.steps, judge.outcomes, interrupted)


def _spec_of_all(title: str, outcomes: Iterable[Outcome]) -> ReportSpec:
    """The roles of the recorded run, without observers."""
    spec = next((outcome.spec for outcome in outcomes), ReportSpec(title=title))
    return ReportSpec(**{**vars(spec), "title": title, "observers": []})


def _record(scenario: Scenario, folder: Path, warn: Callable[[str], None] | None, *, keep: bool) -> None:
    """Run the plant side and write it; where the folder is kept, also what a run left that did not end."""
    outcome = scenario.run(warn=warn or _ignore)
    if keep or outcome.failure is None:
        write_results(outcome.result, folder, ("csv", "npy") if keep else ("npy",))
    if outcome.failure == INTERRUPTED:
        raise KeyboardInterrupt
    if outcome.failure is not None:
        raise RunError(f"The run of the plant side failed, so there is nothing to play back: {outcome.failure}")


def _loop_notes(parts: ScenarioParts, recording: Result) -> list[str]:
    """What to know of the recording: who acted on the train in it, and whether every step is there."""
    notes = []
    if parts.acting:
        names = ", ".join(parts.acting)
        notes.append(
            f"{names} acts on the train in this scenario: the run was recorded with it in the loop, and every observer "
            "only listens to that run. What the train would do with another one in the loop is not told."
        )
    steps = step_count(parts.table.start, parts.table.stop, parts.table.step)
    if len(recording.time) < steps + 1:
        notes.append(
            f"The recording has {len(recording.time)} rows for {steps} steps; inputs between them are interpolated, "
            "and numbers differ from those of a run by that."
        )
    return notes


# -- judging ----------------------------------------------------------------------------------------------------------


class _Judge:
    """Runs observers one by one beside a recording."""

    def __init__(
        self, scenario: Scenario, parts: ScenarioParts, folder: Path, repeat: int, report: Callable[[str, int], None]
    ) -> None:
        self.scenario, self.parts, self.folder, self.repeat, self.report = scenario, parts, folder, repeat, report
        table = parts.table
        self.steps = step_count(table.start, table.stop, table.step)
        self.outcomes: dict[str, Outcome] = {}
        self._expected, self._seen = self._gaps()

    def scores(self, candidates: Sequence[BenchmarkCandidate]) -> list[ObserverScore]:
        """The scores of all, or, where somebody interrupts, of those that are judged by then.

        Raises:
            KeyboardInterrupt: none is.
        """
        found: list[ObserverScore] = []
        try:
            for candidate in candidates:
                found.append(self.score(candidate, len(found) * self.repeat))
        except KeyboardInterrupt:
            if not found:
                raise
        return found

    def score(self, candidate: BenchmarkCandidate, done: int) -> ObserverScore:
        """The score of one observer; one that fails has the reason in it."""
        labelled = {
            "label": candidate.table.label or candidate.name,
            "model": candidate.model,
            "origin": candidate.origin,
        }
        known: dict[str, Any] = labelled | {
            "settings": candidate.settings,
            "in_loop": candidate.name in self.parts.acting,
            "certificate": self._certificate(candidate),
        }
        if candidate.misfit:
            return ObserverScore(candidate.name, failure=f"cannot be coupled: {candidate.misfit}", **known)
        try:
            return self._run(candidate, done, known)
        except CosimError as error:
            return ObserverScore(candidate.name, failure=f"cannot be coupled: {error}", **known)

    def _run(self, candidate: BenchmarkCandidate, done: int, known: dict[str, Any]) -> ObserverScore:
        name = candidate.name
        scenario = playback_scenario(self.scenario, self.parts, self.folder, name, candidate.table, candidate.sources)
        costs = []
        for again in range(self.repeat):
            self.report(candidate.table.label or name, done + again)
            outcome = scenario.run(warn=_ignore)
            if outcome.failure == INTERRUPTED:
                raise KeyboardInterrupt
            reached = max(
                round((outcome.result.summary["reached"] - self.parts.table.start) / self.parts.table.step), 1
            )
            costs.append(_MICROSECONDS * outcome.result.summary["seconds"][name] / reached)
        self.outcomes[name] = outcome
        kind = next(c["kind"] for c in outcome.result.summary["components"] if c["name"] == name)
        scores = measured(outcome.result, outcome.spec, name)
        failure = outcome.failure or divergence(scores.get("whole"), largest_tolerable(outcome.result, outcome.spec))
        return ObserverScore(name, failure=failure, costs=tuple(costs), kind=kind, **known, **scores)

    def _gaps(self) -> tuple[Any, float | None]:
        """Gap to expect from the scenario, and the longest one told in the recording."""
        table = with_seeds(self.parts.table)
        if table.balises is None:
            return None, None
        layout = make_layout(table.balises, table.start, table.stop, self.scenario.folder, self.scenario.where)
        events = [e for e in read_layout(self.folder).records if table.start < e.stamp <= table.stop]
        return expected_gap(layout, table.balises, table.start), longest_gap(events, table.start)

    def _certificate(self, candidate: BenchmarkCandidate) -> CertifiedGap | None:
        if self._expected is None or candidate.table.observer is None:
            return None
        try:
            found, _ = check_certificates(
                {candidate.name: candidate.table}, {candidate.name: self._expected}, "warn", self.scenario.where
            )
        except (CosimError, ValueError, ArithmeticError):
            return None  # parameters that cannot be: the run of this observer says so
        if candidate.name not in found:
            return None
        limit = found[candidate.name]["certified_up_to"]
        # plain data have None for an infinite limit
        return CertifiedGap(inf if limit is None else limit, self._expected.seconds, self._seen)


def _ignore(_text: str) -> None:
    """What is doubtful about an observer stands in its score."""
