"""The runs of a sweep in groups, one for each value of a setting: means with intervals, shares of counted things.
Touches the file it is told to write.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite, nan, sqrt
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy

from cosim.errors import OutputError
from cosim.evaluation.numbers import DASH
from cosim.evaluation.numbers import number as number_text
from cosim.studies.measures import SHARES, setting_text, with_unit
from fmus.text_table import text_table

if TYPE_CHECKING:
    from cosim.studies.sweep_result import SweepResult, SweepRun

LEVEL = 0.95
GROUPS = "groups.csv"


@dataclass(frozen=True)
class Spread:
    """A measure over the runs of a group.

    Args:
        mean: of the runs, or a share of things counted over all runs; NaN where there is none.
        low, high: ends of its 95 % confidence interval; NaN where there are too few runs.
        count: runs that have the measure, or things counted.
    """

    mean: float
    low: float = nan
    high: float = nan
    count: int = 0

    def text(self) -> str:
        """The mean, and the interval where there is one."""
        if not isfinite(self.mean):
            return DASH
        if not isfinite(self.low):
            return number_text(self.mean)
        return f"{number_text(self.mean)} ({number_text(self.low)} to {number_text(self.high)})"


def mean_of(values: Sequence[float]) -> Spread:
    """The mean with its interval by Student's t.

    Args:
        values: one a run; those that are not finite are left out.
    """
    numbers = np.array([value for value in values if isfinite(value)])
    if not len(numbers):
        return Spread(nan)
    mean = float(numbers.mean())
    if len(numbers) < 2:
        return Spread(mean, count=1)
    half = (
        float(scipy.stats.t.ppf(0.5 + 0.5 * LEVEL, len(numbers) - 1)) * float(numbers.std(ddof=1)) / sqrt(len(numbers))
    )
    return Spread(mean, mean - half, mean + half, len(numbers))


def share_of(hits: float, trials: float) -> Spread:
    """A share of counted things with its exact interval (Clopper and Pearson 1934).

    Args:
        hits: how many of them. trials: how many in all.
    """
    if not trials > 0.0:
        return Spread(nan)
    tail = 0.5 - 0.5 * LEVEL
    low = float(scipy.stats.beta.ppf(tail, hits, trials - hits + 1.0)) if hits > 0.0 else 0.0
    high = float(scipy.stats.beta.ppf(1.0 - tail, hits + 1.0, trials - hits)) if hits < trials else 1.0
    return Spread(hits / trials, low, high, int(trials))


def groups(result: SweepResult, by: str) -> dict[Any, dict[str, Spread]]:
    """For each value of a setting the measures over the runs that have it, in order of appearance.

    Shares (`cosim.studies.measures.SHARES`) are of what was counted in all runs together; other measures are means.

    Args:
        result: of a sweep. by: what was varied.
    """
    found: dict[Any, list[SweepRun]] = {}
    for run in result.runs:
        found.setdefault(setting_text(run.settings.get(by)), []).append(run)
    return {key: {name: _spread(name, runs) for name in result.measures} for key, runs in found.items()}


def _spread(name: str, runs: Sequence[SweepRun]) -> Spread:
    head, _, kind = name.rpartition(".")
    if kind in SHARES:
        hits, trials = (_total(runs, f"{head}.{counted}") for counted in SHARES[kind])
        return share_of(hits, trials)
    return mean_of([run.measures.get(name, nan) for run in runs])


def _total(runs: Sequence[SweepRun], name: str) -> float:
    counts = [run.measures.get(name, nan) for run in runs]
    return sum(count for count in counts if isfinite(count))


def groups_text(result: SweepResult, by: str) -> str:
    """The groups as a table, failures in words below it.

    Args:
        result: of a sweep. by: what was varied.
    """
    names = result.shown_measures
    rows = [[by, "runs", *(with_unit(name, result.unit(name)) for name in names)]]
    counts = _runs(result, by)
    for key, measures in groups(result, by).items():
        rows.append([key, str(counts[key]), *(measures[name].text() for name in names)])
    note = "Means of the runs, and shares of what was counted in all of them, with 95 % intervals."
    return "\n".join([*text_table(rows, left=(0,), heading=True), "", note, *result.troubles()])


def _runs(result: SweepResult, by: str) -> Mapping[str, int]:
    counts: dict[str, int] = {}
    for run in result.runs:
        key = setting_text(run.settings.get(by))
        counts[key] = counts.get(key, 0) + (run.failure is None)
    return counts


def write_groups(result: SweepResult, by: str, directory: Path) -> Path:
    """Write the groups as a table with a line for each group and measure.

    Args:
        result: of a sweep. by: what was varied. directory: of the sweep.

    Returns:
        Path of ``groups.csv``.

    Raises:
        OutputError: it cannot be written.
    """
    path = directory / GROUPS
    try:
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow([by, "measure", "unit", "mean", "low", "high", "count"])
            for key, measures in groups(result, by).items():
                for name, spread in measures.items():
                    cells = ["" if not isfinite(v) else repr(v) for v in (spread.mean, spread.low, spread.high)]
                    writer.writerow([key, name, result.unit(name) or "", *cells, spread.count])
    except OSError as error:
        raise OutputError(f"{path} cannot be written: {error.strerror or error}.") from error
    return path
