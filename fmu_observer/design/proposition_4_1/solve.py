"""Proposition 4-1 handed to a cone solver. What comes back is only a candidate; whoever asks recomputes it.

The only file of this room that uses cvxpy, the extra `lmi`.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fmu_observer.design.cvxpy_module import load_cvxpy
from fmu_observer.design.proposition_4_1.inequalities import Proposition41Problem, inequalities

STRICTNESS = (1e-8, 1e-7, 1e-6)  # asked of every inequality, the least first: what is recomputed must be positive


@dataclass(frozen=True, eq=False)
class Candidate:
    """What the solver returned.

    Attributes:
        P: shape (n, n). gains: K of each vertex, shape (N, n). value: of the objective. status: the solver's word.
    """

    P: np.ndarray
    gains: np.ndarray
    value: float
    status: str


def least_condition(problem: Proposition41Problem, gains: np.ndarray | None) -> Iterator[Candidate]:
    """Least ``lambda_2`` with ``lambda_1 = 1``.

    Args:
        problem: the question. gains: shape (N, n) to keep; None to seek them.

    Yields:
        What the solver returned, once for every strictness where it is usable.

    Raises:
        ImportError: cvxpy is not installed.
    """

    def objective(cp: Any, P: Any, _: Any) -> tuple[Any, list[Any]]:
        largest = cp.Variable()
        return largest, [P << largest * np.eye(problem.order)]

    return _candidates(problem, gains, objective, problem.alpha)


def least_alpha(problem: Proposition41Problem, gains: np.ndarray | None) -> Iterator[Candidate]:
    """Least alpha with ``P >= I``, that of the problem left aside.

    Args:
        problem: the question. gains: shape (N, n) to keep; None to seek them.

    Yields:
        What the solver returned, once for every strictness where it is usable; alpha as `value`.

    Raises:
        ImportError: cvxpy is not installed.
    """
    return _candidates(problem, gains, lambda _cp, _P, alpha: (alpha, []), None)


def sharpest(drifts: np.ndarray, gain: np.ndarray, m: float) -> Iterator[tuple[np.ndarray, str]]:
    """P with the least ``C inv(P) C'`` at ``K' P K = 1``, C the first unit row, and a proven decay.

    Args:
        drifts: error matrices ``A - K C``, shape (N, n, n). gain: K, shape (n,). m: decay rate [1/s].

    Yields:
        P of shape (n, n) and the solver's word, where it is usable.

    Raises:
        ImportError: cvxpy is not installed.
    """
    cp = load_cvxpy("Design by Proposition 4-1")
    n = len(gain)
    P, strict = cp.Variable((n, n), symmetric=True), cp.Parameter()
    constraints = [cp.sum(cp.multiply(np.outer(gain, gain), P)) <= 1.0, P >> strict * np.eye(n)]
    for drift in drifts:
        moved = P @ drift
        constraints.append(-(moved + moved.T) - 2.0 * m * P >> strict * np.eye(n))
    question = cp.Problem(cp.Minimize(cp.matrix_frac(np.eye(1, n)[0], P)), constraints)
    for strict.value in STRICTNESS:
        if _run(cp, question):
            yield 0.5 * (P.value + P.value.T), str(question.status)


def _candidates(
    problem: Proposition41Problem,
    gains: np.ndarray | None,
    objective: Callable[[Any, Any, Any], tuple[Any, list[Any]]],
    alpha: float | None,
) -> Iterator[Candidate]:
    cp = load_cvxpy("Design by Proposition 4-1")
    n = problem.order
    P, strict = cp.Variable((n, n), symmetric=True), cp.Parameter()
    if gains is None:
        M: Sequence[Any] = [cp.Variable((n, 1)) for _ in problem.A]
    else:
        M = [P @ K[:, None] for K in gains]
    unknown_alpha = cp.Variable()
    goal, constraints = objective(cp, P, unknown_alpha)
    limit = unknown_alpha if goal is unknown_alpha else alpha
    for _, rows in inequalities(problem, P, M, limit).values():
        matrix = cp.bmat(rows)
        constraints.append(matrix >> strict * np.eye(matrix.shape[0]))
    question = cp.Problem(cp.Minimize(goal), constraints)
    for strict.value in STRICTNESS:
        if _run(cp, question):
            matrix = 0.5 * (P.value + P.value.T)
            found = np.linalg.solve(matrix, np.hstack([m.value for m in M])).T if gains is None else gains
            yield Candidate(matrix, np.asarray(found), float(goal.value), str(question.status))


def _run(cp: Any, question: Any) -> bool:
    """Whether the solver left numbers behind."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # "may be inaccurate": every number is checked anyway
        try:
            question.solve(solver="CLARABEL")
        except cp.error.SolverError:
            return False
    return question.status in ("optimal", "optimal_inaccurate")
