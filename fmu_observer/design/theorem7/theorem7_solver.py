"""Theorem 7 handed to a cone solver. What comes back is only a candidate; `margins` decides."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from fmu_observer.design.cone_solver import Attempt, attempts, load_cvxpy, symmetric_value
from fmu_observer.design.theorem7.theorem7_inequalities import Theorem7Problem, Unknowns, inequalities

Gains = tuple[np.ndarray, np.ndarray]

# strictness asked of every inequality where gamma is minimised, and the solver's tolerances
_ATTEMPTS: tuple[Attempt, ...] = (
    (1e-6, {"tol_gap_abs": 1e-6, "tol_gap_rel": 1e-6, "tol_feas": 1e-7, "tol_ktratio": 1e-6}),
    (1e-6, {}),
    (1e-6, {"static_regularization_constant": 1e-6}),  # for states that differ by decades
    (1e-4, {"static_regularization_constant": 1e-6}),
)


@dataclass(frozen=True, eq=False)
class Theorem7Candidate:
    """What the solver returned, in scaled coordinates.

    Attributes:
        unknowns: numbers. sampled_gain, continuous_gain: shape (N, n, q). status: the solver's word for it.
    """

    unknowns: Unknowns
    sampled_gain: np.ndarray
    continuous_gain: np.ndarray
    status: str


def candidates(problem: Theorem7Problem, performance: bool, gains: Gains | None = None) -> Iterator[Theorem7Candidate]:
    """Seek values for the unknowns, once with every setting in `_ATTEMPTS`; take the first that proves what is asked.

    Args:
        problem: the question. performance: minimise gamma squared; without it maximise the margin of the decay at
            trace(P) = n.
        gains: K_i1 of shape (N, n, q1) and K_i2 of shape (N, n, q2) in scaled coordinates to keep; None to seek them
            too.

    Yields:
        What the solver returned, where it is usable.

    Raises:
        ImportError: cvxpy is not installed.
    """
    cp = load_cvxpy("Design by Theorem 7")
    unknowns = _unknowns(cp, problem, gains)
    margin, strict = cp.Variable(), cp.Parameter()
    matrices = [cp.bmat(rows) for rows in inequalities(problem, unknowns, performance).values()]
    unit = np.eye(problem.order)
    constraints = [matrix << -margin * np.eye(matrix.shape[0]) for matrix in matrices]
    constraints += [unknowns.P >> margin * unit, unknowns.Q >> margin * unit]
    if performance:
        question = cp.Problem(cp.Minimize(unknowns.gamma2), [*constraints, margin == strict])
    else:
        question = cp.Problem(cp.Maximize(margin), [*constraints, cp.trace(unknowns.P) == problem.order])
    for status in attempts(cp, question, strict, _ATTEMPTS if performance else _ATTEMPTS[:1]):
        candidate = _candidate(unknowns, gains, status)
        if candidate is not None:
            yield candidate


def _unknowns(cp: Any, problem: Theorem7Problem, gains: Gains | None) -> Unknowns:
    n, vertices = problem.order, range(len(problem.A))
    M = cp.Variable((n, n))
    if gains is None:
        w1 = [cp.Variable((n, len(problem.C1))) for _ in vertices]
        w2 = [cp.Variable((n, len(problem.C2))) if len(problem.C2) else None for _ in vertices]
    else:
        w1, w2 = [M.T @ K for K in gains[0]], [M.T @ K if K.size else None for K in gains[1]]
    shapes = ((n, n), (n, n), (n, n), *(((problem.noises, n),) if problem.noises else ()))
    N = [[cp.Variable(shape) for shape in shapes] for _ in vertices]
    symmetric = {"symmetric": True}
    return Unknowns(
        cp.Variable((n, n), **symmetric), cp.Variable((n, n), **symmetric), M, N, w1, w2, cp.Variable(), cp.Variable()
    )


def _candidate(unknowns: Unknowns, gains: Gains | None, status: str) -> Theorem7Candidate | None:
    M = np.asarray(unknowns.M.value)
    if not np.all(np.isfinite(M)) or np.linalg.cond(M) > 1e14:
        return None
    if gains is None:
        K1 = np.stack([np.linalg.solve(M.T, w.value) for w in unknowns.w1])
        K2 = np.stack([np.zeros((len(M), 0)) if w is None else np.linalg.solve(M.T, w.value) for w in unknowns.w2])
    else:
        K1, K2 = gains
    numbers = Unknowns(
        P=symmetric_value(unknowns.P),
        Q=symmetric_value(unknowns.Q),
        M=M,
        N=[[_value(block) for block in blocks] for blocks in unknowns.N],
        w1=[M.T @ K for K in K1],
        w2=[M.T @ K for K in K2],
        gamma2=float(_value(unknowns.gamma2)),
        inverse_sigma=float(_value(unknowns.inverse_sigma)),
    )
    return Theorem7Candidate(numbers, K1, K2, status)


def _value(variable: Any) -> np.ndarray:
    """Its number, zero for an unknown that appears nowhere."""
    return np.zeros(variable.shape) if variable.value is None else np.asarray(variable.value)
