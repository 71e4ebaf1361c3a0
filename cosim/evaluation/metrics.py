"""How large the errors of the observers were, phase by phase. Imports NumPy only."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, nan

import numpy as np

from cosim.evaluation.roles import estimation_error, phases
from cosim.evaluation.spec import Phase, ReportSpec
from cosim.results.result import Result

FEWEST_INSTANTS = 5
"""Of an interval that is judged; what a run shows at fewer instants says nothing of it."""


@dataclass(frozen=True, slots=True)
class _ErrorSize:
    """Size of an error over a time interval, in the unit of the error; NaN with too few rows, infinite once diverged.

    Args:
        max_abs: largest absolute value. rms: time-weighted root mean square.
    """

    max_abs: float
    rms: float


@dataclass(frozen=True, slots=True)
class PhaseMetrics:
    """Errors of one observer in one phase.

    Args:
        observer: component name. phase: name of the phase.
        speed: error of the speed [m/s], or None where it was not recorded.
        position: error of the position [m], or None likewise.
        published: published maximum of the absolute speed error [m/s], or None.
        independent: independently measured maximum [m/s], or None.
    """

    observer: str
    phase: str
    speed: _ErrorSize | None
    position: _ErrorSize | None
    published: float | None = None
    independent: float | None = None


def error_size(time: np.ndarray, error: np.ndarray) -> _ErrorSize:
    """Maximum and time-weighted root mean square of an error.

    The square is integrated by the trapezoidal rule, so rows of the same time (before and after an event) count once,
    and unevenly spaced rows by their share of the time.

    Args:
        time: not decreasing [s], shape (rows,).
        error: shape (rows,); a value that is not finite makes both sizes infinite.

    Returns:
        The sizes; where no time passes, the root mean square is that of the rows.
    """
    return _size(np.diff(time), error)


def _size(steps: np.ndarray, error: np.ndarray) -> _ErrorSize:
    """As `error_size`, by the differences between the times of the rows [s], shape (rows - 1,)."""
    if not len(error):
        return _ErrorSize(nan, nan)
    largest = float(np.max(np.abs(error)))
    if not np.isfinite(largest):
        return _ErrorSize(inf, inf)
    if largest < np.finfo(float).tiny:  # too small to divide by
        return _ErrorSize(largest, largest)
    square = (error / largest) ** 2  # scaled, so that a diverged estimate does not overflow
    steps = np.maximum(steps, 0.0)
    elapsed = float(np.sum(steps))
    mean = float(np.sum(steps * (square[1:] + square[:-1]))) / (2 * elapsed) if elapsed > 0 else float(np.mean(square))
    return _ErrorSize(largest, largest * float(np.sqrt(mean)))


def instants(time: np.ndarray) -> int:
    """How many different times there are among times that do not decrease [s], shape (rows,).

    Args:
        time: instants [s], shape (rows,), never falling.
    """
    return _instants(np.diff(time)) if len(time) else 0


def _instants(steps: np.ndarray) -> int:
    return int(np.count_nonzero(steps > 0.0)) + 1


def evaluated_size(time: np.ndarray, error: np.ndarray) -> _ErrorSize:
    """As `error_size`; NaN where there are fewer than `FEWEST_INSTANTS` instants.

    Args:
        time: instants [s], shape (rows,), never falling.
        error: estimate minus true value, shape (rows,).
    """
    steps = np.diff(time)
    return _size(steps, error) if len(time) and _instants(steps) >= FEWEST_INSTANTS else _ErrorSize(nan, nan)


def within(time: np.ndarray, phase: Phase, evaluate_after: float) -> np.ndarray:
    """Rows of a phase that are evaluated, shape (rows,): ``start <= t <= end`` and ``t >= evaluate_after``.

    Args:
        time: instants [s], shape (rows,), never falling.
        phase: its begin and end [s].
        evaluate_after: from when on errors count [s].
    """
    return np.asarray((time >= max(phase.start, evaluate_after)) & (time <= phase.end))


def phase_metrics(result: Result, spec: ReportSpec) -> list[PhaseMetrics]:
    """Errors (estimate minus true value) of all observers in all phases.

    Args:
        result: the run.
        spec: roles, phases, start of the evaluation, published and independent numbers.

    Returns:
        One entry for each observer and phase, observer by observer.
    """
    return [_one(result, spec, observer, phase) for observer in spec.observers for phase in phases(result, spec)]


def _one(result: Result, spec: ReportSpec, observer: str, phase: Phase) -> PhaseMetrics:
    rows = within(result.time, phase, spec.evaluate_after)
    speed, position = (estimation_error(result, spec, observer, quantity) for quantity in ("speed", "position"))
    return PhaseMetrics(
        observer,
        phase.name,
        None if speed is None else evaluated_size(result.time[rows], speed[rows]),
        None if position is None else evaluated_size(result.time[rows], position[rows]),
        spec.published.get(observer, {}).get(phase.name),
        spec.independent.get(observer, {}).get(phase.name),
    )
