"""Moving-horizon observers whose windows are solved to convergence: the same windows, arrival costs and outputs.

They are no members of the registry, since nothing of them becomes C: a scenario names them by
``fmu_observer.observers.full_convergence:FullMovingHorizonObserver``, `fmus build --hosted` makes FMUs of them.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from fmu_observer.moving_horizon.arrival_cost import arrival_cost_from
from fmu_observer.moving_horizon.full_solver import Effort, FullSolution, FullSolver
from fmu_observer.moving_horizon.gauss_newton import WindowProblem, passed
from fmu_observer.observers.discrete.moving_horizon_observer import MovingHorizonObserver
from plant_models.hybrid import memory, output_signal, parameter
from plant_models.hybrid.requirements import within_bounds
from plant_models.hybrid.system import Array

NEVER = 1e9  # a deadline that is none [s]
EFFORT = (
    parameter("tolerance", "1", 1e-4, "Largest change in the last step, in standard deviations", min=1e-12),
    parameter("max_iterations", "1", 30.0, "Gauss-Newton steps at a row, a whole number", min=1.0),
    parameter("deadline", "s", NEVER, "Time at a row after which the last feasible answer is given", min=0.0),
)
TOLD = (
    output_signal("converged", "1", "1 where the last window was solved to the tolerance", variability="discrete"),
    output_signal("deadline_missed", "1", "1 where the deadline came first", variability="discrete"),
    output_signal("feasible", "1", "1 where the answer keeps bounds and transitions", variability="discrete"),
)


class FullMovingHorizonObserver(MovingHorizonObserver):
    """`MovingHorizonObserver` with every window solved until nothing moves any more, and with a deadline.

    The output `passes_used` counts the steps. Where they end before the tolerance, by `max_iterations` or `deadline`,
    the last feasible answer stands and `converged` is 0. With a deadline what comes out depends on the machine: a
    repeated run may differ.

    Args:
        model, options: those of `MovingHorizonObserver`; `passes` has no meaning.
    """

    name = "full_moving_horizon_observer"
    description = "Moving-horizon observer whose windows are solved to convergence"
    source = "Omar 2012, sections 1.4.8 and 4.2; solver and arrival cost are ours"
    traceable = False

    def requirements(self, p: Any) -> dict[str, Array]:
        """Those of the observer; tolerance, steps and deadline within their bounds."""
        return super().requirements(p) | within_bounds(EFFORT, p)

    def output(self, t: Array, x: Array, u: Any, p: Any) -> dict[str, Array]:
        """What the observer tells, and how the last search ended."""
        first = self._places["last_search"]
        return super().output(t, x, u, p) | {s.name: x[first + i] for i, s in enumerate(TOLD)}

    # -- internals --------------------------------------------------------------------------------------------------

    def _solved(
        self, arrival: Array, window: Array, points: Array, new: Array, prediction: Array, shared: Array
    ) -> tuple[Array, ...]:
        """As of the observer, with how the search ended behind what is told of the passes."""
        problem, n = self.problem, self.problem.order
        rows, states = window.reshape(-1, problem.layout.width), points.reshape(-1, n)
        before = passed(problem, arrival_cost_from(arrival, n), rows[0], states[0], shared)
        rows = np.vstack([rows[1:], new])
        found = _solver(problem).solve(before, rows, np.vstack([states[1:], prediction]), shared, self._effort(shared))
        told = [found.residual, found.step, float(found.iterations), float(problem.layout.count(list(rows))[0])]
        kept = (np.hstack(list(before)), rows.ravel(), found.states.ravel())
        return found.estimate, found.covariance.ravel(), *kept, np.hstack([*told, float(found.active), ended(found)])

    def _effort(self, shared: Array) -> Effort:
        p = self.unpack_parameters(shared)
        return Effort(float(p.tolerance), int(p.max_iterations), float(p.deadline))

    def _declare(self) -> None:
        super()._declare()
        self.states += (memory("last_search", "1", 0.0, "How the last search ended", size=len(TOLD)),)
        self._places["last_search"] = sum(s.width for s in self.states[:-1])
        self.parameters = (*self.parameters, *EFFORT)
        self.outputs += TOLD


def ended(found: FullSolution) -> Array:
    """How a search ended, in the order of `TOLD`, shape (3,).

    Args:
        found: of the search.
    """
    return np.array([found.converged, found.timed_out, found.feasible], dtype=float)


@lru_cache(maxsize=8)
def _solver(problem: WindowProblem) -> FullSolver:
    """The solver of a problem, compiled once."""
    return FullSolver(problem)
