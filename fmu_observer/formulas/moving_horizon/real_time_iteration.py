"""The real-time iteration: a row arrives, the oldest leaves into the arrival cost, a fixed number of passes follows.

And what an observer remembers and reports of it, as signals. It knows no observer.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from fmu_observer.formulas.moving_horizon.arrival_cost import arrival_cost_from
from fmu_observer.formulas.moving_horizon.gauss_newton import FAR, KEPT, passed, solve
from fmu_observer.formulas.moving_horizon.window_problem import WindowProblem
from plant_models.hybrid import Array, OutputWarning, Signal, discrete_output, memory
from plant_models.hybrid.option import require_whole
from plant_models.hybrid.scan import enclosed

MOST_ROWS, MOST_PASSES = 1000, 20
_MUCH = 3.0  # standard deviations: an estimate that is moved by more is not within its own deviation [ours]

WINDOW_MEMORY = ("arrival_cost", "window", "window_estimates", "last_pass")
WINDOW_OUTPUTS = {
    "residual_norm": "Root of the mean square of the window's residuals, in their deviations",
    "last_step": "Largest change of an estimate in the last pass, in its standard deviations",
    "passes_used": "Passes that changed an estimate by more than 0.001 of its deviation",
    "rows_in_window": "Rows of the window with a measurement",
    "bounds_active": "Bounds at which the estimate is held",
    "bounds_contradicted": "1 while bounds hold the estimate against most of the window, or no course keeps them",
    "course_error": "Largest part of an estimate that the model and its disturbance do not explain, in its deviations",
    "unsettled": "1 while the window is not a course of the model, or its last pass changed an estimate much",
}
"""What is reported of a window, outputs by name."""
_WARNINGS = {
    "bounds_contradicted": OutputWarning(
        "its bounds contradict its window: they hold the estimate while more than half of the measurements, or of the "
        "disturbances between them, are over 5 deviations off, or no course of the model keeps them all. Check the "
        "bounds, the deviations, and whether a measurement is false",
        ("bounds_active", "course_error"),
    ),
    "unsettled": OutputWarning(
        "its window was not solved: the last pass moved an estimate by more than 3 standard deviations, or what came "
        "out is no course of the model. Allow more passes (passes), or solve windows to convergence",
        ("last_step", "course_error"),
    ),
}
"""What of it warns."""


class Iterated(NamedTuple):
    """What a row makes of a window.

    Attributes:
        estimate: at the row, shape (n,). covariance: of it, row by row, shape (n * n,).
        remembered: new values of `window_memory` by name, and of what else is remembered.
    """

    estimate: Array
    covariance: Array
    remembered: dict[str, Array]


def require_window(who: str, window: int, passes: int) -> None:
    """Refuse a window or a number of passes that is none.

    Args:
        who: name of the observer, for the message. window: rows, 1 to 1000. passes: 1 to 20.

    Raises:
        ValueError: one is no whole number, or not within these.
    """
    require_whole(who, 1, MOST_ROWS, window=window)
    require_whole(who, 1, MOST_PASSES, passes=passes)


def window_memory(start: Array, covariance: Array, row_width: int, window: int) -> tuple[Signal, ...]:
    """What an observer remembers of its window.

    Args:
        start: of the estimates, shape (n,). covariance: of it, shape (n, n). row_width: numbers in a row.
        window: rows.
    """
    first = (*start, *start, *np.ravel(covariance))
    rows = "Rows, oldest first: moves, period, time, inputs, measured, used; SI units"
    values = tuple(map(float, np.tile(start, window)))
    return (
        memory("arrival_cost", "1", tuple(map(float, first)), "Before the window: point, mean, P", size=len(first)),
        memory("window", "1", 0.0, rows, size=window * row_width),
        memory("window_estimates", "1", values, "Estimates of the rows, oldest first, SI units", size=len(values)),
        memory("last_pass", "1", 0.0, "What is told of the passes and the window", size=len(WINDOW_OUTPUTS)),
    )


def window_outputs(window: int) -> tuple[Signal, ...]:
    """The outputs `WINDOW_OUTPUTS`.

    Args:
        window: rows of the window.
    """
    filled = OutputWarning(
        "its window never filled: losses and unknown parameters were judged by fewer measurements than asked for. Let "
        "the run last longer, or take a smaller window",
        reaches=float(window),
    )
    warnings = {**_WARNINGS, "rows_in_window": filled}
    return tuple(discrete_output(name, "1", text, warning=warnings.get(name)) for name, text in WINDOW_OUTPUTS.items())


def window_values(last_pass: Array) -> dict[str, Array]:
    """Values of the outputs `WINDOW_OUTPUTS`.

    Args:
        last_pass: the memory of that name, shape (6,).
    """
    return {name: last_pass[i] for i, name in enumerate(WINDOW_OUTPUTS)}


def iterate(
    problem: WindowProblem,
    passes: int,
    arrival: Array,
    window: Array,
    points: Array,
    row: Array,
    point: Array,
    shared: Any,
) -> Iterated:
    """A row arrives.

    Args:
        problem: what moves and what is measured. passes: over the window.
        arrival, window, points: as remembered (`arrival_cost`, `window`, `window_estimates`), flat.
        row: the new one, flat. point: prediction of its state, shape (n,). shared: what all rows share, shape (s,).
    """
    arrays = (arrival, window, points, row, point, shared)
    estimate, covariance, *remembered = enclosed(_iteration(problem, passes), *arrays)
    return Iterated(estimate, covariance, dict(zip(WINDOW_MEMORY, remembered, strict=True)))


@lru_cache(maxsize=KEPT)
def _iteration(problem: WindowProblem, passes: int) -> Callable[..., tuple[Array, ...]]:
    """What `iterate` does, as a function of arrays alone."""
    n, width = problem.order, problem.layout.width

    def iterated(*arrays: Array) -> tuple[Array, ...]:
        old, table, states, new, predicted, known = arrays
        count = states.shape[0] // n
        before = passed(problem, arrival_cost_from(old, n), table[:width], states[:n], known)
        rows = np.reshape(np.hstack([table[width:], new]), (count, width))
        estimates = np.reshape(np.hstack([states[n:], predicted]), (count, n))
        found = solve(problem, before, rows, estimates, known, passes)
        against = contradicted(found.bounds, found.far, found.broken)
        moving = found.step if passes > 1 else 0.0 * found.step  # the first pass moves by what the row has brought
        ended = (found.broken, unsettled(moving, found.broken))
        last = (found.residual, found.step, found.moved, problem.layout.count(rows), found.bounds, against, *ended)
        kept = (np.reshape(rows, (count * width,)), np.reshape(found.estimates, (count * n,)))
        return found.estimates[-1], found.covariance, np.hstack([*before]), *kept, np.hstack([*last])

    return iterated


def contradicted(bounds: Array, far: Array, broken: Array) -> Array:
    """1 where bounds hold an estimate against most of what the window says, or against the model itself, shape (1,).

    Args:
        bounds: that are active in the last row, shape (1,). far: measurements and disturbances of the window that are
            far off, for each measurement, shape (1,) [1]. broken: `Solution.broken`, shape (1,) [1].
    """
    against = np.where(bounds > 0.5, np.where(far > 0.5, 1.0, 0.0), 0.0)
    return np.maximum(against, np.where(broken > FAR, 1.0, 0.0))


def unsettled(step: Array, broken: Array) -> Array:
    """1 where a window is far from its solution, shape (1,).

    Args:
        step: by which the last pass has moved an estimate, shape (1,) [1]. broken: `Solution.broken`, shape (1,) [1].
    """
    return np.where(np.maximum(step, broken) > _MUCH, 1.0, 0.0)
