"""Measures: what a run of a sweep is reduced to, one number each. Imports NumPy only."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import nan
from typing import Any

import numpy as np

from cosim.evaluation.balise_gaps import PLAIN_ODOMETER, gap_errors, largest
from cosim.evaluation.consistency import filter_consistency
from cosim.evaluation.fault_detection import fault_detection
from cosim.evaluation.metrics import evaluated_size, within
from cosim.evaluation.roles import Quantity, estimation_error
from cosim.evaluation.spec import Phase
from cosim.run.outcome import Outcome

Measure = Callable[[Outcome], float]
SHARES: Mapping[str, tuple[str, str]] = {
    "missed_share": ("missed_faults", "faults"),
    "false_share": ("false_alarms", "detections"),
}
"""Measures that are shares of counted things: name to those of the count and of the number in all."""
RATES: Mapping[str, tuple[str, str]] = {"false_alarms_per_hour": ("false_alarms", "evaluated_time")}
"""Measures that are counts in an hour: name to those of the count and of the time [s]."""
UNMET = "unmet_expectations"
"""How many expectations of the scenario a run that came to its end does not meet; of a scenario that has some."""
_ERROR_UNITS: Mapping[Quantity, str] = {"speed": "m/s", "position": "m"}
_GAP_UNITS = {"gap_error_max": "m", "gap_error_time_max": "s"}
_CONSISTENCY = ("nis", "nees", "nis_inside", "nees_inside")
_DETECTION_UNITS = {
    "faults": "1",
    "missed_faults": "1",
    "detections": "1",
    "false_alarms": "1",
    "evaluated_time": "s",
    "detection_delay": "s",
    "recovery_delay": "s",
    "false_alarm_time": "s",
    "missed_share": "1",
    "false_share": "1",
    "false_alarms_per_hour": "1/h",
    "balise_error": "m",
    "balise_error_max": "m",
}


def error_measures(outcome: Outcome) -> dict[str, float]:
    """Largest and root-mean-square errors of every observer over the evaluated part of the run, and what it made of
    the odometer's faults (`_detection_measures`).

    Args:
        outcome: the run.

    Returns:
        ``observer.speed_error_max``, ``observer.speed_error_rms`` [m/s] and the same of the position [m], where
        recorded; NaN for a run that failed, whose errors are those of another interval of time, and where too few rows
        are judged. Where balises were read also ``observer.gap_error_max`` [m] and ``observer.gap_error_time_max`` [s],
        the largest position error at the end of a gap between two of them and the longest running time of one, and the
        same of the plain odometer, under the name of its component. Where the scenario has expectations also `UNMET`.
    """
    result, spec = outcome.result, outcome.spec
    measures: dict[str, float] = {}
    if not len(result.time):
        return measures
    whole = Phase("whole run", float(result.time[0]), float(result.time[-1]))
    rows = within(result.time, whole, spec.evaluate_after)
    for observer in spec.observers:
        for quantity in _ERROR_UNITS:
            error = estimation_error(result, spec, observer, quantity)
            if error is None:
                continue
            size = evaluated_size(result.time[rows], error[rows])
            failed = outcome.failure is not None
            measures[f"{observer}.{quantity}_error_max"] = nan if failed else size.max_abs
            measures[f"{observer}.{quantity}_error_rms"] = nan if failed else size.rms
    if outcome.expectations and outcome.failure is None:
        measures[UNMET] = float(len(outcome.unmet))
    return measures | _detection_measures(outcome) | _gap_measures(outcome) | _consistency_measures(outcome)


def _consistency_measures(outcome: Outcome) -> dict[str, float]:
    """How well the covariances of filters fit their errors.

    Returns:
        ``observer.nis``, ``observer.nees`` and ``observer.position_nees`` likewise for other quantities: means of the
        normalised squares over their degrees of freedom, 1 for a consistent filter, and with ``_inside`` the share of
        samples inside the 95 % band; NaN for a run that failed.
    """
    measures: dict[str, float] = {}
    for entry in filter_consistency(outcome.result, outcome.spec):
        kind = f"{entry.quantity}_nees" if entry.kind == "error" else entry.kind.lower()
        found = entry.found
        numbers = {kind: found.mean / found.degrees, f"{kind}_inside": found.inside}
        failed = outcome.failure is not None
        measures |= {f"{entry.observer}.{name}": nan if failed else float(v) for name, v in numbers.items()}
    return measures


def _detection_measures(outcome: Outcome) -> dict[str, float]:
    """What every observer made of the faults of the odometer, where the report has the role `true_fault`.

    Args:
        outcome: the run.

    Returns:
        ``observer.faults``, ``observer.missed_faults``, ``observer.detections`` and ``observer.false_alarms`` as
        counts, ``observer.evaluated_time`` [s], the means ``observer.detection_delay`` and ``observer.recovery_delay``
        [s], ``observer.false_alarm_time`` [s], ``observer.missed_share`` of the faults, ``observer.false_share`` of the
        detections, ``observer.false_alarms_per_hour`` [1/h], the mean ``observer.balise_error`` [m] and the largest
        ``observer.balise_error_max`` [m] of the position before each balise; NaN where there is none, and for a run
        that failed.
    """
    measures: dict[str, float] = {}
    for found in fault_detection(outcome.result, outcome.spec):
        sizes = np.abs(found.position_errors)
        counts = {
            "faults": found.faults,
            "missed_faults": found.missed,
            "detections": found.detections,
            "false_alarms": found.false,
            "evaluated_time": found.duration,
            "detection_delay": _mean(found.start_delays),
            "recovery_delay": _mean(found.end_delays),
            "false_alarm_time": found.time_outside,
            "missed_share": found.missed_rate,
            "false_share": found.false_rate,
            "false_alarms_per_hour": found.false_per_hour,
        }
        largest = float(sizes.max()) if sizes.size else nan
        numbers = (counts if found.indicates else {}) | {"balise_error": _mean(sizes), "balise_error_max": largest}
        failed = outcome.failure is not None
        measures |= {f"{found.observer}.{name}": nan if failed else float(v) for name, v in numbers.items()}
    return measures


def _gap_measures(outcome: Outcome) -> dict[str, float]:
    """Position errors at the end of the gaps between balises, see `error_measures`."""
    found, spec = gap_errors(outcome.result, outcome.spec), outcome.spec
    measures: dict[str, float] = {}
    for name, errors in found.errors.items():
        component = str(spec.odometer).rpartition(".")[0] if name == PLAIN_ODOMETER else name
        times = found.running_time(name)
        for key, values in zip(_GAP_UNITS, (errors, times[~np.isnan(times)]), strict=True):
            measures[f"{component}.{key}"] = nan if outcome.failure is not None else largest(values)
    return measures


def _mean(values: Sequence[float] | np.ndarray) -> float:
    return float(np.mean(values)) if len(values) else nan


def own_measures(outcome: Outcome, measure: Mapping[str, Measure]) -> tuple[dict[str, float], list[str]]:
    """The user's measures, and what went wrong in computing them: one that fails is NaN, and the sweep goes on.

    Args:
        outcome: the run.
        measure: functions of the outcome that give a number, by name.
    """
    measures: dict[str, float] = {}
    faults: list[str] = []
    for name, function in measure.items():
        try:
            measures[name] = float(np.asarray(function(outcome)).item()) if outcome.failure is None else nan
        except Exception as error:  # the user's own function, whatever it raises
            measures[name] = nan
            faults.append(f"measure {name!r}: {type(error).__name__}: {error}")
    return measures, faults


def is_number(value: Any) -> bool:
    """Whether the value of a setting is a number: neither a text nor a truth value."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def setting_text(value: Any) -> str:
    """A value that was varied, as people write it.

    Args:
        value: of a setting.
    """
    return f"{value:g}" if isinstance(value, float) else str(value)


def with_unit(name: str, unit: str | None) -> str:
    """The name with its unit, where it has one.

    Args:
        name: of a measure or a setting.
        unit: None where nobody has said it.
    """
    return name if unit is None else f"{name} [{unit}]"


def measure_unit(name: str) -> str | None:
    """SI unit of a measure of `error_measures` or `_detection_measures`; None for the user's own.

    Args:
        name: of the measure.
    """
    for quantity, unit in _ERROR_UNITS.items():
        if name.endswith((f".{quantity}_error_max", f".{quantity}_error_rms")):
            return unit
    if name.endswith(_CONSISTENCY):
        return "1"
    return (_GAP_UNITS | _DETECTION_UNITS).get(name.rpartition(".")[2])
