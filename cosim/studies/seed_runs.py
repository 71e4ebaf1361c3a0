"""Studies: one scenario over several seeds, a sweep; medians and quartiles of the errors, beside published numbers."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cosim.errors import RunError
from cosim.evaluation.metrics import phase_metrics
from cosim.evaluation.seed_table import seed_table
from cosim.evaluation.spec import ReportSpec
from cosim.run.signal_roles import report_spec
from cosim.runs.engine import Progress
from cosim.studies.measures import error_measures
from cosim.studies.warnings_of_runs import SharedWarning, shared_warnings, warning_lines
from fmus.tables.line_picture import Line, line_picture
from fmus.tables.table import Parts, Readable, Table

if TYPE_CHECKING:
    from cosim.run.outcome import Outcome
    from cosim.simulation.scenario import Scenario

_QUARTILES = (25.0, 50.0, 75.0)
_ERROR = ".speed_error_max"


@dataclass(frozen=True)
class SeedRow:
    """What one seed gave.

    Args:
        seed: of the run. errors: (observer, phase) -> maximal speed error [m/s]; not of phases that the run did not
            reach. failure: why it did not reach its end, or None. warnings: what the user should know of it.
    """

    seed: int
    errors: Mapping[tuple[str, str], float]
    failure: str | None = None
    warnings: Sequence[str] = ()

    def to_data(self) -> dict[str, Any]:
        """Plain data, one entry for each observer and phase: ``observer, phase``."""
        errors = {f"{observer}, {phase}": error for (observer, phase), error in self.errors.items()}
        return {"seed": self.seed, "failure": self.failure} | errors


@dataclass
class SeedStudy(Readable):
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

    @property
    def warnings(self) -> list[SharedWarning]:
        """The distinct warnings of all seeds, each with the seeds that gave it."""
        return shared_warnings({row.seed: row.warnings for row in self.each})

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

    def table(self) -> Table:
        """The same as a table, failed seeds in words below it."""
        failed = [f"seed {seed} failed: {why}" for seed, why in self.failures.items()]
        return seed_table(self.rows(), f"Maximal speed error over {len(self.seeds)} seeds", failed)

    def parts(self) -> Parts:
        """The table, and warnings of the seeds."""
        warnings = [f"warning: {line}" for line in warning_lines(self.warnings, "the attribute warnings", "seed")]
        return [self.table(), "\n".join(warnings)]

    def _picture_html(self) -> str:
        """The errors of each observer over the seeds, in the first phase."""
        phase = next((phase for _, phase in self.errors), "")
        seeds = np.array(self.seeds, dtype=float)
        lines = [
            Line(self.spec.labels.get(observer, observer), seeds, np.array(errors))
            for (observer, of), errors in self.errors.items()
            if of == phase and len(errors) == len(seeds)
        ]
        return line_picture(f"Maximal speed error, {phase} [m/s]", lines, "seed")

    def to_data(self) -> dict[str, Any]:
        """Plain data: the seeds that ended, the quartiles, a row for each seed, and the warnings of the seeds."""
        warnings = [warning.to_data() for warning in self.warnings]
        each = [row.to_data() for row in self.each]
        return {"seeds": self.seeds, "rows": self.rows(), "each": each, "warnings": warnings}


def seed_study(
    scenario: Scenario,
    seeds: Iterable[int],
    progress: Progress | None = None,
    *,
    workers: int = 1,
    directory: Path | None = None,
    resume: bool = False,
    retry: bool = False,
    scheduler: str | None = None,
) -> SeedStudy:
    """Run a scenario once for each seed: a sweep over ``seed``. One that fails is kept as a failure and does not stop
    the others.

    Args:
        scenario: that leaves something to chance.
        seeds: seeds to run.
        progress: called with the number done and the number in all.
        workers: processes at a time. directory: of journal and table; None for none.
        resume: whether seeds are taken over that stand in the journal. retry: whether all that failed are run again.
        scheduler: address of a scheduler of `dask.distributed` whose workers do the runs.

    Returns:
        The study.

    Raises:
        ScenarioError: there are no seeds. RunError: every seed failed, or the cluster cannot be used.
    """
    # what is doubtful is said once, by the scenario's own run, and not for every seed
    sweep = scenario.copy().set("certificates", "ignore").vary({"seed": list(seeds)})
    result = sweep.run(
        workers,
        progress=progress,
        keep=False,
        directory=directory,
        folders=False,
        resume=resume,
        retry=retry,
        scheduler=scheduler,
        measures=_seed_measures,
    )
    rows = [SeedRow(run.settings["seed"], _errors(run.measures), run.failure, run.warnings) for run in result.runs]
    if all(row.failure is not None for row in rows):
        raise RunError(f"No seed could be run to its end. Seed {rows[0].seed}: {rows[0].failure}")
    return SeedStudy(report_spec(scenario.table()), rows)


def _seed_measures(outcome: Outcome) -> dict[str, float]:
    """The measures of a sweep, and for each observer and phase ``observer.phase.speed_error_max`` [m/s]; none for a
    phase that the run did not reach.

    Args:
        outcome: of the run of a seed.
    """
    sizes = ((row.observer, row.phase, row.speed) for row in phase_metrics(outcome.result, outcome.spec))
    errors = {f"{o}.{phase}{_ERROR}": s.max_abs for o, phase, s in sizes if s is not None and not isnan(s.max_abs)}
    return error_measures(outcome) | errors


def _errors(measures: Mapping[str, float]) -> dict[tuple[str, str], float]:
    """Errors by observer and phase, out of the measures of a seed."""
    parts = {name.removesuffix(_ERROR).partition("."): value for name, value in measures.items() if _ERROR in name}
    return {(observer, phase): value for (observer, dot, phase), value in parts.items() if dot}
