"""Scores of several observers beside one recorded run, as data, with their tables for a terminal. Touches no file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from cosim.evaluation.error_table import error_text
from cosim.evaluation.spec import ReportSpec
from cosim.observer_benchmark.observer_scores import ObserverScore
from cosim.observer_benchmark.observer_table import aligned, main_row
from cosim.run.outcome import Outcome
from fmus.tables.numbers import cell


@dataclass(frozen=True)
class BenchmarkScores:
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
