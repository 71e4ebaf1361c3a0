"""More of each observer in each phase: slip, forces, errors around telegrams, indicator, telegrams. Imports NumPy
only.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import isnan

import numpy as np

from cosim.evaluation.corrections import Corrections, corrections, used_by
from cosim.evaluation.indicators import on_share
from cosim.evaluation.metrics import FEWEST_INSTANTS, error_size, evaluated_size, instants, within
from cosim.evaluation.roles import coupler_force, estimate, phases, recorded
from cosim.evaluation.spec import Phase, ReportSpec
from cosim.results.result import Result


@dataclass(frozen=True, slots=True)
class PhaseDetails:
    """What one observer did in one phase; None where it was not recorded or there was too little to measure.

    Args:
        observer: component name. phase: name of the phase.
        slip: time-weighted rms error of the slip [1].
        adhesion_force, coupler_force: likewise [N]; the coupler force is that of the first coupler.
        speed_before, speed_after: rms speed error just before and just after the telegrams used [m/s].
        position_before, position_after: likewise [m].
        indicator_on: share of the phase in which the slip indicator was on [1].
        telegrams: telegrams used, by their delivery.
    """

    observer: str
    phase: str
    slip: float | None
    adhesion_force: float | None
    coupler_force: float | None
    speed_before: float | None
    speed_after: float | None
    position_before: float | None
    position_after: float | None
    indicator_on: float | None
    telegrams: int | None


def phase_details(result: Result, spec: ReportSpec) -> list[PhaseDetails]:
    """Details of all observers in all phases, observer by observer.

    Args:
        result: the run. spec: roles, phases, start of the evaluation.
    """
    found = []
    for observer in spec.observers:
        made = [corrections(result, spec, observer, quantity) for quantity in ("speed", "position")]
        found += [_one(result, spec, observer, phase, *made) for phase in phases(result, spec)]
    return found


def _one(
    result: Result, spec: ReportSpec, observer: str, phase: Phase, speed: Corrections, position: Corrections
) -> PhaseDetails:
    start, end = max(phase.start, spec.evaluate_after), phase.end
    if instants(result.time[within(result.time, phase, spec.evaluate_after)]) < FEWEST_INSTANTS:
        return PhaseDetails(observer, phase.name, *[None] * (len(fields(PhaseDetails)) - 2))
    force = coupler_force(result, spec.true_speed)
    indicator = estimate(result, observer, "slip_indicator")
    used = [e for e in result.events if used_by(e, observer)]
    return PhaseDetails(
        observer,
        phase.name,
        _rms(result, spec, phase, recorded(result, spec.true_slip), estimate(result, observer, "slip")),
        _rms(
            result,
            spec,
            phase,
            recorded(result, spec.true_adhesion_force),
            estimate(result, observer, "adhesion_force"),
        ),
        _rms(result, spec, phase, force, coupler_force(result, f"{observer}.")),
        *_around(speed, start, end),
        *_around(position, start, end),
        None if indicator is None else on_share(result.time, indicator, start, end),
        sum(start <= e.delivered_at <= end for e in used) if used else None,
    )


def _rms(
    result: Result, spec: ReportSpec, phase: Phase, true: np.ndarray | None, believed: np.ndarray | None
) -> float | None:
    if true is None or believed is None:
        return None
    rows = within(result.time, phase, spec.evaluate_after)
    with np.errstate(invalid="ignore", over="ignore"):  # inf - inf: diverged
        rms = evaluated_size(result.time[rows], believed[rows] - true[rows]).rms
    return None if isnan(rms) else rms


def _around(made: Corrections, start: float, end: float) -> tuple[float | None, float | None]:
    """Root mean squares before and after the corrections within a phase."""
    inside = (made.time >= start) & (made.time <= end)
    if not inside.any():
        return None, None
    equal_weight = np.zeros(int(inside.sum()))
    return error_size(equal_weight, made.before[inside]).rms, error_size(equal_weight, made.after[inside]).rms
