"""All rows of a window evaluated in one call: transitions, what is measured, and exact Jacobians of both.

The functions of a `WindowProblem` are traced once by CasADi and mapped over the rows. It knows no solver.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from fmu_observer.formulas.filtering.kalman import symmetric
from fmu_observer.formulas.filtering.square_root import factor, solved_lower
from fmu_observer.formulas.moving_horizon.arrival_cost import ArrivalCost
from fmu_observer.formulas.moving_horizon.window_problem import WindowProblem
from plant_models.hybrid import Array
from plant_models.hybrid.casadi_package import ca

_Numbers = np.ndarray


class Stages(NamedTuple):
    """A window along one trajectory, N rows.

    Attributes:
        moved: state in each row as the one before says, in the first as the arrival cost says, shape (N, n).
        F: Jacobian of the transition into each row, zero in the first, shape (N, n, n).
        G: factor of the covariance that each transition adds, of the arrival cost in the first, shape (N, n, n).
        measured: shape (N, q). H: its Jacobian, shape (N, q, n). whitening: inverse factor of the covariance of what
            was measured in a row, zero for the rest, shape (N, q, q). variances: of each measurement, shape (N, q).
    """

    moved: _Numbers
    F: _Numbers
    G: _Numbers
    measured: _Numbers
    H: _Numbers
    whitening: _Numbers
    variances: _Numbers


class BufferedCall:
    """A CasADi function called on the memory of NumPy arrays, without a copy by its own types.

    Args:
        function: its arguments and results are taken by their nonzeros, column by column.

    Attributes:
        memory: number by which the function keeps the statistics of these calls.
    """

    def __init__(self, function: Any) -> None:
        self._arguments = [np.zeros(function.nnz_in(i)) for i in range(function.n_in())]
        self._results = [np.zeros(function.nnz_out(i)) for i in range(function.n_out())]
        self.memory: int = function.checkout()  # the buffer takes the next one that is free: this
        function.release(self.memory)
        self._buffer, self._evaluate = function.buffer()
        for i, buffer in enumerate(self._arguments):
            self._buffer.set_arg(i, buffer.data)
        for i, result in enumerate(self._results):
            self._buffer.set_res(i, result.data)

    def __call__(self, *arguments: _Numbers) -> list[_Numbers]:
        """The results, which the next call overwrites.

        Args:
            arguments: as many numbers each as it has nonzeros, column by column.
        """
        for buffer, argument in zip(self._arguments, arguments, strict=True):
            buffer[:] = np.ravel(argument)
        self._evaluate()
        return self._results


class WindowStages:
    """The functions of a window problem, compiled to one call for all rows.

    Args:
        problem: what moves and what is measured.
    """

    def __init__(self, problem: WindowProblem) -> None:
        self.problem = problem
        self._mapped: dict[tuple[str, int], BufferedCall] = {}
        self._shared_count = 0

    def along(
        self, states: _Numbers, arrival: ArrivalCost, rows: _Numbers, shared: _Numbers, *, empty_first: bool = False
    ) -> Stages:
        """The stages along a trajectory.

        Args:
            states: of each row, shape (N, n). arrival: what is known before the first row. rows: shape (N, width).
            shared: what all rows share, shape (s,).
            empty_first: whether the first row is empty and stands for the state before the window; the transition out
                of it stays linearised at the arrival cost's point.
        """
        count, n, q = len(rows), self.problem.order, self.problem.layout.measurements
        shared = np.asarray(shared, dtype=float)
        self._shared_count = len(shared)
        before = np.vstack([np.reshape(arrival.point, (1, n)), states[:-1]])
        if empty_first:
            before[1] = arrival.point
        moved, F, added = self._called("transition", count, n, before, rows, shared)
        mean, P = np.asarray(arrival.mean, dtype=float), np.reshape(np.asarray(arrival.covariance, dtype=float), (n, n))
        moved, G = moved[:, :, 0], added
        moved[0] += F[0] @ (mean - before[0])
        if empty_first:
            moved[1] += F[1] @ (states[0] - before[1])
        G[0] = factor(symmetric(F[0] @ P @ F[0].T + added[0] @ added[0].T))
        F[0] = 0.0
        measured, H, whitening, variances = self._called("reading", count, q, states, rows, shared)
        return Stages(moved, F, G, measured[:, :, 0], H, whitening, variances[:, :, 0])

    def covariances(self, stages: Stages, rows: _Numbers) -> tuple[_Numbers, _Numbers]:
        """Covariance of the last row before and after what is measured in it, by the Kalman filter along the stages.

        Args:
            stages: of a trajectory; `whitening` with the weights of the losses. rows: shape (N, width).

        Returns:
            Both of shape (n, n).
        """
        count, n = len(rows), self.problem.order
        if ("spread", count) not in self._mapped:
            self._mapped["spread", count] = BufferedCall(self._spread.mapaccum(count))
        seen = np.einsum("kpq,kqn->kpn", stages.whitening, stages.H)
        blocks = (np.ascontiguousarray(part.transpose(0, 2, 1)) for part in (stages.F, stages.G, seen))
        after, before = self._mapped["spread", count](np.zeros((n, n)), *blocks)
        return before[-n * n :].reshape(n, n).copy(), after[-n * n :].reshape(n, n).copy()

    # -- internals --------------------------------------------------------------------------------------------------

    def _called(
        self, name: str, count: int, height: int, states: _Numbers, rows: _Numbers, shared: _Numbers
    ) -> list[_Numbers]:
        """Results of a function for all rows, each of shape (count, height, width of a result)."""
        if (name, count) not in self._mapped:
            function = self._transition if name == "transition" else self._reading
            self._mapped[name, count] = BufferedCall(function.map(name, "serial", count, [2], []))
        results = self._mapped[name, count](states, rows, shared)
        return [part.reshape(count, -1, height).transpose(0, 2, 1).copy() for part in results]

    def _symbols(self) -> tuple[list[Any], Any, Any, Any]:
        problem = self.problem
        sizes = {"x": problem.order, "row": problem.layout.width, "shared": self._shared_count}
        symbols = [ca.SX.sym(name, size) for name, size in sizes.items()]
        x, row, shared = (ca.ArrayInterface.SX(s, shape=(s.numel(),)) for s in symbols)
        return symbols, x, problem.layout.unpacked(row), shared

    @cached_property
    def _transition(self) -> Any:
        symbols, x, row, shared = self._symbols()
        moved = self.problem.moved(x, row, shared)
        goes = row.moves > 0.5
        state = np.where(goes, moved.state, x)
        F = np.where(goes, moved.F, np.eye(self.problem.order))
        return _function("transition", symbols, state, F, np.where(goes, factor(moved.noise), 0.0 * moved.noise))

    @cached_property
    def _reading(self) -> Any:
        symbols, x, row, shared = self._symbols()
        seen, q = self.problem.seen(x, row, shared), self.problem.layout.measurements
        noise = seen.noise * np.outer(row.used, row.used) + np.diag(1.0 - row.used)
        whitening = solved_lower(factor(noise), np.eye(q)) * np.outer(row.used, row.used)
        variances = np.hstack([seen.noise[j : j + 1, j] for j in range(q)])
        return _function("reading", symbols, seen.measured, seen.H, whitening, variances)

    @cached_property
    def _spread(self) -> Any:
        n, q = self.problem.order, self.problem.layout.measurements
        P, F, G, seen = ca.SX.sym("P", n, n), ca.SX.sym("F", n, n), ca.SX.sym("G", n, n), ca.SX.sym("H", q, n)
        before = F @ P @ F.T + G @ G.T
        shown = seen @ before
        after = before - shown.T @ ca.solve(ca.SX.eye(q) + shown @ seen.T, shown)
        return ca.Function("spread", [P, F, G, seen], [ca.densify(0.5 * (after + after.T)), ca.densify(before)])


def _function(name: str, symbols: list[Any], *results: Array) -> Any:
    return ca.Function(name, symbols, ca.cse([ca.densify(ca.SX(result)) for result in results]))


def forward_substituted(G: np.ndarray, right: np.ndarray, pivots: np.ndarray) -> np.ndarray:
    """Solutions of ``G w = right`` for lower triangular G; zero where a pivot is infinite; shape (N, n).

    Args:
        G: shape (N, n, n). right: shape (N, n). pivots: its diagonal, infinite for zero, shape (N, n).
    """
    found = np.zeros(right.shape)
    for i in range(right.shape[1]):
        found[:, i] = (right[:, i] - np.einsum("kj,kj->k", G[:, i, :i], found[:, :i])) / pivots[:, i]
    return found
