"""What came of a campaign: its table, medians and worst cases with their keys, failures by cause, rates of
expectations, designs in pairs. Reads its folder.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cosim import campaign as campaigns
from cosim.campaign.chunk import EXPECT
from cosim.campaign.store import FIXED, read_rows
from cosim.errors import OutputError, ScenarioError, nearest
from cosim.results.optional import optional_module
from cosim.scenario.campaign_table import CampaignTable
from cosim.statistics.comparisons import compared, comparison_table
from cosim.statistics.intervals import proportion, quantile
from cosim.statistics.spread import Spread
from cosim.studies.measures import UNMET, measure_unit
from cosim.studies.warnings_of_runs import shared_warnings
from fmus.tables.table import Column, FirstScreen, Parts, Table, name_column, text_column

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_KEY = 12
"""Digits of a key that are shown; `cosim rerun` takes them."""
_CAUSES = 3
_FIRST = ("position_error_max", "speed_error_max")
"""Measures that are told where none is chosen; the others stand in the table."""


@dataclass(frozen=True)
class CampaignResult(FirstScreen):
    """The runs of a campaign.

    Args:
        directory: of the campaign. table: what was asked for. rows: a table of Arrow. names: of settings.
        missing: why runs have no row, for reasons outside of them. kept: folders of whole results by number.
    """

    directory: Path
    table: CampaignTable
    rows: Any
    names: Sequence[str]
    missing: Sequence[str] = ()
    kept: Mapping[int, Path] = field(default_factory=dict)

    @classmethod
    def read(
        cls, directory: Path, table: CampaignTable, names: Sequence[str], missing: Sequence[str] = ()
    ) -> CampaignResult:
        """What stands in a folder.

        Args:
            directory: of the campaign. table, names, missing: see the class.

        Raises:
            OutputError: no run is in it. ScenarioError: `keep.of` names no measure.
        """
        result = cls(directory, table, read_rows(directory), names, missing)
        unknown = [name for name in table.keep.of if name not in result.measures]
        if unknown and result.measures:
            known = nearest(unknown[0], result.measures)
            raise ScenarioError(f"campaign.keep.of: no run has the measure {unknown[0]!r}; {known}")
        return result

    def __len__(self) -> int:
        return int(self.rows.num_rows)

    @property
    def measures(self) -> list[str]:
        """Names of the numbers that were taken of runs."""
        others = {*FIXED, *self.names}
        return [name for name in self.rows.column_names if name not in others and not name.startswith(EXPECT)]

    @cached_property
    def failures(self) -> dict[int, str]:
        """Why runs failed, by their numbers."""
        found = zip(self.column("number"), self.rows["failure"].to_pylist(), strict=True)
        return {int(number): reason for number, reason in found if reason is not None}

    def column(self, name: str) -> np.ndarray:
        """A column, NaN where a run has no number.

        Args:
            name: of a setting or a measure.

        Raises:
            OutputError: there is none of this name.
        """
        if name not in self.rows.column_names:
            raise OutputError(f"{self.directory} has no column {name!r}; {nearest(name, self.rows.column_names)}")
        values = self.rows[name].to_pandas() if self.rows[name].type == "string" else self.rows[name].to_numpy()
        return np.asarray(values)

    def key(self, number: int) -> str:
        """The key of a run.

        Args:
            number: of the run.
        """
        return str(self.rows["key"][int(np.flatnonzero(self.column("number") == number)[0])].as_py())

    def to_pandas(self) -> Any:
        """The table as a pandas data frame, indexed by the number of the run.

        Raises:
            OutputError: pandas is not installed.
        """
        optional_module("pandas", "Data frames")
        return self.rows.to_pandas().set_index("number")

    def worst(self, measure: str, count: int = 1) -> list[int]:
        """Numbers of the runs in which a measure is largest, the worst first.

        Args:
            measure: its name. count: of runs at most.
        """
        sizes = np.abs(self.column(measure))
        order = np.argsort(-np.where(np.isnan(sizes), -np.inf, sizes), kind="stable")
        return [int(self.column("number")[i]) for i in order[:count] if not np.isnan(sizes[i])]

    def spreads(self) -> Table:
        """Medians with distribution-free intervals, and the worst with its run and key, by measure."""
        rows = []
        for name in self.shown:
            values = self.column(name)
            finite = values[~np.isnan(values)]
            if len(finite):
                worst = self.worst(name)[0]
                at = dict(zip(self.column("number"), values, strict=True))
                rows.append([name, quantile(finite, 0.5), at[worst], worst, self.key(worst)[:_KEY]])
        unit = {measure_unit(name) for name in self.shown}
        shown = f" [{unit.pop()}]" if len(unit) == 1 and None not in unit else ""
        columns = (
            name_column("measure", "Measure"),
            Column("median", f"Median{shown}", "", "With its 95 % interval", write=Spread.text),
            Column("worst", "Worst"),
            Column("run", "Run"),
            name_column("key", "Key"),
        )
        return Table("measures", columns, rows)

    @property
    def shown(self) -> list[str]:
        """Measures that are told: those whose worst is kept, else the largest errors of observers."""
        if self.table.keep.of:
            return list(self.table.keep.of)
        chosen = [name for end in _FIRST for name in self.measures if name.endswith(f".{end}")]
        return chosen or [name for name in self.measures if name != UNMET]

    def rates(self) -> Table:
        """How often each expectation is met, of the runs that came to their end, with exact intervals."""
        names = [name for name in self.rows.column_names if name.startswith(EXPECT)]
        rows = []
        for name in names:
            values = self.column(name)
            judged = values[~np.isnan(values)]
            rows.append([name.removeprefix(EXPECT), proportion(int(judged.sum()), len(judged)), len(judged)])
        columns = (
            text_column("expected", "Expected"),
            Column("rate", "Met in", "", "Share of runs with its 95 % interval (Clopper-Pearson)", write=Spread.text),
            Column("runs", "Runs judged"),
        )
        return Table("expectations", columns, rows)

    def comparisons(self) -> Table | None:
        """Designs compared in pairs, in the same disturbances, by the first measure; None with one design."""
        designs = self.column("design")
        if designs.max() < 1 or not self.shown:
            return None
        measure, points = self.shown[0], self.column("point")
        values = np.full((int(points.max()) + 1, int(designs.max()) + 1), np.nan)
        values[points, designs] = self.column(measure)
        names = [self._design(number) for number in range(values.shape[1])]
        found = compared(dict(zip(names, map(list, values.T), strict=True)))
        return comparison_table(found, measure, measure_unit(measure) or "")

    def _design(self, number: int) -> str:
        """What a point of the design sets, in words."""
        row = int(np.flatnonzero(self.column("design") == number)[0])
        return ", ".join(f"{name} = {self.rows[name][row].as_py()}" for name in self.table.design)

    def causes(self) -> list[str]:
        """Why runs failed, the most common cause first, a line each."""
        found = shared_warnings({number: [reason] for number, reason in self.failures.items()})
        found.sort(key=lambda one: -len(one.runs))
        lines = [f"{len(one.runs)} failed (run {one.runs[0]}): {one.text}" for one in found[:_CAUSES]]
        more = [f"and {len(found) - _CAUSES} more causes, see the column failure"] if len(found) > _CAUSES else []
        return [*lines, *more]

    @property
    def sentence(self) -> str:
        """How many ran, how many failed, in how many expectations are not met."""
        failed = proportion(len(self.failures), len(self))
        text = f"{len(self)} runs, {len(self.failures)} failed"
        text += f" (a share of {failed.text()})" if self.failures else ""
        if UNMET in self.measures:
            count = int((self.column(UNMET) > 0.0).sum())
            text += f", {count} with expectations that are not met"
        lacking = f", some not done: {self.missing[0]}" if self.missing else ""
        return f"{text}{lacking}."

    def first_screen(self) -> Parts:
        """How many ran, failures by cause, medians and worst, rates of expectations, designs in pairs."""
        pairs = self.comparisons()
        tables = [table for table in (self.spreads(), self.rates(), pairs) if table is not None and len(table.rows)]
        return [self.sentence, "\n".join(self.causes()), *tables]

    def plot(self, measure: str | None = None, against: str | None = None, ax: Axes | None = None) -> Axes:
        """Draw the empirical distribution of a measure, or the measure over what varies with its binned median.

        Args:
            measure: its name; the first that is told where not given. against: what varies; None for the distribution.
            ax: axes to draw on; None for a figure of its own.

        Raises:
            OutputError: there is no such measure or setting.
        """
        chosen = measure or next(iter(self.shown), "")
        if against is not None:
            return campaigns.draw_over(self, chosen, against, ax)  # type: ignore[no-any-return]
        kind = chosen.rpartition(".")[2]
        alike = [name for name in self.measures if name.rpartition(".")[2] == kind] if measure is None else [chosen]
        return campaigns.draw_distribution(self, alike, ax)  # type: ignore[no-any-return]
