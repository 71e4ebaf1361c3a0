"""Comparison of observers: one recorded run of the plant side, played back to each observer in turn."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from math import inf
from pathlib import Path
from typing import Any

import fmu_observer
from cosim.balises.recorded import read_layout
from cosim.coupling.connection import Link
from cosim.errors import CosimError, RunError, ScenarioError, nearest
from cosim.evaluation.error_table import error_text
from cosim.evaluation.numbers import cell
from cosim.evaluation.spec import ReportSpec
from cosim.observer_benchmark.observer_scores import CertifiedGap, ObserverScore, divergence, longest_gap, measured
from cosim.observer_benchmark.observer_table import aligned, main_row
from cosim.observer_benchmark.playback import (
    FACTS,
    Sides,
    find_sides,
    known_facts,
    playback_scenario,
    recording_scenario,
    told_to,
    train_observers,
)
from cosim.results.folder import write_results
from cosim.results.load import load_result
from cosim.results.result import Result
from cosim.scenario.balise_service import BALISE_EVENT
from cosim.scenario.certificates import check_certificates, expected_gap
from cosim.scenario.layouts import make_layout
from cosim.scenario.model_name import ModelName, settings_of
from cosim.scenario.models import make_declared
from cosim.scenario.outcome import INTERRUPTED, Outcome
from cosim.scenario.paths import absolute, move_file
from cosim.scenario.schema import step_count
from cosim.scenario.tables import ComponentTable
from cosim.simulation.scenario import Scenario
from plant_models.user_file import names_code

Progress = Callable[[str, int, int], None]
MICROSECONDS = 1e6


@dataclass(frozen=True)
class Candidate:
    """An observer to be judged.

    Args:
        name: in the benchmark. table: how it is made. sources: where its inputs come from.
        origin: ``scenario`` or ``defaults``. settings: what was assumed, in words. misfit: why it cannot be coupled, or
            empty.
    """

    name: str
    table: ComponentTable
    sources: Mapping[str, Link]
    origin: str
    settings: tuple[str, ...] = ()
    misfit: str = ""

    @property
    def model(self) -> str:
        """Shipped observer or FMU."""
        return str(self.table.observer or self.table.model or self.table.fmu)


@dataclass(frozen=True)
class ObserverBenchmark:
    """Observers beside one recorded run.

    Args:
        scenario: its name. spec: roles and phases. scores: of the observers, in the order asked for.
        notes: what the reader must know: who acts on the train, what was assumed, what was left out.
        steps: communication steps of the run. outcomes: of the runs, by observer.
        interrupted: whether somebody stopped it; there are scores then of some observers only.
    """

    scenario: str
    spec: ReportSpec
    scores: tuple[ObserverScore, ...]
    notes: tuple[str, ...]
    steps: int
    outcomes: Mapping[str, Outcome]
    interrupted: bool = False

    @property
    def failed(self) -> list[str]:
        """Names of the observers without numbers, or whose numbers end early."""
        return [score.name for score in self.scores if score.failure is not None]

    def rows(self) -> list[dict[str, Any]]:
        """The main table: one row for each observer, columns with their units, numbers as they are."""
        return [main_row(score) for score in self.scores]

    def text(self) -> str:
        """The tables for a terminal."""
        rows = [{key: cell(value) for key, value in row.items()} for row in self.rows()]
        parts = [f"{self.spec.title}: {len(rows)} observers on one recorded run of {self.steps} steps", aligned(rows)]
        metrics = [phase for score in self.scores for phase in score.phases]
        if metrics:
            parts += ["", error_text(metrics, self.labelled_spec())]
        for score in self.scores:
            parts += [f"{score.label}: {text}" for text in ([score.failure] if score.failure else [])]
        return "\n".join([*parts, *(f"- {note}" for note in self.notes)])

    def labelled_spec(self) -> ReportSpec:
        """The roles with all observers of the benchmark and their labels."""
        labels = {score.name: score.label for score in self.scores}
        return ReportSpec(**{**vars(self.spec), "observers": list(labels), "labels": labels})

    def to_data(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "scenario": self.scenario,
            "title": self.spec.title,
            "steps": self.steps,
            "notes": list(self.notes),
            "observers": [score.to_data() for score in self.scores],
        }

    def write(self, directory: str | Path) -> dict[str, Path]:
        """Write page, picture and data to a folder.

        Args:
            directory: the folder; created where it does not exist.

        Returns:
            Paths by kind: ``page``, ``picture``, ``data``.

        Raises:
            OutputError: the folder cannot be written.
        """
        from cosim.report.page.observers import write_benchmark  # noqa: PLC0415 - matplotlib only for those who write

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
        warn: told of what is doubtful about the recorded run.

    Returns:
        Scores; an observer that fails is among them with the reason.

    Raises:
        ScenarioError: an observer is unknown, or the scenario has none. RunError: the run of the plant side failed.
        CosimError: the scenario cannot be set up.
    """
    if repeat < 1:
        raise ScenarioError(f"repeat must be at least 1, got {repeat}.")
    sides = find_sides(scenario)
    candidates, notes = find_candidates(scenario, sides, observers)
    if not candidates:
        raise ScenarioError(f"{scenario.where}: no observer fits this scenario. " + " ".join(notes))
    tell = progress or (lambda _what, _done, _all: None)
    total = len(candidates) * repeat + 1
    with ExitStack() as stack:
        tell("recording", 0, total)
        folder = Path(recorded) if recorded is not None else None
        if folder is None:
            folder = Path(record) if record is not None else Path(stack.enter_context(tempfile.TemporaryDirectory()))
            _record(recording_scenario(scenario, sides), folder, warn, keep=record is not None)
        notes = [*_loop_notes(sides, load_result(folder)), *notes]
        judge = _Judge(scenario, sides, folder, repeat, lambda what, done: tell(what, done + 1, total))
        scores = judge.scores(candidates)
        interrupted = len(scores) < len(candidates)
        if interrupted:
            notes.append(f"Interrupted; not judged: {', '.join(c.name for c in candidates[len(scores) :])}.")
        tell("done", total, total)
    title = sides.table.title
    spec = next((o.spec for o in judge.outcomes.values()), ReportSpec(title=title))
    return ObserverBenchmark(
        scenario.name,
        ReportSpec(**{**vars(spec), "title": title, "observers": []}),
        tuple(scores),
        tuple(notes),
        judge.steps,
        judge.outcomes,
        interrupted,
    )


