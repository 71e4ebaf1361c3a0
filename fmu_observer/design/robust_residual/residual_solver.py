"""The inequalities handed to a cone solver. What comes back is only a candidate; `margins` decides."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from math import sqrt
from typing import Any, Literal, NamedTuple

import numpy as np

from fmu_observer.design.cone_solver import Rows, attempts, load_cvxpy, symmetric_value
from fmu_observer.design.robust_residual.problem import ResidualProblem
from fmu_observer.design.robust_residual.residual_inequalities import robustness, sensitivity

_Least = Literal["attenuation", "alpha"]

_STRICT = (1e-7, 1e-6, 1e-5, 1e-4)  # asked of every inequality in the scaled problem, one attempt after the other


@dataclass(frozen=True, eq=False)
class ResidualCandidate:
    """What the solver returned, in the units of the problem.

    Attributes:
        P: shape (n, n). gains: K_i, shape (N, n, q). attenuation: lambda. alpha: bound of the gains. status: the
            solver's word for it.
    """

    P: np.ndarray
    gains: np.ndarray
    attenuation: float
    alpha: float
    status: str


def candidates(
    problem: ResidualProblem,
    least: _Least = "attenuation",
    gains: np.ndarray | None = None,
    attenuation: float | None = None,
    sized: bool = True,
) -> Iterator[ResidualCandidate]:
    """Seek values for the unknowns of (3.56) and (3.58).

    Args:
        problem: the question. least: what is minimised, lambda or the bound alpha, which then is no condition.
        gains: K_i of shape (N, n, q) to keep; None to seek them.
        attenuation: lambda at most; None for no limit. sized: with (3.58); False leaves the size of the gains free.

    Yields:
        What the solver returned, where it is usable, once with each strictness.

    Raises:
        ImportError: cvxpy is not installed.
    """
    cp = load_cvxpy("Design of a robust residual")
    M, size = problem.residual_gain, float(np.linalg.norm(problem.disturbance, 2))
    scaled = replace(problem, disturbance=problem.disturbance / size, residual_gain=1.0)
    x = _unknowns(cp, problem, gains)
    constraints = _negative(cp, robustness(scaled, x.P, x.L, x.lambda2, x.alpha, sized), x.strict)
    constraints.append(x.P >> x.strict * np.eye(problem.order))
    if least != "alpha":
        constraints.append(x.alpha == problem.alpha / M**2)
    if attenuation is not None:
        constraints.append(x.lambda2 <= (attenuation / (M * size)) ** 2)
    question = cp.Problem(cp.Minimize(x.lambda2 if least == "attenuation" else x.alpha), constraints)
    for status in attempts(cp, question, x.strict, _STRICT):
        P = symmetric_value(x.P)
        if np.all(np.isfinite(P)) and np.linalg.eigvalsh(P)[0] > 0.0:
            yield _candidate(P, x, gains, (M, size), status)


class _Unknowns(NamedTuple):
    """Unknowns of (3.56) and (3.58), and what every inequality is kept by.

    In the scaled problem M and the size of D are 1: P, L and alpha are divided by M^2, lambda by M and that size.
    """

    P: Any
    L: list[Any]
    lambda2: Any
    alpha: Any
    strict: Any


def _unknowns(cp: Any, problem: ResidualProblem, gains: np.ndarray | None) -> _Unknowns:
    n, q = problem.order, len(problem.C)
    P, lambda2, alpha = cp.Variable((n, n), symmetric=True), cp.Variable(), cp.Variable()
    L = [cp.Variable((n, q)) for _ in problem.vertices] if gains is None else [P @ K for K in gains]
    return _Unknowns(P, L, lambda2, alpha, cp.Parameter(nonneg=True))


def _candidate(
    P: np.ndarray, x: _Unknowns, gains: np.ndarray | None, sizes: tuple[float, float], status: str
) -> ResidualCandidate:
    """Numbers in the units of the problem; `sizes` are M and that of D."""
    M, size = sizes
    found = np.stack([np.linalg.solve(P, part.value) for part in x.L]) if gains is None else gains
    attenuation = M * size * sqrt(float(x.lambda2.value))
    return ResidualCandidate(P * M**2, found, attenuation, float(x.alpha.value) * M**2, status)


def sensitivity_candidates(problem: ResidualProblem, gains: np.ndarray) -> Iterator[tuple[np.ndarray, float]]:
    """Seek P_f of (3.57) with the largest gamma, for fixed gains.

    Args:
        problem: the question. gains: K_i, shape (N, n, q).

    Yields:
        P_f of shape (n, n) and gamma squared, in the units of the problem.

    Raises:
        ImportError: cvxpy is not installed.
    """
    cp = load_cvxpy("Design of a robust residual")
    scaled = replace(problem, residual_gain=1.0)
    P, gamma2 = cp.Variable((problem.order, problem.order), symmetric=True), cp.Variable()
    strict = cp.Parameter(nonneg=True)
    question = cp.Problem(cp.Maximize(gamma2), _negative(cp, sensitivity(scaled, gains, P, gamma2), strict))
    weight = problem.residual_gain**2
    for _ in attempts(cp, question, strict, (0.0, *_STRICT)):
        if np.all(np.isfinite(P.value)):
            yield 0.5 * weight * (P.value + P.value.T), float(gamma2.value) * weight


def _negative(cp: Any, blocks: Mapping[str, Rows], strict: Any) -> list[Any]:
    """Every block negative definite, by `strict`."""
    matrices = [cp.bmat(rows) for rows in blocks.values()]
    return [matrix + matrix.T << -2.0 * strict * np.eye(matrix.shape[0]) for matrix in matrices]
