"""Common quadratic Lyapunov functions: found by a cone solver, then recomputed in NumPy.

The linear matrix inequalities are handed to Clarabel directly as a problem over positive semidefinite cones. Its answer
is only a candidate: what counts is the largest eigenvalue recomputed by the caller on a finer grid.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf, sqrt
from typing import TypeVar

import numpy as np
import scipy

from plant_models.hybrid import Array
from plant_models.missing_package import optional_package

_Worst = TypeVar("_Worst")

# smallest recomputed decrease, in scaled coordinates, that counts: a thousand times the rounding of the check
MARGIN = 1e-6


@dataclass(frozen=True)
class Decrease:
    """The best common quadratic decrease found.

    Attributes:
        margin: recomputed; -inf where there is no candidate. P: of the function, shape (n, n).
    """

    margin: float
    P: np.ndarray | None

    @property
    def holds(self) -> bool:
        """Whether the function falls."""
        return self.margin > MARGIN

    def unscaled(self, scale: np.ndarray) -> Decrease:
        """The same in the coordinates whose units have the sizes `scale`, shape (n,)."""
        return self if self.P is None else Decrease(self.margin, self.P / np.outer(scale, scale))


@dataclass(frozen=True)
class QuadraticForm:
    """A candidate ``e' P e`` with trace(P) = n in the coordinates it was sought in.

    Attributes:
        P: symmetric matrix, shape (n, n). margin: margin the solver claims, to be recomputed.
    """

    P: np.ndarray
    margin: float


@dataclass(frozen=True)
class QuadraticCondition:
    """Inequalities ``M_j' P N_j + N_j' P M_j - w_j P < 0``: arrays M, N of shape (count, n, n) and w of shape (count,).

    A discrete transition F asks ``F' P F - P < 0`` (M = F / 2, N = F, w = 1), a flow A asks ``A' P + P A < 0`` (M = A,
    N = I, w = 0).
    """

    M: np.ndarray
    N: np.ndarray
    w: np.ndarray

    def picked(self, indices: Sequence[int]) -> QuadraticCondition:
        """The inequalities at `indices`."""
        chosen = list(indices)
        return QuadraticCondition(self.M[chosen], self.N[chosen], self.w[chosen])

    def joined(self, other: QuadraticCondition) -> QuadraticCondition:
        """Both together.

        Args:
            other: of the same components.
        """
        pairs = ((self.M, other.M), (self.N, other.N), (self.w, other.w))
        return QuadraticCondition(*(np.concatenate(pair) for pair in pairs))


def transition_condition(matrices: np.ndarray, weights: Array = 1.0) -> QuadraticCondition:
    """``(F' P F - P) / weight < 0`` for transitions of shape (count, n, n) and weights of shape (count,) or a
    number.

    Args:
        matrices: transitions F, shape (count, n, n).
    """
    scale = 1.0 / np.broadcast_to(np.asarray(weights, dtype=float), (len(matrices),))
    return QuadraticCondition(0.5 * scale[:, None, None] * matrices, matrices, scale)


def flow_condition(matrix: np.ndarray) -> QuadraticCondition:
    """``A' P + P A < 0`` for one matrix of shape (n, n)."""
    return QuadraticCondition(matrix[None], np.eye(len(matrix))[None], np.zeros(1))


def inequalities(condition: QuadraticCondition, P: np.ndarray) -> np.ndarray:
    """Left-hand side of every inequality at P, shape (count, n, n).

    Args:
        condition: inequalities in P.
    """
    half = np.swapaxes(condition.M, 1, 2) @ P @ condition.N
    values = half + np.swapaxes(half, 1, 2) - condition.w[:, None, None] * P
    return np.asarray(values)


def decrease(condition: QuadraticCondition, P: np.ndarray) -> np.ndarray:
    """Largest eigenvalue of every inequality at P, shape (count,); all negative when P is a Lyapunov matrix.

    Args:
        condition: inequalities in P.
    """
    return np.asarray(np.linalg.eigvalsh(inequalities(condition, P))[:, -1])


def common_quadratic_form(condition: QuadraticCondition) -> QuadraticForm | None:
    """The P with the largest common margin: maximise g subject to every inequality <= -g I, P >= 0, trace(P) = n.

    Args:
        condition: the inequalities, in coordinates where their numbers are of order one.

    Returns:
        The candidate, made symmetric and positive definite; None when the solver returns nothing usable.
    """
    n = condition.M.shape[1]
    rows, size = _inequality_rows(condition), n * (n + 1) // 2
    margin_column = np.tile(_pack(np.eye(n)), len(condition.w))[:, None]
    scaling = np.diag([1.0 if i == j else sqrt(2.0) for i, j in _upper(n)])
    positive = np.hstack([-scaling, np.zeros((size, 1))])
    trace = np.append(_pack(np.eye(n)), 0.0)[None]
    matrix = np.vstack([trace, positive, np.hstack([rows, margin_column])])
    solution = _solve(matrix, n, len(condition.w))
    if not np.all(np.isfinite(solution)):
        return None
    P = _unpack(solution[:size], n)
    return QuadraticForm(P, float(solution[size])) if np.linalg.eigvalsh(P)[0] > 0.0 else None


def best_decrease(
    sought: QuadraticCondition,
    recomputed: Callable[[np.ndarray], tuple[float, _Worst]],
    refined: Callable[[QuadraticCondition, _Worst], QuadraticCondition],
    rounds: int,
) -> Decrease:
    """The best form of a few rounds, in each of which the inequalities that the last one did not cover are added.

    Args:
        sought: inequalities of the first round. recomputed: the margin at P over all inequalities there are, and where
            it is smallest. refined: the inequalities of the next round. rounds: at most so many.
    """
    best = Decrease(-inf, None)
    for _ in range(rounds):
        candidate = common_quadratic_form(sought)
        if candidate is None:
            break
        margin, worst = recomputed(candidate.P)
        if margin > best.margin:
            best = Decrease(margin, candidate.P)
        if margin > MARGIN or candidate.margin <= MARGIN:
            break
        sought = refined(sought, worst)
    return best


def largest_between(values: np.ndarray) -> float:
    """Largest eigenvalue of matrices on grids and between their points, shape (..., points, n, n).

    Between two points a smooth matrix lies below its chord plus ``d^2/8`` of the norm of its second derivative, and
    that is what the second differences on the grid estimate.

    Args:
        values: symmetric, on grids of equidistant points.
    """
    bend = np.linalg.norm(np.diff(values, 2, axis=-3), axis=(-2, -1)).max()
    return float(np.linalg.eigvalsh(values)[..., -1].max() + 0.125 * bend)


def _solve(matrix: np.ndarray, n: int, inequalities: int) -> np.ndarray:
    variables = matrix.shape[1]
    right = np.zeros(len(matrix))
    right[0] = n
    cost = np.zeros(variables)
    cost[-1] = -1.0
    clarabel = optional_package("clarabel", "A certificate by a common quadratic Lyapunov function")
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    cones = [clarabel.ZeroConeT(1), *(clarabel.PSDTriangleConeT(n) for _ in range(inequalities + 1))]
    empty = scipy.sparse.csc_matrix((variables, variables))
    return np.asarray(
        clarabel.DefaultSolver(empty, cost, scipy.sparse.csc_matrix(matrix), right, cones, settings).solve().x
    )


def _inequality_rows(condition: QuadraticCondition) -> np.ndarray:
    """The packed left-hand side of every inequality as a linear map of packed P, shape (count * size, size)."""
    n = condition.M.shape[1]
    columns = []
    for i, j in _upper(n):
        unit = np.zeros((n, n))
        unit[i, j] = unit[j, i] = 1.0
        columns.append(_pack_all(inequalities(condition, unit), n).ravel())
    return np.stack(columns, axis=1)


def _upper(n: int) -> Sequence[tuple[int, int]]:
    return [(i, j) for j in range(n) for i in range(j + 1)]


def _pack(matrix: np.ndarray) -> np.ndarray:
    """Upper triangle by columns, off-diagonal entries times sqrt(2): the solver's order."""
    return np.asarray(_pack_all(matrix[None], len(matrix))[0])


def _pack_all(matrices: np.ndarray, n: int) -> np.ndarray:
    return np.stack([matrices[:, i, j] * (1.0 if i == j else sqrt(2.0)) for i, j in _upper(n)], axis=1)


def _unpack(entries: np.ndarray, n: int) -> np.ndarray:
    matrix = np.zeros((n, n))
    for value, (i, j) in zip(entries, _upper(n), strict=True):
        matrix[i, j] = matrix[j, i] = value
    return matrix
