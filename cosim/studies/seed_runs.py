"""Studies: one scenario over several seeds, medians and quartiles of the errors, beside published numbers.

Of each seed only its row is kept, so memory does not grow with the number of runs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from math import isnan
from typing import TYPE_CHECKING, Any

import numpy as np

from cosim.errors import RunError
from cosim.evaluation.metrics import phase_metrics
from cosim.evaluation.spec import ReportSpec
from fmus.tables.numbers import error_number
from fmus.text_table import text_table

if TYPE_CHECKING:
    from cosim.run.outcome import Outcome
    from cosim.simulation.scenario import Scenario

_QUARTILES = (25.0, 50.0, 75.0)


@dataclass(frozen=True)
class SeedRow:
    """What one seed gave.

    Args:
        seed: of the run. errors: (observer, phase) -> maximal speed error [m/s]; not of phases that the run did not
            reach. failure: why it did not reach its end, or None.
    """

    seed: int
    errors: Mapping[tuple[str, str], float]
    failure: str | None = None

    def to_data(self) -> dict[str, Any]:
        """Plain data, one entry for each observer and phase: ``observer, phase``."""
        errors = {f"{observer}, {phase}": error for (observer, phase), error in self.errors.items()}
        return {"seed": self.seed, "failure": self.failure} | errors


@dataclass
class SeedStudy:
    """Maximal speed errors of every observer in every phase, one for each seed.

    Args:
        spec: roles, phases and reference numbers of the scenario.
        each: one row for each seed that was run, in their order.
    """

    spec: ReportSpec
    each: list[SeedRow]

    @property
    def seeds(self) -> list[int]:
        """Seeds that were run to the end."""
        return [row.seed for row in self.each if row.failure is None]

    @property
    def failures(self) -> dict[int, str]:
        """Why seeds failed, by seed."""
        return {row.seed: row.failure for row in self.each if row.failure is not None}

    @property
    def errors(self) -> dict[tuple[str, str], list[float]]:
        """(observer, phase) -> maximal speed errors [m/s] of the seeds that were run to the end."""
        gathered: dict[tuple[str, str], list[float]] = {}
        for row in self.each:
            for key, error in row.errors.items() if row.failure is None else ():
                gathered.setdefault(key, []).append(error)
        return gathered

    def quartiles(self, observer: str, phase: str) -> tuple[float, float, float]:
        """Lower quartile, median and upper quartile of the maximal speed error [m/s].

        Args:
            observer: name of the component. phase: name of the phase.
        """
        low, middle, high = np.percentile(self.errors[observer, phase], _QUARTILES)
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
                    "published": self.spec.published.get(observer, {}).get(phase),
                    "independent": self.spec.independent.get(observer, {}).get(phase),
                }
            )
        return rows

    def text(self) -> str:
        """A plain-text table, failed seeds in words below it."""
        rows = [["observer", "phase", "quartile", "median", "quartile", "published", "independent"]]
        for observer, phase, *sizes in (row.values() for row in self.rows()):
            rows.append([observer, phase, *(error_number(size) for size in sizes)])
        head = f"Maximal speed error over {len(self.seeds)} seeds [m/s]"
        failed = [f"seed {seed} failed: {why}" for seed, why in self.failures.items()]
        return "\n".join([head, *text_table(rows, left=(0, 1)), *failed])

    def to_data(self) -> dict[str, Any]:
        """Plain data: the seeds that ended, the quartiles, and a row for each seed."""
        return {"seeds": self.seeds, "rows": self.rows(), "each": [row.to_data() for row in self.each]}


def seed_study(
    scenario: Scenario,
    seeds: Iterable[int],
    progress: Callable[[int, int], None] | None = None,
    done: Callable[[SeedRow], None] | None = None,
) -> SeedStudy:
    """Run a scenario once for each seed. One that fails is kept as a failure and does not stop the others.

    Args:
        scenario: that leaves something to chance.
        seeds: seeds to run.
        progress: called with the number done and the number in all.
        done: called with the row of each seed as soon as it is there.

    Returns:
        The study.

    Raises:
        ScenarioError: there are no seeds. RunError: every seed failed.
    """
    chosen = list(seeds)
    spec: ReportSpec | None = None
    rows: list[SeedRow] = []
    sweep = scenario.copy().set("certificates", "ignore").vary({"seed": chosen})
    # what is doubtful is said once, by the scenario's own run, and not for every seed
    for run in sweep.each(progress=progress):
        spec = spec or (None if run.outcome is None else run.outcome.spec)
        rows.append(SeedRow(chosen[run.number], _errors(run.outcome), run.failure))
        if done is not None:
            done(rows[-1])
    if spec is None or all(row.failure is not None for row in rows):
        raise RunError(f"No seed could be run to its end. Seed {rows[0].seed}: {rows[0].failure}")
    return SeedStudy(spec, rows)


def _errors(outcome: Outcome | None) -> dict[tuple[str, str], float]:
    if outcome is None:
        return {}
    sizes = ((row.observer, row.phase, row.speed) for row in phase_metrics(outcome.result, outcome.spec))
    # NaN: the run ended before this phase
    return {(o, phase): size.max_abs for o, phase, size in sizes if size is not None and not isnan(size.max_abs)}
