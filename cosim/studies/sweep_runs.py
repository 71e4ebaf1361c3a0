"""The runs of a sweep with settings, measures and outcomes, as data and as a table. Touches no file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite, isnan, nan
from pathlib import Path
from typing import Any

from cosim.errors import ScenarioError, nearest
from cosim.results.load_result import load_result
from cosim.results.optional import optional_module
from cosim.results.result import Result
from cosim.run.outcome import Outcome
from cosim.runs.runnable import RunnableScenario
from cosim.studies.measures import UNMET, measure_unit, setting_text
from cosim.studies.warnings_of_runs import SharedWarning, shared_warnings, warning_lines
from fmus.tables.numbers import number
from fmus.tables.table import Column, FirstScreen, Parts, Table, name_column, text_column

_OUTCOME = text_column("outcome", "outcome", "Whether the run came to its end and met the scenario's expectations")
_RANGES, _MEASURES = 2, 4
"""Measures whose range stands in the first sentence, and those whose values stand below it."""
_ROUNDING = 1e-9
"""Share of its largest value by which a measure must change between runs to differ."""


@dataclass(frozen=True)
class SweepRun(FirstScreen):
    """One run of a sweep.

    Args:
        number: of the variation, from 0. settings: the values that were changed, by name.
        outcome: what the run left; None where it could not begin, crashed, or was not kept.
        failure: why it did not reach its end, or None.
        measures: numbers by name; see `cosim.studies.measures.error_measures`.
        faults: what went wrong in taking own measures.
        folder: where its results were written, or None.
        warnings: what the user should know of it; none of a run of an earlier version that was taken over.
    """

    number: int
    settings: Mapping[str, Any]
    outcome: Outcome | None = None
    failure: str | None = None
    measures: Mapping[str, float] = field(default_factory=dict)
    faults: Sequence[str] = ()
    folder: Path | None = None
    warnings: Sequence[str] = ()

    def first_screen(self) -> Parts:
        """Which run it is, why it ended early where it did, and what it left."""
        settings = ", ".join(f"{name} = {setting_text(value)}" for name, value in self.settings.items())
        left: Parts = [] if self.outcome is None else self.outcome.first_screen()
        return [f"Run {self.number}: {settings or 'nothing varied'}.", self.failure or "", *left]

    @property
    def unmet(self) -> int:
        """How many expectations of the scenario are not met."""
        count = self.measures.get(UNMET, nan)
        return 0 if isnan(count) else int(count)

    @property
    def ending(self) -> str:
        """What became of it, in a few words."""
        if self.failure is not None:
            return "failed"
        return f"{self.unmet} not met" if self.unmet else "done"

    @property
    def result(self) -> Result | None:
        """The result, from memory or from its folder; None where there is none."""
        if self.outcome is not None:
            return self.outcome.result
        return None if self.folder is None else load_result(self.folder)


@dataclass(frozen=True)
class SweepRuns(FirstScreen):
    """The runs of a sweep, in order of its variations.

    Args:
        scenario: what was varied. names: of what was varied. runs: that were done. units: of own measures, by name.
    """

    scenario: RunnableScenario
    names: Sequence[str]
    runs: Sequence[SweepRun]
    units: Mapping[str, str] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.runs)

    def __getitem__(self, number: int) -> SweepRun:
        return self.runs[number]

    @property
    def failed(self) -> list[SweepRun]:
        """The runs that did not reach their end."""
        return [run for run in self.runs if run.failure is not None]

    @property
    def unmet(self) -> str:
        """In how many runs expectations of the scenario are not met, in words; empty for none."""
        count = sum(run.unmet > 0 for run in self.runs)
        return f"{count} with expectations that are not met" if count else ""

    @property
    def warnings(self) -> list[SharedWarning]:
        """The distinct warnings of all runs, each with the runs that gave it."""
        return shared_warnings({run.number: run.warnings for run in self.runs})

    @property
    def measures(self) -> list[str]:
        """Names of all measures, in order of appearance."""
        return list(dict.fromkeys(name for run in self.runs for name in run.measures))

    @property
    def columns(self) -> list[Column]:
        """The measures that printed tables show: those the scenario chooses under ``report.measures``, or all.

        Raises:
            ScenarioError: one that is chosen is none.
        """
        chosen = self.scenario.table().report.measures
        if not chosen or not self.measures:
            shown = [name for name in self.measures if name != UNMET]  # which the outcome says
            return [Column(name, name, self.unit(name) or "", digits=4) for name in shown]
        unknown = [c.measure for c in chosen if c.measure not in self.measures]
        if unknown:
            raise ScenarioError(f"report.measures: {unknown[0]!r} is none; {nearest(unknown[0], self.measures)}")
        return [
            Column(c.measure, c.label or c.measure, c.unit or self.unit(c.measure) or "", factor=c.factor, digits=4)
            for c in chosen
        ]

    @property
    def varying_first(self) -> list[Column]:
        """The same, those first that are not equal in all runs: they show what the varied values change."""
        return sorted(self.columns, key=lambda column: not self.varies(column.key))

    def varies(self, measure: str) -> bool:
        """Whether runs differ in the finite values of a measure by more than rounding.

        Args:
            measure: name of the measure.
        """
        values = [v for run in self.runs if isfinite(v := run.measures.get(measure, nan))]
        return bool(values) and max(values) - min(values) > _ROUNDING * max(map(abs, values))

    def unit(self, measure: str) -> str | None:
        """Unit of a measure; None where nobody has said it.

        Args:
            measure: name of the measure.
        """
        return self.units.get(measure) or measure_unit(measure)

    def table(self) -> list[dict[str, Any]]:
        """One row for each run: ``run``, the settings, the measures (NaN where a run has none) and ``failure``."""
        measures = self.measures
        return [
            {"run": run.number}
            | {name: run.settings.get(name) for name in self.names}
            | {name: run.measures.get(name, nan) for name in measures}
            | {"failure": run.failure}
            for run in self.runs
        ]

    def to_pandas(self) -> Any:
        """The table as a pandas data frame, indexed by the number of the run.

        Raises:
            OutputError: pandas is not installed.
        """
        return optional_module("pandas", "Data frames").DataFrame(self.table()).set_index("run")

    def shown(self) -> Table:
        """The settings and the chosen measures of each run, failures in words below."""
        return self._shown(self.columns)

    def _shown(self, measures: Sequence[Column]) -> Table:
        names = [name_column(name, name, write=setting_text) for name in ("run", *self.names)]
        columns = [*names, _OUTCOME, *measures]
        endings = [run.ending for run in self.runs]
        rows = [
            [ending if column is _OUTCOME else row[column.key] for column in columns]
            for row, ending in zip(self.table(), endings, strict=True)
        ]
        return Table("runs", columns, rows, notes=self.troubles(), bad={*endings} - {"done"}, rows_are="runs")

    def text(self) -> str:
        """The same as plain text."""
        return self.shown().text()

    def first_screen(self) -> Parts:
        """How many runs there are, what was varied, and between what the first measures lie that differ; warnings; the
        runs.
        """
        failed = f", {len(self.failed)} of which failed" if self.failed else ""
        done = f"{len(self.runs)} runs{failed}{f', {self.unmet}' if self.unmet else ''}"
        columns = self.varying_first
        ranges = [self._range(column) for column in columns[:_RANGES] if self.varies(column.key)]
        sentence = f"{done}; varied: {', '.join(self.names) or 'nothing'}."
        more = len(columns) - _MEASURES
        left = f"{more} more measures: see text() and to_pandas()." if more > 0 else ""
        warnings = "\n".join(f"warning: {line}" for line in warning_lines(self.warnings, "the attribute warnings"))
        return [" ".join([sentence, *ranges]), warnings, self._shown(columns[:_MEASURES]), left]

    def _range(self, column: Column) -> str:
        """The smallest and the largest value of a measure and their runs, in a sentence."""
        values = {run.number: v for run in self.runs if not isnan(v := run.measures.get(column.key, nan))}
        low, high = min(values, key=lambda n: values[n]), max(values, key=lambda n: values[n])
        ends = [f"{number(column.factor * values[n])} in run {n}" for n in (low, high)]
        return f"{column.title()}: from {ends[0]} to {ends[1]}."

    def troubles(self) -> list[str]:
        """What failed, in words, a line each."""
        lines = [f"run {run.number} failed: {run.failure}" for run in self.failed]
        return [*lines, *(f"run {run.number}: {fault}" for run in self.runs for fault in run.faults)]
