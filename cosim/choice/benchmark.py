"""Comparison of observers: one recorded run of the plant side, played back to all of them."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Self

from cosim.choice.allowance import Allowance
from cosim.choice.benchmark_scores import BenchmarkScores
from cosim.choice.candidates import BenchmarkCandidate, Observers, find_candidates
from cosim.choice.disturbances import Disturbance, Journey
from cosim.choice.disturbed_playback import believing, channels, disturbed
from cosim.choice.known_parameters import derived_parameters, mass_remarks, stated_parameters, true_signals
from cosim.choice.observer_runs import ObserverRun, ObserverRuns
from cosim.choice.observer_scores import ObserverScore, divergence, gap_certified, longest_gap, measured
from cosim.choice.playback import ScenarioParts, find_parts, recording_scenario
from cosim.errors import CosimError, RunError, ScenarioError
from cosim.evaluation.plausible_speeds import speed_warnings
from cosim.evaluation.result_warnings import largest_tolerable
from cosim.evaluation.roles import recorded as recorded_signal
from cosim.evaluation.spec import ReportSpec
from cosim.report.page.observer_page import write_benchmark
from cosim.results.load_result import load_result
from cosim.results.result import Result
from cosim.results.results_folder import write_results
from cosim.run.backends import Notify
from cosim.run.component_models import make_system
from cosim.run.expected_gaps import ExpectedGap, expected_gap
from cosim.run.layouts import make_layout
from cosim.run.observer_findings import evaluated
from cosim.run.outcome import INTERRUPTED, Outcome
from cosim.run.recorded_plant import other_plant
from cosim.run.run_seeds import with_seeds
from cosim.scenario.schema import step_count
from cosim.simulation.scenario import Scenario
from fmu_observer.certificates.finding import Finding

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
        return write_benchmark(self, directory)


def benchmark_observers(
    scenario: Scenario,
    observers: Observers = None,
    *,
    record: str | Path | None = None,
    recorded: str | Path | None = None,
    repeat: int = 1,
    disturb: Callable[[Journey], Disturbance] | None = None,
    allowance: Allowance | None = None,
    progress: Progress | None = None,
    warn: Notify | None = None,
    building: Notify | None = None,
) -> ObserverBenchmark:
    """Run the plant side of a scenario once and play it back to several observers, all of them beside one recording.

    Args:
        scenario: with or without observers of its own.
        observers: names of components of the scenario or of shipped observers, with a preset as ``name:preset``,
            ``file.py:Class``, classes or instances; or a mapping of names to these. None: the scenario's own, and every
            preset of all shipped train observers whose inputs and event the scenario can serve.
        record: folder for the recording, an ordinary results folder; by default it is thrown away.
        recorded: folder of an earlier recording (or of any run of this scenario) to be played back instead of a new
            run.
        repeat: runs of each observer; the cost per step is the median of them. In each run it is the time in the calls
            of the observer, also where others are in the same run.
        disturb: what is wrong with what observers know and hear, from where the train was; None for nothing.
        allowance: what a position may be off; None for SUBSET-041.
        progress: called with what is done now, the number done and the number in all.
        warn: receives what is doubtful about the recorded run.
        building: receives the models that are compiled for the first time; by default the log ``cosim``.

    Returns:
        Scores; an observer that fails is among them with the reason.

    Raises:
        ScenarioError: an observer is unknown, or the scenario has none. RunError: the run of the plant side failed.
        CosimError: the scenario cannot be set up.
    """
    if repeat < 1:
        raise ScenarioError(f"repeat must be at least 1, got {repeat}.")
    parts = find_parts(scenario)
    stated = stated_parameters(scenario, parts)
    candidates, _ = find_candidates(scenario, parts, observers, stated)
    if not candidates or (observers is None and all(c.misfit for c in candidates)):
        reasons = "; ".join(dict.fromkeys(c.misfit for c in candidates))
        raise ScenarioError(f"{scenario.where}: no observer fits this scenario: {reasons or 'none is named'}.")
    report = progress or (lambda _what, _done, _all: None)
    total = len(candidates) * repeat + 1
    with tempfile.TemporaryDirectory() as scratch:
        report("recording", 0, total)
        folder = Path(recorded or record or scratch)
        if recorded is None:
            _record(recording_scenario(scenario, parts), folder, warn, building, keep=record is not None)
        result = load_result(folder)
        if warn and recorded and (other := other_plant(result, parts.table, parts.folder, parts.plant)):
            warn(other)
        known = derived_parameters(stated, parts, result)
        if warn is not None:
            for text in mass_remarks(known):
                warn(text)
        candidates, notes = find_candidates(scenario, parts, observers, known)
        wrong = Disturbance() if disturb is None else disturb(_journey(scenario, parts, result))
        runs = ObserverRuns(
            scenario,
            parts,
            folder,
            repeat,
            partial(disturbed, found=channels(wrong, parts, known), disturbance=wrong),
            lambda what, done: report(what, min(done + 1, total), total),
            building,
        )
        interrupted = _run(runs, [believing(c, wrong, scenario.folder) for c in candidates])
        report("done", total, total)
    evaluation = _Evaluation.of(scenario, parts, result, allowance or Allowance())
    return evaluation.benchmark(candidates, runs.found, notes, wrong, interrupted=interrupted)


def _journey(scenario: Scenario, parts: ScenarioParts, result: Result) -> Journey:
    """Where the train was.

    Raises:
        ScenarioError: nothing says which signals are its position and speed, or they are not those of one motion.
    """
    names = true_signals(parts)
    position, speed = (recorded_signal(result, name) for name in names)
    if position is None or speed is None:
        raise ScenarioError(
            f"{scenario.where}: nothing says where the train truly is. Name the signals under [balises] (position, "
            "speed) or [report] (true_position, true_speed)."
        )
    for text in speed_warnings(result, ReportSpec(true_position=names[0], true_speed=names[1])):
        raise ScenarioError(f"{scenario.where}: {text}")
    return Journey(result.time, position, speed)


def _left_out(candidates: Sequence[BenchmarkCandidate], scores: Sequence[ObserverScore]) -> list[str]:
    """What is missing after an interruption, in words."""
    known = {score.name for score in scores}
    missing = ", ".join(c.name for c in candidates if c.name not in known)
    return [f"Interrupted; not evaluated: {missing}." if missing else "Interrupted; the cost is that of fewer runs."]


def _run(runs: ObserverRuns, candidates: Sequence[BenchmarkCandidate]) -> bool:
    """Run all that fit; whether somebody interrupted.

    Raises:
        KeyboardInterrupt: somebody did before the first run was done.
    """
    try:
        runs.run([candidate for candidate in candidates if not candidate.misfit])
    except KeyboardInterrupt:
        if not runs.found:
            raise
        return True
    return False


def _spec_of_all(title: str, outcomes: Iterable[Outcome]) -> ReportSpec:
    """The roles of the recorded run, without observers."""
    spec = next((outcome.spec for outcome in outcomes), ReportSpec(title=title))
    return ReportSpec(**{**vars(spec), "title": title, "observers": []})


def _record(scenario: Scenario, folder: Path, warn: Notify | None, building: Notify | None, *, keep: bool) -> None:
    """Run the plant side and write it; where the folder is kept, also what a run left that did not end."""
    outcome = scenario.run(warn=warn or (lambda _text: None), progress=False, building=building)
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
            "only listens to that run. What the train would do with another one in the loop is not known."
        )
    steps = _steps(parts)
    if len(recording.time) < steps + 1:
        notes.append(
            f"The recording has {len(recording.time)} rows for {steps} steps; inputs between them are interpolated, "
            "and numbers differ from those of a run by that."
        )
    return notes


def _steps(parts: ScenarioParts) -> int:
    return step_count(parts.table.start, parts.table.stop, parts.table.step)


# -- scores -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Evaluation:
    """Makes scores of what the runs left.

    Args:
        scenario: that was recorded. parts: of it. recorded: its run. allowance: what a position may be off.
        expected: gap to expect [s]; None without balises.
        seen: longest gap in the recording [s], or None.
    """

    scenario: Scenario
    parts: ScenarioParts
    recorded: Result
    allowance: Allowance
    expected: ExpectedGap | None = None
    seen: float | None = None

    @classmethod
    def of(cls, scenario: Scenario, parts: ScenarioParts, recorded: Result, allowance: Allowance) -> Self:
        """The gaps to expect from a scenario, and the longest one in the recording."""
        table = with_seeds(parts.table)
        if table.balises is None:
            return cls(scenario, parts, recorded, allowance)
        layout = make_layout(table.balises, table.start, table.stop, scenario.folder, scenario.where)
        events = [e for e in recorded.events if table.start < e.stamp <= table.stop]
        expected = expected_gap(layout, table.balises, table.start)
        return cls(scenario, parts, recorded, allowance, expected, longest_gap(events, table.start))

    def benchmark(
        self,
        candidates: Sequence[BenchmarkCandidate],
        found: Mapping[str, ObserverRun],
        notes: Sequence[str],
        wrong: Disturbance,
        *,
        interrupted: bool,
    ) -> ObserverBenchmark:
        """All that is known after the runs, in the order of the candidates."""
        misfits = {c.name: ObserverRun(refusal=c.misfit) for c in candidates if c.misfit}
        known = {**found, **misfits}
        scores = tuple(self.score(c, known[c.name]) for c in candidates if c.name in known)
        left_out = _left_out(candidates, scores) if interrupted else []
        outcomes = {name: run.outcome for name, run in found.items() if run.outcome is not None}
        spec = _spec_of_all(self.parts.table.title, outcomes.values())
        texts = (*_loop_notes(self.parts, self.recorded), *notes, *left_out)
        steps, tables = _steps(self.parts), {c.name: c for c in candidates}
        return ObserverBenchmark(self.scenario.name, spec, scores, texts, steps, outcomes, interrupted, wrong, tables)

    def score(self, candidate: BenchmarkCandidate, run: ObserverRun) -> ObserverScore:
        """The score of one observer; one that fails has the reason in it."""
        name, outcome = candidate.name, run.outcome
        known: dict[str, Any] = {
            "label": candidate.table.label or name,
            "model": candidate.model,
            "origin": candidate.origin,
            "settings": candidate.settings,
            "in_loop": name in self.parts.acting,
            "certificate": self._certificate(candidate),
        }
        if outcome is None:
            return ObserverScore(name, failure=f"cannot be coupled: {run.refusal}", **known)
        kind = next(c["kind"] for c in outcome.result.summary["components"] if c["name"] == name)
        scores = measured(outcome.result, outcome.spec, name, self.allowance)
        failure = outcome.failure or divergence(scores.get("whole"), largest_tolerable(outcome.result, outcome.spec))
        costs = tuple(_MICROSECONDS * cost for cost in run.costs)
        return ObserverScore(name, failure=failure, costs=costs, kind=kind, **known, **scores)

    def _certificate(self, candidate: BenchmarkCandidate) -> Finding | None:
        if self.expected is None or candidate.table.observer is None:
            return None
        try:
            system = make_system(candidate.table, self.scenario.where)
            found, _ = evaluated(candidate.name, candidate.table, system, self.expected)
        except (CosimError, ValueError, ArithmeticError):
            return None  # parameters that cannot be: the run of this observer says so
        return None if found is None else gap_certified(found.value, self.expected.seconds, self.seen)
