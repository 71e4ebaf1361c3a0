"""The window problem solved until nothing moves any more: Gauss-Newton steps, each a quadratic programme with bounds.

Omar 2012, (4.2.3) and (1.4.78)-(1.4.81), for the very problem that `gauss_newton` gives a fixed number of passes. Not
traceable: how many steps it takes depends on the values. `docs/theses/moving_horizon.md` says by what measurement the
solver was chosen.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import inf
from time import perf_counter
from typing import NamedTuple

import numpy as np

from fmu_observer.formulas.moving_horizon import robust_loss
from fmu_observer.formulas.moving_horizon.arrival_cost import ArrivalCost
from fmu_observer.formulas.moving_horizon.full_solution import Effort, FullSolution, WindowError
from fmu_observer.formulas.moving_horizon.gauss_newton import FAR
from fmu_observer.formulas.moving_horizon.window_problem import WindowProblem
from fmu_observer.formulas.moving_horizon.window_program import Step, WindowProgram, window_program
from fmu_observer.formulas.moving_horizon.window_stages import Stages, WindowStages, forward_substituted

_USUAL = Effort()
_SMALLEST_SHARE = 1.0 / 64.0
"""Of a step; where not even this makes the cost smaller, the search has ended."""

_LEAST_CURVATURE = 0.25
"""Of a loss, as a share of its weight: where it is less, steps would be too long."""

_KEPT, _NEAR = 1e-4, 1e-6
"""How well a trajectory keeps the transitions to be called feasible, and how near a bound it touches it, in its own
standard deviations."""


class _Point(NamedTuple):
    states: np.ndarray
    noises: np.ndarray
    stages: Stages
    squares: np.ndarray  # of the residuals in their own deviations, shape (N, q)


class FullSolver:
    """Solves windows of one problem.

    Args:
        problem: what moves, what is measured, bounds, losses.
        program: gives what solves the quadratic programmes of a window, of its rows and states, and of the states whose
            disturbances have bounds where there are some.
    """

    def __init__(self, problem: WindowProblem, program: Callable[..., WindowProgram] = window_program) -> None:
        self.problem, self._program = problem, program
        self._stages = WindowStages(problem)

    def solve(
        self,
        arrival: ArrivalCost,
        rows: Sequence[np.ndarray] | np.ndarray,
        points: Sequence[np.ndarray] | np.ndarray,
        shared: np.ndarray,
        effort: Effort = _USUAL,
    ) -> FullSolution:
        """The most probable trajectory of a window.

        Each step linearises along the trajectory and solves the quadratic programme with all bounds; a robust loss
        enters by the weights of the residuals as they are (iteratively reweighted least squares). A step that makes the
        cost larger is shortened. Every answer keeps the bounds.

        Args:
            arrival: what is known before the first row. rows: oldest first, flat, shape (N, width).
            points: first guess, the last solution shifted, say, and of the last row the prediction; shape (N, n).
            shared: what all rows share, shape (s,). effort: what it may cost.

        Raises:
            WindowError: bounds contradict one another, a number is not finite, or no trajectory of the model keeps the
                bounds; the message says which.
        """
        problem, window, start = self.problem, np.asarray(rows), np.asarray(points, dtype=float)
        if not problem.disturbed:
            program = self._program(len(window), problem.order)
            return _Search(problem, self._stages, program, arrival, window, np.asarray(shared)).solve(start, effort)
        # the disturbance into the first row is a noise of its own where the state before it has an empty row
        window = np.vstack([np.zeros(problem.layout.width), window])
        program = self._program(len(window), problem.order, problem.disturbed)
        search = _Search(problem, self._stages, program, arrival, window, np.asarray(shared))
        found = search.solve(np.vstack([np.reshape(arrival.point, (1, -1)), start]), effort)
        return replace(found, states=found.states[1:], noises=found.noises[1:], weights=found.weights[1:])


class _Search:
    """One window on its way to its solution."""

    def __init__(
        self,
        problem: WindowProblem,
        stages: WindowStages,
        program: WindowProgram,
        arrival: ArrivalCost,
        rows: np.ndarray,
        shared: np.ndarray,
    ) -> None:
        self.program = program
        self.problem, self.stages, self.arrival, self.rows, self.shared = problem, stages, arrival, rows, shared
        for name, value in {"rows": rows, "parameters": shared, **arrival._asdict()}.items():
            if not np.isfinite(value).all():
                raise WindowError(f"the window holds a number in its {name} that is not finite.")
        robust = any(loss != "squares" for loss in problem.losses)
        self.loss_scale = problem.loss_scale(shared) if robust else 1.0  # deviations from which losses grow less
        q, n = problem.layout.measurements, problem.order
        self.used, self.measured = rows[:, -q:], rows[:, -2 * q : -q]
        self.lower, self.upper = np.full((len(rows), n), -inf), np.full((len(rows), n), inf)
        self.disturbed = list(problem.disturbed)
        self.noise_limits = self.limits_of_noises() if self.disturbed else None
        if problem.bounded:
            low, high = (np.asarray(bound, dtype=float) for bound in problem.limits(shared))
            if not (low <= high).all():
                k = int(np.argmin(low <= high))
                raise WindowError(
                    f"bounds of state {problem.bounded[k]} contradict one another: "
                    f"at least {low[k]:g} and at most {high[k]:g}."
                )
            first = 1 if self.disturbed else 0  # the state before the window is not of it
            self.lower[first:, list(problem.bounded)], self.upper[first:, list(problem.bounded)] = low, high

    def solve(self, start: np.ndarray, effort: Effort) -> FullSolution:
        """The solution from a first guess of shape (N, n), for as much as it may cost."""
        began = perf_counter()
        states = np.clip(start, self.lower, self.upper)
        point = self.at(states, None)
        believed, after = self.spread(point)  # of the newest row: nothing has smoothed it yet
        self.scale = np.sqrt(np.maximum(after.diagonal(), 1e-300))
        kept, feasible = point, self.keeps(point)
        iterations, size, lasted, reason = 0, inf, 0.0, ""
        while size > effort.tolerance:
            spent = perf_counter() - began
            reason = effort.exhausted(iterations, size, spent + lasted)
            if reason:
                break
            step = self.programmed(point, believed if iterations == 0 else None)
            if not step.solved and iterations == 0:
                raise WindowError(f"no trajectory of the model keeps all bounds{self.broken(start)}.")
            if not step.solved:
                reason = f"the quadratic programme ended with {step.status}"
                break
            before, weights = point.stages, self.weights(point, believed if iterations == 0 else None)
            point, share = self.searched(point, step, free=iterations == 0)
            linear = share == 1.0 and self.unchanged(before, point, weights)  # the programme was the problem itself
            size = float(np.abs(share * step.change / self.scale).max())
            iterations += 1
            lasted = perf_counter() - began - spent
            if self.keeps(point) or not feasible:
                kept, feasible = point, self.keeps(point)
            if linear:
                break
            if share <= _SMALLEST_SHARE and size > effort.tolerance:
                reason = "no part of the last step makes the cost smaller"
                break
        return self.solution(kept if reason else point, size, iterations, began, reason)

    # -- a step -----------------------------------------------------------------------------------------------------

    def at(self, states: np.ndarray, noises: np.ndarray | None) -> _Point:
        """A trajectory with all that follows from it; noises that explain it best where none are given."""
        stages = self.stages.along(states, self.arrival, self.rows, self.shared, empty_first=bool(self.disturbed))
        if noises is None:
            roots = np.where(np.abs(stages.G.diagonal(0, 1, 2)) > 0.0, stages.G.diagonal(0, 1, 2), inf)
            noises = forward_substituted(stages.G, states - stages.moved, roots)
        squares = self.used * (self.measured - stages.measured) ** 2 / np.where(self.used > 0.0, stages.variances, 1.0)
        return _Point(states, noises, stages, squares)

    def weights(self, point: _Point, believed: np.ndarray | None = None) -> np.ndarray:
        """How much each measurement counts; the newest row judged with the covariance of its prediction."""
        squares = point.squares.copy()
        if believed is not None:
            spread = np.einsum("qi,ij,qj->q", point.stages.H[-1], believed, point.stages.H[-1])
            variances = np.where(self.used[-1] > 0.0, point.stages.variances[-1], 1.0)
            squares[-1] *= variances / (variances + spread)
        found = [robust_loss.weight(loss, squares[:, j], self.loss_scale) for j, loss in enumerate(self.problem.losses)]
        return np.asarray(self.used * np.stack(found, axis=1))

    def curvatures(self, point: _Point) -> np.ndarray:
        """Second derivatives of the losses where they are convex enough, else the weights; shape (N, q).

        With weights alone (iteratively reweighted least squares) the last digits of Geman-McClure take dozens of steps.
        """
        weights = self.weights(point)
        for j, loss in enumerate(self.problem.losses):
            if loss == "geman_mcclure":
                share = point.squares[:, j] / self.loss_scale**2
                exact = self.used[:, j] * (1.0 - 3.0 * share) / (1.0 + share) ** 3
                weights[:, j] = np.maximum(exact, _LEAST_CURVATURE * weights[:, j])
        return weights

    def whitened(self, point: _Point, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residuals and Jacobians in standard deviations, weighted; shapes (N, q), (N, q, n)."""
        roots = np.sqrt(weights)
        residuals = np.einsum("kpq,kq->kp", point.stages.whitening, roots * (self.measured - point.stages.measured))
        return residuals, np.einsum("kpq,kqn->kpn", point.stages.whitening, roots[:, :, None] * point.stages.H)

    def programmed(self, point: _Point, believed: np.ndarray | None) -> Step:
        """The quadratic programme of a step: first without bounds, and with them where it would break one."""
        weights = self.weights(point, believed)
        residuals, H = self.whitened(point, weights)
        _, bent = self.whitened(point, weights if believed is not None else self.curvatures(point))
        A = np.einsum("kqi,kqj->kij", bent, bent)
        b = -np.einsum("kqi,kq->ki", H, residuals)
        stages = point.stages
        quadratic = (A, b, stages.F, stages.G, stages.moved - point.states)
        lower, upper = self.lower - point.states, self.upper - point.states
        if self.active(point.states) == 0 and not self.disturbed:
            found = self.program.solve_free(*quadratic)
            if found.solved and ((found.change >= lower) & (found.change <= upper)).all():
                return found
        found = self.program.solve(*quadratic, lower, upper, self.noise_limits)
        return found._replace(change=np.clip(found.change, lower, upper))

    def searched(self, point: _Point, step: Step, *, free: bool) -> tuple[_Point, float]:
        """The point after as much of a step as makes the cost smaller, and how much that was; all of it where free."""
        prices = 2.0 * np.abs(step.prices).max(axis=0)
        before, share = self.merit(point, prices), 1.0
        while True:
            noises = point.noises + share * (step.noises - point.noises)
            after = self.at(point.states + share * step.change, noises)
            better = self.merit(after, prices) <= before + 1e-9 * (1.0 + abs(before))
            if free or better or share <= _SMALLEST_SHARE:
                return after, share
            share *= 0.5

    def unchanged(self, before: Stages, point: _Point, weights: np.ndarray) -> bool:
        """Whether a step met no curvature: Jacobians and weights after it are those before it."""
        now = point.stages
        pairs = ((before.F, now.F), (before.G, now.G), (before.H, now.H), (weights, self.weights(point)))
        return self.keeps(point) and all(np.array_equal(old, new) for old, new in pairs)

    def merit(self, point: _Point, prices: np.ndarray) -> float:
        """Cost, and what the transitions that are not kept cost at these prices, shape (n,)."""
        return self.cost(point) + float(prices @ np.abs(self.missing(point)).sum(axis=0))

    def missing(self, point: _Point) -> np.ndarray:
        """What the transitions are off, shape (N, n)."""
        stages = point.stages
        return np.asarray(point.states - stages.moved - np.einsum("kir,kr->ki", stages.G, point.noises))

    def cost(self, point: _Point) -> float:
        """Half the squares of the noises, and the losses."""
        losses = [
            robust_loss.cost(loss, point.squares[:, j], self.loss_scale) for j, loss in enumerate(self.problem.losses)
        ]
        return float(0.5 * (point.noises**2).sum() + sum(loss.sum() for loss in losses))

    # -- what is reported -------------------------------------------------------------------------------------------

    def spread(self, point: _Point) -> tuple[np.ndarray, np.ndarray]:
        """Covariance of the last row before and after its measurements, shapes (n, n)."""
        roots = np.sqrt(self.weights(point))
        weighted = point.stages._replace(whitening=point.stages.whitening * roots[:, None, :])
        return self.stages.covariances(weighted, self.rows)

    def keeps(self, point: _Point) -> bool:
        """Whether a point keeps the transitions and the bounds of disturbances; every point keeps those of states."""
        kept = bool((np.abs(self.missing(point)) <= _KEPT * self.scale).all())
        return kept and self.disturbs(point.stages, point.noises) <= _KEPT * float(self.scale.max())

    def disturbs(self, stages: Stages, noises: np.ndarray) -> float:
        """How far disturbances are beyond their bounds at most; negative where none is."""
        if self.noise_limits is None:
            return -inf
        w = np.einsum("kir,kr->ki", stages.G[:, self.disturbed], noises)
        return float(np.maximum(self.noise_limits[0] - w, w - self.noise_limits[1]).max())

    def limits_of_noises(self) -> tuple[np.ndarray, np.ndarray]:
        """Bounds of the disturbances into each row, infinite where none is, shape (N, d) each."""
        found = (
            np.full((len(self.rows), len(self.disturbed)), -inf),
            np.full((len(self.rows), len(self.disturbed)), inf),
        )
        for k, flat in enumerate(self.rows):
            row = self.problem.layout.unpacked(flat)
            if row.moves > 0.5:
                found[0][k], found[1][k] = self.problem.noise_limits(row, self.shared)
        return found

    def active(self, states: np.ndarray) -> int:
        """How many bounds are touched."""
        near, last = _NEAR * self.scale, slice(-len(states), None)
        return int(((states <= self.lower[last] + near) | (states >= self.upper[last] - near)).sum())

    def pushed(self, point: _Point) -> int:
        """How many disturbances into the last row touch their bounds."""
        if self.noise_limits is None:
            return 0
        w, near = (point.stages.G[-1] @ point.noises[-1])[self.disturbed], _NEAR * self.scale[self.disturbed]
        return int(((w <= self.noise_limits[0][-1] + near) | (w >= self.noise_limits[1][-1] - near)).sum())

    def far_pushed(self, point: _Point) -> float:
        """How many transitions need a disturbance more than `FAR` of its own deviations off; the first is none."""
        G = point.stages.G
        w = np.einsum("kir,kr->ki", G, point.noises)
        return float((w**2 > FAR**2 * np.einsum("kir,kir->ki", G, G))[1:].any(axis=1).sum())

    def broken(self, start: np.ndarray) -> str:
        """What the first guess breaks, in words."""
        parts = [
            f"state {i} is {start[k, i]:g} in row {k - bool(self.disturbed)}, legal is {self.lower[k, i]:g} to "
            f"{self.upper[k, i]:g}"
            for k, i in np.argwhere((start < self.lower) | (start > self.upper))[:2]
        ]
        return "; the first guess breaks them: " + "; ".join(parts) if parts else ""

    def solution(self, point: _Point, size: float, iterations: int, began: float, reason: str) -> FullSolution:
        """The solution in full."""
        weights = self.weights(point)
        residuals, _ = self.whitened(point, weights)
        _, covariance = self.spread(point)
        return FullSolution(
            states=point.states,
            noises=point.noises,
            weights=weights,
            covariance=covariance,
            cost=self.cost(point),
            residual=float(np.sqrt((residuals**2).sum() / max(self.used.sum(), 1.0))),
            step=size,
            far=((point.squares > FAR**2).sum() + self.far_pushed(point)) / max(self.used.sum(), 1.0),
            broken=float((np.abs(self.missing(point)) / self.scale).max()),
            iterations=iterations,
            seconds=perf_counter() - began,
            active=self.active(point.states[-1:]) + self.pushed(point),
            converged=not reason,
            timed_out=reason.startswith("deadline"),
            feasible=self.keeps(point),
            reason=reason,
        )
