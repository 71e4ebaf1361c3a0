"""The table of fault detection, as rows of text for a page and for a terminal. Standard library only."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import fmean

from cosim.evaluation.fault_detection import FaultDetection, Interval
from cosim.evaluation.roles import label
from cosim.evaluation.spec import ReportSpec
from fmus.tables.numbers import DASH, error_number, number
from fmus.text_table import text_table

HEADINGS = (
    "Faults",
    "Missed",
    "95 % of missed [%]",
    "False",
    "False per hour, 95 % [1/h]",
    "Delay at start [s]",
    "Delay at end [s]",
    "On without fault [s]",
    "Position before balises, mean [m]",
    "max [m]",
)
SHORT = (
    "faults",
    "missed",
    "95 % [%]",
    "false",
    "per hour, 95 %",
    "start [s]",
    "end [s]",
    "outside [s]",
    "mean |p| [m]",
    "max |p| [m]",
)

POSITIONS = 2
"""How many columns at the end are of positions."""


def columns(found: Sequence[FaultDetection]) -> int:
    """How many of `HEADINGS` are shown: those of positions only where an observer has any before a balise.

    Args:
        found: of all observers.
    """
    return len(HEADINGS) - (0 if any(one.position_errors for one in found) else POSITIONS)


def cells(found: FaultDetection, limit: float | None = None) -> list[str]:
    """The numbers of an observer, in the order of `HEADINGS`; delays are means.

    Args:
        found: of the observer. limit: longest delay that is allowed [s], told beside the delay; None for none.
    """
    share = found.missed_interval
    sizes = [abs(error) for error in found.position_errors]
    positions = [error_number(fmean(sizes)) if sizes else DASH, error_number(max(sizes)) if sizes else DASH]
    if not found.indicates:
        return [str(found.faults), *[DASH] * (len(HEADINGS) - 3), *positions]
    return [
        str(found.faults),
        str(found.missed),
        _span((100.0 * share[0], 100.0 * share[1])) if found.faults else DASH,
        str(found.false),
        _span(found.false_interval),
        _start(found, limit),
        _end(found.end_delays),
        number(found.time_outside),
        *positions,
    ]


def fault_text(found: Sequence[FaultDetection], spec: ReportSpec) -> str:
    """The table for a terminal; empty where nothing was judged.

    Args:
        found: from `fault_detection`. spec: labels.

    Returns:
        Lines of equal width, p the position error at the last row before each balise; ends without a line break.
    """
    if not found:
        return ""
    heading = spec.detection.replace("_", " ") + "s" if spec.detection == ReportSpec.detection else spec.detection
    last = columns(found) + 1
    rows = [[heading, *SHORT], *([label(spec, f.observer), *cells(f, spec.delay_limit)] for f in found)]
    return "\n".join(text_table([row[:last] for row in rows], (0,), heading=True))


def _span(interval: Interval) -> str:
    low, high = interval
    return DASH if high != high else f"{number(low)} to {number(high)}"  # noqa: PLR0124 - NaN


def _start(found: FaultDetection, limit: float | None) -> str:
    delay = number(fmean(found.start_delays)) if found.start_delays else DASH
    if limit is None or not found.faults:
        return delay
    return f"{delay} ({'within' if found.within(limit) else 'not within'} {number(limit)})"


def _end(delays: Sequence[float]) -> str:
    if not delays:
        return DASH
    mean = fmean(delays)
    return "not ended" if mean == float("inf") else number(mean)