def _record(scenario: Scenario, folder: Path, warn: Callable[[str], None] | None, *, keep: bool) -> None:
    """Run the plant side and write it; where the folder is kept, also what a run left that did not end."""
    outcome = scenario.run(warn=warn or _silent)
    if keep or outcome.failure is None:
        write_results(outcome.result, folder, ("csv", "npy") if keep else ("npy",))
    if outcome.failure == INTERRUPTED:
        raise KeyboardInterrupt
    if outcome.failure is not None:
        raise RunError(f"The run of the plant side failed, so there is nothing to play back: {outcome.failure}")


def _loop_notes(sides: Sides, recording: Result) -> list[str]:
    """What to know of the recording: who acted on the train in it, and whether every step is there."""
    notes = []
    if sides.acting:
        names = ", ".join(sides.acting)
        notes.append(
            f"{names} acts on the train in this scenario: the run was recorded with it in the loop, and every observer "
            f"only "
            "listens to that run. What the train would do with another one in the loop is not told."
        )
    steps = step_count(sides.table.start, sides.table.stop, sides.table.step)
    if len(recording.time) < steps + 1:
        notes.append(
            f"The recording has {len(recording.time)} rows for {steps} steps; inputs between them are interpolated, "
            f"and numbers "
            "differ from those of a run by that."
        )
    return notes


# -- who takes part
# -----------------------------------------------------------------------------------------------------


