"""The table of fault detection. Standard library only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import isnan
from statistics import fmean
from typing import Any

from cosim.evaluation.fault_detection import FaultDetection
from cosim.evaluation.roles import label
from cosim.evaluation.spec import ReportSpec
from fmus.tables.numbers import number
from fmus.tables.table import Column, Table, error_column, name_column

_BEFORE = "Absolute position error at the last row before each balise"
_COLUMNS = (
    Column("faults", "Faults", "", "Faults that there were", short="faults"),
    Column("missed", "Missed", "", "Faults that it did not find", short="missed"),
    Column("missed_interval", "95 % of missed", "%", "Interval of the share missed", factor=100.0, short="95 %"),
    Column("false", "False", "", "Detections of no fault", short="false"),
    Column("false_interval", "False per hour, 95 %", "1/h", "Interval of false detections", short="per hour, 95 %"),
    Column("start_delay", "Delay at start", "s", "Mean time from the begin of a fault to its detection", short="start"),
    Column("end_delay", "Delay at end", "s", "Mean time from the end of a fault to that of its detection", short="end"),
    Column("time_outside", "On without fault", "s", "How long a fault was indicated where none was", short="outside"),
    error_column("mean_position_error", "Position before balises, mean", "m", _BEFORE, short="mean |p|"),
    error_column("max_position_error", "max", "m", _BEFORE, short="max |p|"),
)
_COUNTS = [column.key for column in _COLUMNS[:-2]]


def fault_table(found: Sequence[FaultDetection], spec: ReportSpec) -> Table:
    """Faults: which were found, how late, and what was no fault; positions only where there are any before a balise.

    Args:
        found: from `fault_detection`. spec: labels, and the longest delay allowed.
    """
    heading = spec.detection.replace("_", " ") + "s" if spec.detection == ReportSpec.detection else spec.detection
    columns = [_with_limit(c, spec.delay_limit) for c in _COLUMNS]
    rows = [[label(spec, one.observer), *_values(one, spec.delay_limit)] for one in found]
    return Table("faults", [name_column("observer", "Observer", short=heading), *columns], rows).filled(_COUNTS)


def _values(found: FaultDetection, limit: float | None) -> list[Any]:
    sizes = [abs(error) for error in found.position_errors]
    positions = [fmean(sizes), max(sizes)] if sizes else [None, None]
    if not found.indicates:
        return [found.faults, *[None] * (len(_COUNTS) - 1), *positions]
    return [
        found.faults,
        found.missed,
        found.missed_interval if found.faults else None,
        found.false,
        None if isnan(found.false_interval[1]) else found.false_interval,
        _start(found, limit),
        fmean(found.end_delays) if found.end_delays else None,
        found.time_outside,
        *positions,
    ]


def _start(found: FaultDetection, limit: float | None) -> Any:
    delay = fmean(found.start_delays) if found.start_delays else None
    return delay if limit is None or not found.faults else {"mean": delay, "within": found.within(limit)}


def _with_limit(column: Column, limit: float | None) -> Column:
    """Columns of delays as they are written: the first with the longest delay that is allowed [s]."""

    def started(delay: Any) -> str:
        if not isinstance(delay, dict):
            return number(delay)
        return f"{number(delay['mean'])} ({'within' if delay['within'] else 'not within'} {number(limit)})"

    def ended(delay: float | None) -> str:
        return "not ended" if delay == float("inf") else number(delay)

    written = {"start_delay": started, "end_delay": ended}
    return replace(column, write=written[column.key]) if column.key in written else column
