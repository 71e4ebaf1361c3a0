"""Proposition 4-1 as a design tool: gains for a decay and a size of the gain with the least overshoot, or the least
overshoot of given gains, checked in NumPy.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import inf, sqrt
from typing import Any

import numpy as np

from fmu_observer.design.cone_solver import RecomputedDesign, first_proven, largest_feasible
from fmu_observer.design.proposition_4_1.proposition_inequalities import DECAY, GAIN, Proposition41Problem, margins
from fmu_observer.design.proposition_4_1.proposition_solver import Proposition41Candidate, least_alphas, least_condition

_BISECTIONS = 14
_SMALLEST = 1e-3  # of the decay asked for: below it nothing is called feasible


@dataclass(frozen=True, eq=False)
class Proposition41Design(RecomputedDesign):
    """Gains with their proof.

    Attributes:
        m: decay rate of the error, eps / 2 [1/s]. alpha: bound of ``K' P K`` asked for; inf where none was.
        beta: ``sqrt(lambda_2 / lambda_1)``, overshoot of ``|exp((A - K C) t)| <= beta exp(-m t)`` [1].
        gains: K of each vertex, shape (N, n). P: shape (n, n), its smallest eigenvalue 1.
    """

    m: float
    alpha: float
    beta: float
    gains: np.ndarray
    P: np.ndarray

    @property
    def gain_norm(self) -> float:
        """Largest Euclidean norm of K [1/s]."""
        return float(np.linalg.norm(self.gains, axis=1).max())

    def explain(self) -> str:
        """One sentence for the user, numbers included."""
        asked = "any gain" if self.alpha == inf else f"alpha = {self.alpha:g}"
        gains = "; ".join(" ".join(f"{k:.4g}" for k in K) for K in self.gains)
        return (
            f"Proposition 4-1 holds for m = {self.m:g} 1/s and {asked}: beta = {self.beta:.5g}, K = [{gains}]; "
            f"{self.recomputed}"
        )


class InfeasibleBounds(ValueError):  # noqa: N818 - what it is, not an "Error" of the program
    """Proposition 4-1 has no solution for what was asked.

    Args:
        message: what was tried, which inequality cannot be kept, and what can.

    Attributes:
        constraint: name of the inequality that cannot be kept.
        nearest_alpha: least alpha at the decay asked for; None where no alpha helps.
        nearest_m: largest decay at the alpha asked for [1/s]; None where none was found.
    """

    def __init__(self, message: str, constraint: str, nearest_alpha: float | None, nearest_m: float | None) -> None:
        super().__init__(message)
        self.constraint, self.nearest_alpha, self.nearest_m = constraint, nearest_alpha, nearest_m


def design_proposition_4_1(
    A: Any, C: Any, m: float, alpha: float | None = None, *, gains: Any = None
) -> Proposition41Design:
    """Gains with the least overshoot beta, or the least beta of given gains: Aguiar Cota 2019, Proposition 4-1.

    The print minimises ``lambda_2 - lambda_1``, which has no minimum; ``lambda_1 >= 1`` is added.

    Args:
        A: shape (n, n), or vertices of shape (N, n, n) [1/s]; `train_vertices` for the train.
        C: one measurement, shape (n,).
        m: decay rate asked for, eps / 2 in the print [1/s].
        alpha: bound of ``K' P K`` with ``P >= I``, and so of ``|K|^2``; None leaves (4.42) out.
        gains: shape (n,), or (N, n), to analyse; None to seek them.

    Returns:
        The design; every inequality recomputed with the returned gains. Where alpha is not binding the gains are not
        unique: compare designs by beta.

    Raises:
        InfeasibleBounds: there is no solution; the message says which inequality cannot be kept, the least alpha and
            the largest m that can.
        ValueError: an argument is not legal.
        ImportError: cvxpy (extra `lmi`) is not installed.
    """
    problem = Proposition41Problem.of(A, C, m, alpha)
    kept = None if gains is None else _checked_gains(problem, gains)
    found = first_proven(least_condition(problem, kept), lambda found: margins(problem, found.P, found.gains))
    if found is None:
        raise _infeasible(problem, kept)
    return _designed(problem, *found)


def _designed(
    problem: Proposition41Problem, candidate: Proposition41Candidate, proof: dict[str, float]
) -> Proposition41Design:
    smallest, *_, largest = np.linalg.eigvalsh(candidate.P)
    return Proposition41Design(
        m=problem.m,
        alpha=inf if problem.alpha is None else problem.alpha,
        beta=sqrt(float(largest / smallest)),
        gains=candidate.gains,
        P=candidate.P / smallest,
        margins=proof,
        status=candidate.status,
    )


def _checked_gains(problem: Proposition41Problem, gains: Any) -> np.ndarray:
    values = np.asarray(gains, dtype=float)
    shape = (len(problem.A), problem.order)
    if values.shape not in ((problem.order,), shape) or not np.all(np.isfinite(values)):
        raise ValueError(
            f"Proposition 4-1: gains need {problem.order} finite numbers, or so many for each of {shape[0]} vertices; "
            f"got shape {values.shape}."
        )
    return np.broadcast_to(values, shape)


def _smallest_alphas(problem: Proposition41Problem, gains: np.ndarray | None) -> Callable[[float], float | None]:
    """The least alpha by the decay, checked."""
    candidates = least_alphas(problem, gains)

    def of_decay(m: float) -> float | None:
        found = first_proven(
            candidates(m), lambda one: margins(replace(problem, m=m, alpha=one.value), one.P, one.gains)
        )
        return None if found is None else found[0].value

    return of_decay


def _largest_decay(problem: Proposition41Problem, gains: np.ndarray | None) -> float | None:
    smallest_alpha_of = _smallest_alphas(problem, gains)

    def feasible(m: float) -> bool:
        least = smallest_alpha_of(m)
        return least is not None and (problem.alpha is None or least <= problem.alpha)

    return largest_feasible(feasible, problem.m, _SMALLEST * problem.m, _BISECTIONS)


def _infeasible(problem: Proposition41Problem, gains: np.ndarray | None) -> InfeasibleBounds:
    alpha, m = _smallest_alphas(problem, gains)(problem.m), _largest_decay(problem, gains)
    asked = "" if problem.alpha is None else f" and alpha = {problem.alpha:g}"
    of = "free gains" if gains is None else "the gains given"
    text = f"Proposition 4-1 has no solution for m = {problem.m:g} 1/s{asked} with {of}"
    slower = f"no decay was found down to {_SMALLEST * problem.m:.3g} 1/s" if m is None else f"m = {m:.4g} 1/s at most"
    at = "" if problem.alpha is None else " at this alpha"
    if alpha is None:
        why = f"the error cannot decay so fast, {DECAY}"
        if gains is None:
            why += ", whatever the gain: a mode that the measurement does not show is slower"
        return InfeasibleBounds(f"{text}: {why}. Feasible: {slower}{at}.", DECAY, None, m)
    why = f"the gain would have to be larger than alpha allows, {GAIN}"
    near = f"alpha = {alpha:.4g} at least at this m; {slower}{at}"
    return InfeasibleBounds(f"{text}: {why}. Feasible: {near}.", GAIN, alpha, m)