def find_candidates(scenario: Scenario, sides: Sides, names: Sequence[Any] | None) -> tuple[list[Candidate], list[str]]:
    """The observers to be judged, and notes on what was assumed and left out.

    Args:
        scenario: for messages. sides: of it. names: those asked for; None for all that fit.

    Raises:
        ScenarioError: a name is neither an observer of the scenario nor a shipped one.
    """
    if names is not None:
        asked = {name if isinstance(name, str) else id(name): name for name in names}
        found = _told_apart([_named(scenario, sides, name) for name in asked.values()])
        return found, [f"{c.name}: {text}" for c in found for text in c.settings]
    own = [_own(sides, name) for name in sides.observers]
    used = {sides.table.components[name].observer for name in sides.observers}
    others = [_shipped(sides, name) for name in train_observers() if name not in used]
    reasons = dict.fromkeys(c.misfit for c in others if c.misfit)
    left_out = [f"left out, as {why}: {', '.join(c.model for c in others if c.misfit == why)}" for why in reasons]
    found = [*own, *(c for c in others if not c.misfit)]
    return found, [*(f"{c.name}: {text}" for c in found for text in c.settings), *left_out]


def _told_apart(candidates: Sequence[Candidate]) -> list[Candidate]:
    """Candidates of which no two have one name: two instances of a class, say."""
    names = [candidate.name for candidate in candidates]
    earlier = [names[:place].count(name) for place, name in enumerate(names)]
    return [replace(c, name=f"{c.name}_{n + 1}") if n else c for c, n in zip(candidates, earlier, strict=True)]


def _named(scenario: Scenario, sides: Sides, given: Any) -> Candidate:
    """An observer of the scenario, or one by the name of its model, or a class or an instance from a script."""
    if isinstance(given, str) and given in sides.observers:
        return _own(sides, given)
    try:
        name = ModelName.of(given)
    except ValueError as error:
        raise ScenarioError(f"{scenario.where}: {error}") from error
    if name.given is None and not names_code(name) and name not in fmu_observer.OBSERVERS:
        known = [*sides.observers, *(n for n in train_observers() if n not in sides.observers)]
        raise ScenarioError(f"{scenario.where}: unknown observer {name!r}; {nearest(name, known)}")
    if name.given is None:
        name = ModelName.of(move_file(name, lambda path: absolute(path, ".")))
    return _shipped(sides, name)


def _own(sides: Sides, name: str) -> Candidate:
    return Candidate(name, sides.table.components[name], sides.sources(name), "scenario")


def _shipped(sides: Sides, model: str) -> Candidate:
    """An observer with its own defaults and what the scenario says of the train."""
    said = settings_of(getattr(model, "given", None))  # what an instance says of the train stands
    table = ComponentTable.model_validate({"observer": model, **said})
    system = make_declared(table, model)
    name = model.rpartition(":")[2].replace(".", "_")
    parameters = {s.name for s in told_to(system)}
    untold = parameters - table.parameters.keys()
    facts = {fact: known for fact, known in known_facts(sides).items() if fact in untold}
    told = {fact: value for fact, (value, _) in facts.items()}
    table = table.model_copy(update={"parameters": {**table.parameters, **told}})
    template = sides.template()
    sources = {s.name: template[s.name] for s in system.inputs if s.name in template}
    unique = name if name not in sides.table.components else f"{name}_with_defaults"
    settings = (_assumed(system, facts),) if parameters & set(FACTS) else ()
    return Candidate(unique, table, sources, "defaults", settings, _misfit(sides, system, sources))


def _assumed(system: Any, facts: Mapping[str, tuple[float, str]]) -> str:
    given = ", ".join(f"{fact} = {value:g} ({why})" for fact, (value, why) in facts.items())
    units = {s.name: (s.start, s.unit) for s in told_to(system)}
    rest = ", ".join(
        f"{f} = {units[f][0]:g}" + (f" {units[f][1]}" if units[f][1] != "1" else "")
        for f in FACTS
        if f in units and f not in facts
    )
    return (
        f"not set in the scenario, gains at their defaults; told {given or 'nothing of the train'}; assumed "
        f"{rest or 'nothing'}."
    )


