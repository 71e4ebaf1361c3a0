"""What a run does not show: phases without rows, a train that stands, estimates worse than none, covariances that do
not fit. Imports NumPy only.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import inf

import numpy as np

from cosim.evaluation.consistency import consistency_warnings
from cosim.evaluation.metrics import FEWEST_INSTANTS, evaluated_size, instants, within
from cosim.evaluation.plausible_speeds import speed_warnings
from cosim.evaluation.roles import estimation_error, label, phases, recorded
from cosim.evaluation.spec import Phase, ReportSpec
from cosim.evaluation.summary_entries import list_entry
from cosim.results.result import Result
from fmus.tables.numbers import number

_STANDSTILL = 0.01
"""A train that is never faster than this [m/s] stands."""


def result_warnings(result: Result, spec: ReportSpec) -> list[str]:
    """Why the numbers of a run say little or nothing, in words.

    Args:
        result: the run; one that failed reports its end by itself. spec: roles, phases, start of the evaluation.

    Returns:
        A text for each of: filters whose covariance does not fit their errors; where the true speed is known, a train
        that never moves, a position or an odometer that does not go with it, phases that were not reached or hold too
        few rows, phases in which the train stands to the end of the run, observers whose speed error is larger than the
        speed of the train.
    """
    filters = [] if result.failure is not None else list(consistency_warnings(result, spec))
    return _of_the_journey(result, spec) + filters


def _of_the_journey(result: Result, spec: ReportSpec) -> list[str]:
    speed = recorded(result, spec.true_speed)
    if speed is None or not len(result.time):
        return []
    moving = np.flatnonzero(~(np.abs(speed) <= _STANDSTILL))
    found = [*_standing(result, spec, moving), *speed_warnings(result, spec)]
    if result.failure is None and spec.observers:
        found += _empty_phases(result, spec)
        found += _after_the_journey(result, spec, moving)
    return found + list(_worse_than_none(result, spec))


def all_warnings(result: Result, spec: ReportSpec) -> list[str]:
    """The warnings of the summary, and what may be added to those of an older run.

    Args:
        result: the run.
        spec: roles of the signals, labels, phases and zones.
    """
    return list(dict.fromkeys([*map(str, list_entry(result, "warnings")), *result_warnings(result, spec)]))


def _standing(result: Result, spec: ReportSpec, moving: np.ndarray) -> Iterator[str]:
    if not len(moving):
        yield (
            f"The train never moves: {spec.true_speed} stays below {_STANDSTILL:g} m/s up to {_text(result.time[-1])} "
            "s. Errors beside it say nothing; let the run go on, or have something drive the train."
        )


def _empty_phases(result: Result, spec: ReportSpec) -> Iterator[str]:
    """Phases with too few rows, those that the run did not reach together."""
    time, reached = result.time, float(result.time[-1])
    counts = {phase: instants(time[within(time, phase, spec.evaluate_after)]) for phase in phases(result, spec)}
    empty = [phase for phase, count in counts.items() if count < FEWEST_INSTANTS]
    unreached = [phase for phase in empty if max(phase.start, spec.evaluate_after) >= reached]
    if unreached:
        yield f"Not reached, since the run ends at {_text(reached)} s: {_named(unreached, spec)}."
    for phase in empty:
        if phase not in unreached:
            yield (
                f"Too few rows to judge ({counts[phase]} of the {FEWEST_INSTANTS} instants needed): "
                f"{_named([phase], spec)}."
            )


def _after_the_journey(result: Result, spec: ReportSpec, moving: np.ndarray) -> Iterator[str]:
    """Phases that begin when the train has come to its last stop."""
    if not len(moving) or moving[-1] + 1 >= len(result.time):
        return
    ended = float(result.time[moving[-1] + 1])
    late = [p for p in phases(result, spec) if ended <= max(p.start, spec.evaluate_after) < result.time[-1]]
    if late:
        yield f"The train stands from {_text(ended)} s on, so these phases show no journey: {_named(late, spec)}."


def largest_tolerable(result: Result, spec: ReportSpec) -> float:
    """Speed error beyond which an estimate says nothing of the train, for zero were the better one [m/s].

    Args:
        result: the run. spec: roles of its signals.
    """
    speed, settled = recorded(result, spec.true_speed), result.time >= spec.evaluate_after
    if speed is None or not np.any(settled):
        return inf
    return max(evaluated_size(result.time[settled], speed[settled]).max_abs, _STANDSTILL)


def _worse_than_none(result: Result, spec: ReportSpec) -> Iterator[str]:
    """Observers beside which a zero were the better estimate."""
    settled = result.time >= spec.evaluate_after
    fastest = largest_tolerable(result, spec)
    for observer in spec.observers:
        error = estimation_error(result, spec, observer, "speed")
        if error is None:
            continue
        largest = evaluated_size(result.time[settled], error[settled]).max_abs
        if largest > fastest:
            size = f"up to {number(largest)} m/s" if np.isfinite(largest) else "without bound"
            yield (
                f"{label(spec, observer)}: its speed error is {size}, more than the speed of the train "
                f"({number(fastest)} m/s at "
                "most): it says nothing of this train. Look at its gains, its inputs and the gaps between balises."
            )


def _named(chosen: Sequence[Phase], spec: ReportSpec) -> str:
    late = {
        p: f", judged from {_text(spec.evaluate_after)} s on" if spec.evaluate_after > p.start else "" for p in chosen
    }
    return ", ".join(f"{p.name} ({_text(p.start)} to {_text(p.end)} s{text})" for p, text in late.items())


def _text(time: float) -> str:
    return f"{time:.6g}"
