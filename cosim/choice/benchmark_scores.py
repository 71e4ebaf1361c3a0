"""Scores of several observers beside one recorded run, as data, with their tables for a terminal. Touches no file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from cosim.choice.candidates import BenchmarkCandidate
from cosim.choice.disturbances import Disturbance
from cosim.choice.observer_scores import ObserverScore
from cosim.choice.observer_table import observer_table
from cosim.evaluation.error_table import error_table
from cosim.evaluation.spec import ReportSpec
from cosim.run.outcome import Outcome
from fmus.tables.table import Parts, Readable, Table


@dataclass(frozen=True)
class BenchmarkScores(Readable):
    """Observers beside one recorded run.

    Args:
        scenario: its name. spec: roles and phases. scores: of the observers, in the order asked for.
        notes: what the reader must know: who acts on the train, what was assumed, what was left out.
        steps: communication steps of the run. outcomes: of the runs, by observer.
        interrupted: whether somebody stopped it; there are scores then of some observers only.
        disturbance: what was wrong with what observers know and hear. candidates: how they are set, by observer.
    """

    scenario: str
    spec: ReportSpec
    scores: tuple[ObserverScore, ...]
    notes: tuple[str, ...]
    steps: int
    outcomes: Mapping[str, Outcome]
    interrupted: bool = False
    disturbance: Disturbance = field(default_factory=Disturbance)
    candidates: Mapping[str, BenchmarkCandidate] = field(default_factory=dict)

    @property
    def failed(self) -> list[str]:
        """Names of the observers without numbers, or whose numbers end early."""
        return [score.name for score in self.scores if score.failure is not None]

    def parts(self) -> Parts:
        """The main table, errors by phase, what failed, and what the reader must know."""
        failed = [f"{score.label}: {score.failure}" for score in self.scores if score.failure]
        return [self.table(), self.errors(), "\n".join([*failed, *(f"- {note}" for note in self.notes)])]

    def table(self) -> Table:
        """The main table: one row for each observer."""
        title = f"{self.spec.title}: {len(self.scores)} observers on one recorded run of {self.steps} steps"
        return replace(observer_table(self.scores), title=title)

    def errors(self) -> Table:
        """Errors of each observer in each phase."""
        return error_table([phase for score in self.scores for phase in score.phases], self.labelled_spec())

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
