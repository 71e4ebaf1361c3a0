"""The main table of a comparison of observers. Touches no file."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import Any

from cosim.choice.observer_scores import SEEN_GAP, ObserverScore
from cosim.evaluation.metrics import PhaseMetrics
from fmu_observer.certificates.finding import Finding
from fmus.tables.numbers import number
from fmus.tables.table import Column, Table, error_column, name_column

_MICRO = 1e-6
_WHOLE = "Estimate minus true value over the whole evaluated run"
_AT_BALISES = "Estimate minus true value just before telegrams are used"
_COLUMNS = (
    name_column("observer", "observer"),
    error_column("rms_speed_error", "rms v", "m/s", _WHOLE),
    error_column("max_speed_error", "max |v|", "m/s", _WHOLE),
    error_column("rms_position_error", "rms p", "m", _WHOLE),
    error_column("max_position_error", "max |p|", "m", _WHOLE),
    error_column("rms_speed_error_at_balises", "at balises rms v", "m/s", _AT_BALISES),
    error_column("rms_position_error_at_balises", "at balises rms p", "m", _AT_BALISES),
    Column("slip_delays", "slip seen after", "s", "From the begin of each zone to the first indication in it"),
    Column("false_alarms", "false alarms", "", "Indications that began outside the low-adhesion zones"),
    Column("certified", "certified", "s", "Longest gap between balises that the certificate covers"),
    Column("holds", "holds", "", "Whether the certificate covers the gaps expected, and those seen"),
    Column("cost", "cost", "us/step", "Time in the observer per communication step", factor=1.0 / _MICRO),
)


def observer_table(scores: Sequence[ObserverScore]) -> Table:
    """One row for each observer.

    Args:
        scores: observers with their numbers.
    """
    return Table("table", _COLUMNS, [_row(score) for score in scores])


def _row(score: ObserverScore) -> list[Any]:
    whole: PhaseMetrics | None = score.whole
    speed, position = (whole.speed, whole.position) if whole is not None else (None, None)
    delays = score.indicator.delays if score.indicator is not None else ()
    return [
        score.label,
        *(value for size in (speed, position) for value in (size and size.rms, size and size.max_abs)),
        score.speed_at_balises and score.speed_at_balises.rms,
        score.position_at_balises and score.position_at_balises.rms,
        "/".join("-" if d is None else number(d) for d in delays) or None,
        score.false_alarms,
        *_certified(score.certificate),
        None if score.cost is None else _MICRO * score.cost,
    ]


def _certified(gap: Finding | None) -> tuple[float | str | None, str | None]:
    """Longest gap that is certified [s], ``any`` where every gap is; and whether it covers those expected and seen."""
    if gap is None:
        return None, None
    words = {True: "yes", False: "NO", None: "?"}
    covered = f"{words[gap.holds]}/{words[gap.condition(SEEN_GAP).holds]}"
    return "any" if gap.value == inf else gap.value, covered
