"""Moving-horizon observers whose windows are solved to convergence: the same windows, arrival costs and outputs.

They are no members of the registry, since nothing of them becomes C: a scenario names them by
``fmu_observer.observers.full_convergence:FullBaliseMovingHorizon``, and `fmus build --hosted` makes FMUs of them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from math import inf
from typing import Any

import numpy as np

from fmu_observer.formulas.moving_horizon.arrival_cost import arrival_cost_from
from fmu_observer.formulas.moving_horizon.full_solution import Effort
from fmu_observer.formulas.moving_horizon.full_solver import FullSolver
from fmu_observer.formulas.moving_horizon.gauss_newton import passed
from fmu_observer.formulas.moving_horizon.real_time_iteration import WINDOW_MEMORY, Iterated, contradicted, unsettled
from fmu_observer.formulas.moving_horizon.window_problem import WindowProblem
from fmu_observer.observers.generic.discrete.moving_horizon_observer import MovingHorizonObserver
from fmu_observer.observers.train.balise_moving_horizon import BaliseMovingHorizon
from plant_models.hybrid import Array, HybridSystem, discrete_output, memory, warning_output
from plant_models.hybrid.option import is_number, require_whole

TOLERANCE, _MAX_ITERATIONS = 1e-4, 30  # of a standard deviation: nobody sees it, and one step less is done [ours]
ENDED = (
    discrete_output("converged", "1", "1 where the last window was solved to the tolerance"),
    warning_output(
        "deadline_missed",
        "1 where the deadline came first",
        "the deadline came before the solution of its window, and the last feasible answer stands, at worst the "
        "prediction. Allow more time, or a smaller window",
        ("passes_used", "last_step"),
    ),
    warning_output(
        "stopped_early",
        "1 where the search ended above the tolerance, but not by the deadline",
        "the search in its window ended above the tolerance, and its last feasible answer stands. Allow more steps "
        "(max_iterations), or a larger tolerance",
        ("passes_used", "last_step"),
    ),
    discrete_output("feasible", "1", "1 where the answer keeps bounds and transitions"),
)
_LAST_SEARCH = memory("last_search", "1", 0.0, "How the last search ended", size=len(ENDED))
_EFFORT_OPTIONS: Mapping[str, Sequence[Any]] = {"tolerance": (), "max_iterations": range(1, 1001), "deadline": ()}


class _Converging(HybridSystem):
    """Solves every window until nothing moves any more, or until its effort is spent; what both observers share."""

    traceable = False

    def __init__(
        self,
        *,
        tolerance: float = TOLERANCE,
        max_iterations: int = _MAX_ITERATIONS,
        deadline: float | None = None,
        **options: Any,
    ) -> None:
        self.effort = _checked_effort(self.name, tolerance, max_iterations, deadline)
        super().__init__(**options)
        self.options |= _effort_options(self.effort)

    def iterate(self, problem: WindowProblem, passes: int, *arrays: Array) -> Iterated:
        """See `_iterated_fully`."""
        return _iterated_fully(problem, self.effort, *arrays)

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return super().output(t, x, u, p) | _ended(x)


class FullMovingHorizonObserver(_Converging, MovingHorizonObserver):
    """`MovingHorizonObserver` with every window solved until nothing moves any more, and with a deadline.

    The output `passes_used` counts the steps. Where they end before the tolerance, by `max_iterations` or `deadline`,
    the last feasible answer stands and `converged` is 0. With a deadline what comes out depends on the machine: a
    repeated run may differ.

    Args:
        model, options: those of `MovingHorizonObserver`; its `passes` have no meaning here.
        tolerance: largest change in the last step, in standard deviations. max_iterations: steps at a row.
        deadline: time at a row after which the last feasible answer is given [s]; None for none.

    Raises:
        ValueError: an option is not legal; the message says which.
    """

    name = "full_moving_horizon_observer"
    description = "Moving-horizon observer whose windows are solved to convergence"
    source = "Omar 2012, sections 1.4.8 and 4.2; solver and arrival cost are ours"
    option_choices = {**MovingHorizonObserver.option_choices, **_EFFORT_OPTIONS}

    def __init__(self, model: Any = "pendulum", **options: Any) -> None:
        super().__init__(model=model, **options)

    def _declare(self) -> None:
        super()._declare()
        self.states += (_LAST_SEARCH,)
        self.outputs += ENDED


class FullBaliseMovingHorizon(_Converging, BaliseMovingHorizon):
    """`BaliseMovingHorizon` with every window solved until nothing moves any more, and with a deadline.

    See `FullMovingHorizonObserver` for what `converged`, `deadline_missed` and `feasible` say.

    Args:
        tolerance, max_iterations, deadline: those of `FullMovingHorizonObserver`.
        options: `window` and `loss`, those of `BaliseMovingHorizon`.

    Raises:
        ValueError: an option is not legal; the message says which.
    """

    name = "full_balise_moving_horizon"
    description = "Moving-horizon observer of odometer and balises whose windows are solved to convergence"
    source = "Omar 2012, (1.4.78), (4.2.2)-(4.2.4); solver and the train case are ours"
    internal_step = 0.1  # [s]; it flows in Python, and the resistance hardly changes in that time
    outputs = (*BaliseMovingHorizon.outputs, *ENDED)
    option_choices = {**BaliseMovingHorizon.option_choices, **_EFFORT_OPTIONS}

    def own_states(self) -> tuple[Any, ...]:
        return (*super().own_states(), _LAST_SEARCH)


def _iterated_fully(
    problem: WindowProblem,
    effort: Effort,
    arrival: Array,
    window: Array,
    points: Array,
    row: Array,
    point: Array,
    shared: Array,
) -> Iterated:
    """A row arrives, as in `real_time_iteration.iterate`; how the search ended stands behind what is remembered.

    Args:
        problem: what moves and what is measured. effort: what the solution may cost.
        arrival, window, points: as remembered, flat. row: the new one, flat. point: prediction of its state, shape
            (n,). shared: what all rows share, shape (s,).
    """
    n, layout = problem.order, problem.layout
    rows, states = np.reshape(window, (-1, layout.width)), np.reshape(points, (-1, n))
    before = passed(problem, arrival_cost_from(arrival, n), rows[0], states[0], shared)
    rows, guesses = np.vstack([rows[1:], row]), np.vstack([states[1:], point])
    # the search begins where transitions are kept: a row that does not move, or is not filled yet, has the one before
    for k in range(len(rows) - 1):
        if layout.unpacked(rows[k]).moves <= 0.5:
            guesses[k] = guesses[k - 1] if k else before.mean
    found = _solver(problem).solve(before, rows, guesses, shared, effort)
    remembered = (np.hstack([*before]), rows.ravel(), found.states.ravel(), _last_pass(found, layout.count(rows)))
    kept = dict(zip(WINDOW_MEMORY, remembered, strict=True)) | {_LAST_SEARCH.name: _how_it_ended(found)}
    return Iterated(found.estimate, found.covariance.ravel(), kept)


def _last_pass(found: Any, counts: Sequence[Array]) -> np.ndarray:
    """What is remembered of the last pass; `converged` judges its step."""
    step = found.step if found.iterations else 0.0  # no step, no change: the prediction is the answer
    bounds, far, broken = (np.array([value]) for value in (found.active, found.far, found.broken))
    last = [found.residual, step, float(found.iterations), *counts, float(found.active)]
    return np.array([*last, *contradicted(bounds, far, broken), found.broken, *unsettled(np.zeros(1), broken)])


def _how_it_ended(found: Any) -> np.ndarray:
    early = not found.converged and not found.timed_out
    return np.array([float(word) for word in (found.converged, found.timed_out, early, found.feasible)])


def _checked_effort(who: str, tolerance: float, max_iterations: int, deadline: float | None) -> Effort:
    """The effort that options name.

    Args:
        who: name of the observer, for the message. tolerance: in standard deviations. max_iterations: steps at a row.
        deadline: [s], None for none.

    Raises:
        ValueError: one of them is not legal.
    """
    require_whole(who, 1, 1000, max_iterations=max_iterations)
    if not (is_number(tolerance) and tolerance > 0.0):
        raise ValueError(f"{who}: tolerance must be above 0 standard deviations, got {tolerance!r}.")
    if deadline is not None and not (is_number(deadline) and deadline >= 0.0):
        raise ValueError(f"{who}: deadline must be at least 0 s, got {deadline!r}.")
    return Effort(float(tolerance), int(max_iterations), inf if deadline is None else float(deadline))


def _effort_options(effort: Effort) -> dict[str, Any]:
    """The options that give an effort.

    Args:
        effort: what a solution may cost.
    """
    stated: dict[str, Any] = {"tolerance": effort.tolerance, "max_iterations": effort.max_iterations}
    return stated if effort.deadline == inf else stated | {"deadline": effort.deadline}


def _ended(x: Any) -> dict[str, Array]:
    return {s.name: x.last_search[i] for i, s in enumerate(ENDED)}


@lru_cache(maxsize=8)
def _solver(problem: WindowProblem) -> FullSolver:
    """The solver of a problem, compiled once."""
    return FullSolver(problem)
