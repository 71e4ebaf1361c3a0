"""The runs of a sweep in groups, one for each value of a setting: means with intervals, shares of counted things.
Touches the file it is asked to write.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from math import isfinite, nan
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cosim.errors import OutputError
from cosim.evaluation.fault_detection import HOUR
from cosim.statistics.intervals import event_rate, mean_of, proportion
from cosim.statistics.spread import Spread
from cosim.studies.measures import RATES, SHARES, setting_text
from fmus.tables.table import Column, Table, name_column

if TYPE_CHECKING:
    from cosim.studies.sweep_runs import SweepRun, SweepRuns

GROUPS = "groups.csv"


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
        return proportion(int(hits), int(whole)) if kind in SHARES else event_rate(int(hits), whole / HOUR)
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
                    cells = ["" if not isfinite(v) else repr(v) for v in (spread.value, spread.low, spread.high)]
                    writer.writerow([key, name, result.unit(name) or "", *cells, spread.count])
    except OSError as error:
        raise OutputError(f"{path} cannot be written: {error.strerror or error}.") from error
    return path
