"""The runs of a sweep in groups, one for each value of a setting: means with intervals, shares of counted things.
Touches the file it is asked to write.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import isfinite, nan, sqrt
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy

from cosim.errors import OutputError
from cosim.evaluation.fault_detection import HOUR
from cosim.studies.measures import RATES, SHARES, setting_text
from fmu_observer.formulas.diagnosis.thresholds import clopper_pearson, garwood
from fmus.tables.numbers import DASH
from fmus.tables.numbers import number as number_text
from fmus.tables.table import Column, Table, name_column

if TYPE_CHECKING:
    from cosim.studies.sweep_runs import SweepRun, SweepRuns

LEVEL = 0.95
GROUPS = "groups.csv"


@dataclass(frozen=True)
class Spread:
    """A measure over the runs of a group.

    Args:
        mean: of the runs, or a share of things counted over all runs; NaN where there is none.
        low, high: ends of its 95 % confidence interval; NaN where there are too few runs.
        count: runs that have the measure, or what was counted.
    """

    mean: float
    low: float = nan
    high: float = nan
    count: int = 0

    def text(self, factor: float = 1.0, digits: int = 3) -> str:
        """The mean, and the interval where there is one.

        Args:
            factor: what the numbers are multiplied by. digits: significant ones.
        """
        if not isfinite(self.mean):
            return DASH
        mean, low, high = (number_text(factor * value, digits) for value in (self.mean, self.low, self.high))
        return f"{mean} ({low} to {high})" if isfinite(self.low) else mean


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


def grouped(result: SweepRuns, by: str) -> dict[Any, dict[str, Spread]]:
    """For each value of a setting the measures over the runs that have it, in order of appearance.

    Shares and rates (`cosim.studies.measures.SHARES`, `RATES`) are of what was counted in all runs together, with exact
    intervals; other measures are means.

    Args:
        result: of a sweep. by: what was varied.
    """
    found: dict[Any, list[SweepRun]] = {}
    for run in result.runs:
        found.setdefault(setting_text(run.settings.get(by)), []).append(run)
    return {key: {name: _spread(name, runs) for name in result.measures} for key, runs in found.items()}


def _spread(name: str, runs: Sequence[SweepRun]) -> Spread:
    head, _, kind = name.rpartition(".")
    counted = SHARES.get(kind) or RATES.get(kind)
    if counted is not None:
        hits, whole = (_total(runs, f"{head}.{part}") for part in counted)
        unit = 1.0 if kind in SHARES else HOUR
        interval = clopper_pearson(int(hits), int(whole)) if kind in SHARES else garwood(int(hits), whole / unit)
        return Spread(hits * unit / whole if whole > 0.0 else nan, *interval, int(hits))
    return mean_of([run.measures.get(name, nan) for run in runs])


def _total(runs: Sequence[SweepRun], name: str) -> float:
    counts = [run.measures.get(name, nan) for run in runs]
    return sum(count for count in counts if isfinite(count))


def groups_table(result: SweepRuns, by: str) -> Table:
    """The groups, failures in words below.

    Args:
        result: of a sweep. by: what was varied.
    """
    counts = _runs(result, by)
    rows = [
        [key, counts[key], *(measures[column.key] for column in result.columns)]
        for key, measures in grouped(result, by).items()
    ]
    columns = [replace(column, write=partial(Spread.text, factor=column.factor)) for column in result.columns]
    note = "Means of the runs, and shares and rates of what was counted in all of them, with 95 % intervals."
    names = [name_column(by, by), Column("runs", "runs")]
    return Table("groups", [*names, *columns], rows, notes=["", note, *result.troubles()])


def _runs(result: SweepRuns, by: str) -> Mapping[str, int]:
    counts: dict[str, int] = {}
    for run in result.runs:
        key = setting_text(run.settings.get(by))
        counts[key] = counts.get(key, 0) + (run.failure is None)
    return counts


def write_groups(result: SweepRuns, by: str, directory: Path) -> Path:
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
        with path.open("w", newline="", encoding="utf-8", errors="backslashreplace") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow([by, "measure", "unit", "mean", "low", "high", "count"])
            for key, measures in grouped(result, by).items():
                for name, spread in measures.items():
                    cells = ["" if not isfinite(v) else repr(v) for v in (spread.mean, spread.low, spread.high)]
                    writer.writerow([key, name, result.unit(name) or "", *cells, spread.count])
    except OSError as error:
        raise OutputError(f"{path} cannot be written: {error.strerror or error}.") from error
    return path
