"""Studies: one scenario over several balise seeds, medians and quartiles of the errors, beside published numbers."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from math import isnan
from typing import TYPE_CHECKING, Any

import numpy as np

from cosim.errors import RunError
from cosim.evaluation.metrics import phase_metrics
from cosim.evaluation.spec import ReportSpec
from fmus.text_table import text_table

if TYPE_CHECKING:
    from cosim.simulation.scenario import Scenario

QUARTILES = (25.0, 50.0, 75.0)


@dataclass
class SeedStudy:
    """Maximal speed errors of every observer in every phase, one for each seed.

    Args:
        spec: roles, phases and reference numbers of the scenario.
        seeds: seeds that were run.
        errors: (observer, phase) -> maximal speed errors [m/s], one for each seed.
    """

    spec: ReportSpec
    seeds: list[int]
    errors: dict[tuple[str, str], list[float]] = field(default_factory=dict)

    def quartiles(self, observer: str, phase: str) -> tuple[float, float, float]:
        """Lower quartile, median and upper quartile of the maximal speed error [m/s]."""
        low, middle, high = np.percentile(self.errors[observer, phase], QUARTILES)
        return float(low), float(middle), float(high)

    def rows(self) -> list[dict[str, Any]]:
        """One row for each observer and phase, reference numbers beside the measured."""
        rows = []
        for observer, phase in self.errors:
            low, median, high = self.quartiles(observer, phase)
            rows.append(
                {
                    "observer": self.spec.labels.get(observer, observer),
                    "phase": phase,
                    "lower quartile": low,
                    "median": median,
                    "upper quartile": high,
                    "independent": self.spec.independent.get(observer, {}).get(phase),
                    "published": self.spec.published.get(observer, {}).get(phase),
                }
            )
        return rows

    def text(self) -> str:
        """A plain-text table."""
        rows = [["observer", "phase", "quartile", "median", "quartile", "independent", "published"]]
        for observer, phase, *sizes in (row.values() for row in self.rows()):
            rows.append([observer, phase, *("-" if size is None else f"{size:.4f}" for size in sizes)])
        head = f"Maximal speed error over {len(self.seeds)} balise seeds [m/s]"
        return "\n".join([head, *text_table(rows, left=(0, 1))])

    def to_data(self) -> dict[str, Any]:
        """Plain data."""
        return {"seeds": self.seeds, "rows": self.rows()}


def seed_study(scenario: Scenario, seeds: Iterable[int], tell: Callable[[int, int], None] | None = None) -> SeedStudy:
    """Run a scenario once for each balise seed.

    Args:
        scenario: with a balise layout that depends on `balises.seed`.
        seeds: seeds to run.
        tell: called with the number done and the number in all.

    Raises:
        ScenarioError: there are no seeds, or no balises. RunError: a run failed.
    """
    chosen = list(seeds)
    study: SeedStudy | None = None
    sweep = scenario.copy().set("certificates", "ignore").vary({"balises.seed": chosen})
    # what is doubtful is said once, by the scenario's own run, and not for every seed
    for run in sweep.each(progress=tell):
        if run.outcome is None or run.failure is not None:
            raise RunError(f"Seed {chosen[run.number]}: {run.failure}")
        study = study or SeedStudy(run.outcome.spec, chosen)
        for row in phase_metrics(run.outcome.result, run.outcome.spec):
            if row.speed is not None and not isnan(row.speed.max_abs):  # NaN: the run ended before this phase
                study.errors.setdefault((row.observer, row.phase), []).append(row.speed.max_abs)
    assert study is not None
    return study
