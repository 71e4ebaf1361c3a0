"""The matrix inequalities of Proposition 4-1: the same formulas for a solver's unknowns and for numbers, and how far
numbers keep them. Nothing is solved here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fmu_observer.design.cone_solver import Matrix, Rows, smallest_eigenvalue
from fmu_observer.models.checks import check_numbers

DECAY, GAIN, _SCALE = "(4.41)", "(4.42)", "(4.44)"
"""Names of the inequalities: decay of the error, size of the gain, P at least the identity."""


@dataclass(frozen=True, eq=False)
class Proposition41Problem:
    """What Proposition 4-1 is asked.

    Attributes:
        A: vertices of the model, shape (N, n, n) [1/s]. C: shape (1, n). m: decay rate of the error, eps / 2 [1/s].
        alpha: bound of ``K' P K``; None leaves (4.42) out.
    """

    A: np.ndarray
    C: np.ndarray
    m: float
    alpha: float | None

    @classmethod
    def of(cls, A: Any, C: Any, m: float, alpha: float | None) -> Proposition41Problem:
        """The question for a model.

        Args:
            A: one matrix of shape (n, n) or vertices of shape (N, n, n). C: one measurement, shape (n,) or (1, n).
            m: decay rate [1/s]. alpha: bound of ``K' P K``, or None.

        Raises:
            ValueError: shapes do not agree, or m or alpha is not a positive number.
        """
        vertices = np.asarray(A, dtype=float)
        vertices = vertices[None] if vertices.ndim == 2 else vertices
        measured = np.atleast_2d(np.asarray(C, dtype=float))
        n = vertices.shape[-1]
        if vertices.ndim != 3 or vertices.shape[1] != n or measured.shape != (1, n):
            raise ValueError(
                f"Proposition 4-1: A {np.shape(A)} must be square, or vertices of square matrices, and C "
                f"{np.shape(C)} one row for them."
            )
        check_numbers("Proposition 4-1", {"m": m, "alpha": 1.0 if alpha is None else alpha})
        return cls(vertices, measured, float(m), None if alpha is None else float(alpha))

    @property
    def order(self) -> int:
        """Number of states, n."""
        return int(self.A.shape[-1])


def inequalities(
    problem: Proposition41Problem, P: Matrix, M: Sequence[Matrix], alpha: Matrix | None
) -> dict[str, tuple[str, Rows]]:
    """Block rows of every matrix that must be positive definite: Aguiar Cota 2019, (4.41), (4.42), (4.44) with
    ``lambda_1 = 1``.

    The print leaves the scale of P open, so that its objective ``lambda_2 - lambda_1`` has the infimum 0 as P vanishes;
    ``P >= I`` fixes it. The blocks of (4.42) stand in the order in which their sizes agree.

    Args:
        problem: the question. P: shape (n, n). M: ``P K`` of each vertex, shape (n, 1).
        alpha: number or unknown; None leaves (4.42) out.

    Returns:
        By words for a message: the name of the inequality, and its rows.
    """
    found: dict[str, tuple[str, Rows]] = {_SCALE: (_SCALE, [[P - np.eye(problem.order)]])}
    for i, (A, product) in enumerate(zip(problem.A, M, strict=True)):
        where = f" at vertex {i + 1}" if len(problem.A) > 1 else ""
        moved = P @ A - product @ problem.C
        found[f"{DECAY}{where}"] = (DECAY, [[-(moved + moved.T) - 2.0 * problem.m * P]])
        if alpha is not None:
            found[f"{GAIN}{where}"] = (GAIN, [[P, product], [product.T, alpha * np.eye(1)]])
    return found


def margins(problem: Proposition41Problem, P: np.ndarray, gains: np.ndarray) -> dict[str, float]:
    """How far every inequality is from failing: the smallest eigenvalue of what must be positive, less rounding.

    Args:
        problem: the question. P: shape (n, n). gains: K of each vertex, shape (N, n).

    Returns:
        By name; all positive exactly when the numbers prove what was asked. Of (4.44) only that P is positive definite
        is asked, for beta follows from the eigenvalues of P as they are.
    """
    M = [(P @ K)[:, None] for K in gains]
    blocks = inequalities(problem, P, M, problem.alpha)
    found = {name: smallest_eigenvalue(np.block(rows)) for name, (_, rows) in blocks.items()}
    return found | {_SCALE: smallest_eigenvalue(P)}


def train_vertices(slopes: Sequence[float]) -> np.ndarray:
    """Vertices of the train ``[v, d, d']`` with ``dv = -s v - d``: Aguiar Cota 2019, 4.3.4, (3.36).

    Args:
        slopes: drag slopes s [1/s], one or more; ``w1`` in 4.3.4, ``w1 + w2 v`` at both ends of the speeds in 3.3.

    Returns:
        Shape (N, 3, 3) [1/s].
    """
    return np.array([[[-float(s), -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]] for s in slopes])
