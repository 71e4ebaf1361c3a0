"""Jobs of a campaign: a chunk of its runs, whose rows go to the store where they are done; a run kept whole."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from cosim.campaign.plan import Planned
from cosim.campaign.store import FIXED, Row, Store, stored_setting
from cosim.run.outcome import INTERRUPTED, Outcome
from cosim.runs.job import Ended, Failure, Job, perform
from cosim.runs.keys import digest
from cosim.runs.run import Run
from cosim.runs.runnable import RunnableScenario
from cosim.scenario.origin import ForeignFile
from cosim.studies.measures import error_measures

EXPECT = "expect: "
"""Begins the name of the column that says whether an expectation is met, 1 or 0."""


def campaign_measures(outcome: Outcome) -> dict[str, float]:
    """What a campaign keeps of a run: `error_measures`, and for each expectation whether it is met.

    Args:
        outcome: of the run.
    """
    judged = outcome.expectations if outcome.failure is None else []
    return error_measures(outcome) | {f"{EXPECT}{one.name}": float(one.passed) for one in judged}


@dataclass(frozen=True)
class Keyed:
    """A run with its key.

    Args:
        key: digest of all that its row follows from. planned: its place and settings.
    """

    key: str
    planned: Planned

    def row(self, kinds: Mapping[str, str], ended: Ended) -> Row:
        """Its row.

        Args:
            kinds: types of settings by name. ended: what the run left.
        """
        settings = {n: stored_setting(value, kinds[n]) for n, value in self.planned.settings.items()}
        taken = {*FIXED, *settings}
        measures = {f"measured {n}" if n in taken else n: v for n, v in (ended.row or {}).items()}
        place = {"number": self.planned.number, "point": self.planned.point, "design": self.planned.design}
        failure = None if ended.failure is None else ended.failure.reason
        counts = {"failure": failure, "warnings": len(ended.warnings), "seconds": ended.seconds}
        return {"key": self.key, **place, **settings, **measures, **counts}


@dataclass(frozen=True)
class RunChunk(Job):
    """Some runs of a campaign.

    Args:
        number: of the chunk. runs: in it. scenario: that is varied. store: where rows go. attempt: who does it.
    """

    number: int
    runs: Sequence[Keyed]
    scenario: RunnableScenario
    store: Store
    attempt: str
    settings: Mapping[str, Any] = field(default_factory=dict)

    @property
    def key(self) -> str:
        """Digest of the keys of its runs."""
        return digest(*(run.key for run in self.runs))

    def do(self) -> Ended:
        """Its rows, and whether this machine sees the folder of the campaign, so that they are in the store."""
        is_here = self.store.is_here()
        rows = self.store.known(self.number) if is_here else {}
        outside: Failure | None = None
        for run in (run for run in self.runs if run.key not in rows):
            if is_here:
                self.store.note(self.number, self.attempt, {"key": run.key})
            ended = perform(Run(self.scenario, run.planned.settings, campaign_measures))
            if ended.failure is not None and ended.failure.outside:
                outside = ended.failure
                if outside.reason == INTERRUPTED:
                    break
                continue
            rows[run.key] = run.row(self.store.settings, ended)
            if is_here:
                self.store.note(self.number, self.attempt, rows[run.key])
        if is_here and all(run.key in rows for run in self.runs):
            self.store.commit(self.number, list(rows.values()))
        return Ended({"rows": list(rows.values()), "here": is_here}, outside)

    def files(self) -> Sequence[ForeignFile]:
        """The files that the scenario names."""
        return self._first.files()

    def code(self) -> Sequence[Callable[..., Any]]:
        """Classes that a script put into the scenario."""
        return self._first.code()

    def moved(self, places: Mapping[str, str]) -> RunChunk:
        """The same chunk with its files at other places."""
        return replace(self, scenario=Run(self.scenario).moved(places).scenario)

    @property
    def _first(self) -> Run:
        return Run(self.scenario, {}, campaign_measures)

    @property
    def apart(self) -> bool:
        """Whether a run may take its process along."""
        return Run(self.scenario, self.runs[0].planned.settings).apart


@dataclass(frozen=True)
class KeptRun(Job):
    """A run whose whole results are written to a folder while it goes on.

    Args:
        scenario: that is varied. settings: of the run. folder: for its results.
    """

    scenario: RunnableScenario
    settings: Mapping[str, Any]
    folder: Path

    @property
    def key(self) -> str:
        """Its folder."""
        return str(self.folder)

    def do(self) -> Ended:
        """What `campaign_measures` takes of it."""
        outcome = self.scenario.run(overrides=self.settings, warn=lambda _: None, progress=False)
        outcome.with_summary(sweep_settings=dict(self.settings)).write(self.folder, report=False)
        return Ended(campaign_measures(outcome), warnings=tuple(outcome.warnings))
