"""Proposition 4-1 handed to a cone solver. What comes back is only a candidate; whoever asks recomputes it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fmu_observer.design.cone_solver import attempts, load_cvxpy, symmetric_value
from fmu_observer.design.proposition_4_1.proposition_inequalities import Proposition41Problem, inequalities

_STRICTNESS = (1e-8, 1e-7, 1e-6)  # asked of every inequality, the least first: what is recomputed must be positive


@dataclass(frozen=True, eq=False)
class Proposition41Candidate:
    """What the solver returned.

    Attributes:
        P: shape (n, n). gains: K of each vertex, shape (N, n). value: of the objective. status: the solver's word.
    """

    P: np.ndarray
    gains: np.ndarray
    value: float
    status: str


def least_condition(problem: Proposition41Problem, gains: np.ndarray | None) -> Iterator[Proposition41Candidate]:
    """Least ``lambda_2`` with ``lambda_1 = 1``.

    Args:
        problem: the question. gains: shape (N, n) to keep; None to seek them.

    Yields:
        What the solver returned, once for every strictness where it is usable.

    Raises:
        ImportError: cvxpy is not installed.
    """
    cp = load_cvxpy("Design by Proposition 4-1")
    question = _Question.of(cp, problem, gains, problem.alpha)
    largest = cp.Variable()
    yield from question.candidates(cp, largest, [question.P << largest * np.eye(problem.order)])()


def least_alphas(
    problem: Proposition41Problem, gains: np.ndarray | None
) -> Callable[[float], Iterator[Proposition41Candidate]]:
    """Least alpha with ``P >= I`` by the decay; decay and alpha of the problem are left aside.

    Args:
        problem: the question. gains: shape (N, n) to keep; None to seek them.

    Returns:
        A function of the decay [1/s] that yields what the solver returned, once for every strictness where it is
        usable, alpha as `value`. The question is posed once.

    Raises:
        ImportError: cvxpy is not installed.
    """
    cp = load_cvxpy("Design by Proposition 4-1")
    m, alpha = cp.Parameter(nonneg=True), cp.Variable()
    question = _Question.of(cp, replace(problem, m=m, alpha=None), gains, alpha)
    solve = question.candidates(cp, alpha, [])

    def of_decay(decay: float) -> Iterator[Proposition41Candidate]:
        m.value = decay
        yield from solve()

    return of_decay


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
    for status in attempts(cp, question, strict, _STRICTNESS):
        yield symmetric_value(P), status


@dataclass(frozen=True, eq=False)
class _Question:
    """The unknowns with the inequalities on them.

    Attributes:
        P: unknown, shape (n, n). M: ``P K`` of each vertex. gains: those to keep, or None. strict: asked of every
            inequality. constraints: the inequalities.
    """

    P: Any
    M: Sequence[Any]
    gains: np.ndarray | None
    strict: Any
    constraints: list[Any]

    @classmethod
    def of(cls, cp: Any, problem: Proposition41Problem, gains: np.ndarray | None, alpha: Any) -> _Question:
        n = problem.order
        P, strict = cp.Variable((n, n), symmetric=True), cp.Parameter(nonneg=True)
        M = [cp.Variable((n, 1)) for _ in problem.A] if gains is None else [P @ K[:, None] for K in gains]
        matrices = [cp.bmat(rows) for _, rows in inequalities(problem, P, M, alpha).values()]
        return cls(P, M, gains, strict, [matrix >> strict * np.eye(matrix.shape[0]) for matrix in matrices])

    def candidates(self, cp: Any, goal: Any, constraints: list[Any]) -> Callable[[], Iterator[Proposition41Candidate]]:
        posed = cp.Problem(cp.Minimize(goal), [*self.constraints, *constraints])

        def solve() -> Iterator[Proposition41Candidate]:
            for status in attempts(cp, posed, self.strict, _STRICTNESS):
                P, found = symmetric_value(self.P), self.gains
                if found is None:
                    found = np.linalg.solve(P, np.hstack([product.value for product in self.M])).T
                yield Proposition41Candidate(P, found, float(goal.value), status)

        return solve