def _misfit(sides: Sides, system: Any, sources: Iterable[str]) -> str:
    """Why an observer cannot listen here, or an empty text."""
    triggered = getattr(system, "triggered_events", ())  # plain Python says with its `balise` what it takes
    payload = {s.name for event in triggered for s in event.payload}
    missing = [s.name for s in system.inputs if s.name not in sources and s.name not in payload]
    if missing:
        return f"nothing in this scenario gives its input{'s' if len(missing) > 1 else ''} {', '.join(missing)}"
    if BALISE_EVENT in [event.name for event in triggered] and sides.table.balises is None:
        return "it is corrected by balises, and this scenario has none"
    return ""


# -- judging
# ------------------------------------------------------------------------------------------------------------


class _Judge:
    """Runs observers one by one beside a recording."""

    def __init__(
        self, scenario: Scenario, sides: Sides, folder: Path, repeat: int, tell: Callable[[str, int], None]
    ) -> None:
        self.scenario, self.sides, self.folder, self.repeat, self.tell = scenario, sides, folder, repeat, tell
        table = sides.table
        self.steps = step_count(table.start, table.stop, table.step)
        self.outcomes: dict[str, Outcome] = {}
        self._expected, self._seen = self._gaps()

    def scores(self, candidates: Sequence[Candidate]) -> list[ObserverScore]:
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

    def score(self, candidate: Candidate, done: int) -> ObserverScore:
        """The score of one observer; one that fails has the reason in it."""
        labelled = {
            "label": candidate.table.label or candidate.name,
            "model": candidate.model,
            "origin": candidate.origin,
        }
        known: dict[str, Any] = labelled | {
            "settings": candidate.settings,
            "in_loop": candidate.name in self.sides.acting,
            "certificate": self._certificate(candidate),
        }
        if candidate.misfit:
            return ObserverScore(candidate.name, failure=f"cannot be coupled: {candidate.misfit}", **known)
        try:
            return self._run(candidate, done, known)
        except CosimError as error:
            return ObserverScore(candidate.name, failure=f"cannot be coupled: {error}", **known)

    def _run(self, candidate: Candidate, done: int, known: dict[str, Any]) -> ObserverScore:
        name = candidate.name
        scenario = playback_scenario(self.scenario, self.sides, self.folder, name, candidate.table, candidate.sources)
        costs = []
        for again in range(self.repeat):
            self.tell(candidate.table.label or name, done + again)
            outcome = scenario.run(warn=_silent)
            if outcome.failure == INTERRUPTED:
                raise KeyboardInterrupt
            reached = max(
                round((outcome.result.summary["reached"] - self.sides.table.start) / self.sides.table.step), 1
            )
            costs.append(MICROSECONDS * outcome.result.summary["seconds"][name] / reached)
        self.outcomes[name] = outcome
        kind = next(c["kind"] for c in outcome.result.summary["components"] if c["name"] == name)
        scores = measured(outcome.result, outcome.spec, name)
        failure = outcome.failure or divergence(scores.get("whole"))
        return ObserverScore(name, failure=failure, costs=tuple(costs), kind=kind, **known, **scores)

    def _gaps(self) -> tuple[Any, float | None]:
        """Gap to expect from the scenario, and the longest one told in the recording."""
        table = self.sides.table
        if table.balises is None:
            return None, None
        layout = make_layout(table.balises, table.start, table.stop, self.scenario.folder, self.scenario.where)
        events = [e for e in read_layout(self.folder).records if table.start < e.stamp <= table.stop]
        return expected_gap(layout, table.balises, table.start), longest_gap(events, table.start)

    def _certificate(self, candidate: Candidate) -> CertifiedGap | None:
        if self._expected is None or candidate.table.observer is None:
            return None
        try:
            found, _ = check_certificates(
                {candidate.name: candidate.table}, self._expected, "warn", self.scenario.where
            )
        except (CosimError, ValueError, ArithmeticError):
            return None  # parameters that cannot be: the run of this observer says so
        if candidate.name not in found:
            return None
        limit = found[candidate.name]["aperiodic_limit"]
        # plain data have None for an infinite limit
        return CertifiedGap(inf if limit is None else limit, self._expected.seconds, self._seen)


def _silent(_text: str) -> None:
    """What is doubtful about an observer stands in its score."""
