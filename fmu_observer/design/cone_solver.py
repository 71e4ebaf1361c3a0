"""Designs by matrix inequalities: a cone solver proposes numbers, NumPy recomputes them, and only what was recomputed
counts.

The one place where cvxpy, the extra `lmi`, is loaded and run.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from fmu_observer.certificates.bisection import bisected
from plant_models.missing_package import optional_package

Matrix = Any  # a NumPy array, or a solver's expression with the same operators
Rows = list[list[Matrix]]
Attempt = tuple[float, Mapping[str, float]]
Candidate = TypeVar("Candidate")

_ROUNDING = 1e-13  # of the largest number in a matrix: a smaller eigenvalue cannot be distinguished from zero


@dataclass(frozen=True, eq=False)
class RecomputedDesign:
    """Gains with their proof.

    Attributes:
        margins: every inequality recomputed in NumPy, by name; all positive.
        status: what the solver called its result, which is not what was relied on.
    """

    margins: Mapping[str, float]
    status: str

    @property
    def margin(self) -> float:
        """Smallest margin."""
        return min(self.margins.values())

    @property
    def recomputed(self) -> str:
        """Number of inequalities and their smallest margin, in words."""
        return f"{len(self.margins)} inequalities recomputed, smallest margin {self.margin:.2g}."


def load_cvxpy(purpose: str) -> Any:
    """The module cvxpy.

    Args:
        purpose: what needs it, for the message.

    Raises:
        ImportError: it is not installed; the message says how to.
    """
    return optional_package("cvxpy", purpose)  # only who designs pays for it


def solved(cp: Any, question: Any, **settings: float) -> bool:
    """Whether the cone solver left numbers behind; whoever asks recomputes them.

    Args:
        cp: the module cvxpy. question: a problem of it. settings: of the solver.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # "may be inaccurate": every number is checked anyway
        try:
            question.solve(solver="CLARABEL", **settings)
        except cp.error.SolverError:
            return False
    return question.status in ("optimal", "optimal_inaccurate")


def attempts(cp: Any, question: Any, strict: Any, strictness: Iterable[float | Attempt]) -> Iterator[str]:
    """Solve a problem once with every strictness; the unknowns hold the numbers of the attempt while it is yielded.

    Args:
        cp: the module cvxpy. question: a problem of it. strict: its parameter that every inequality is kept by.
        strictness: values of the parameter, each alone or with settings of the solver.

    Yields:
        What the solver calls its result, where it left numbers behind.
    """
    for attempt in strictness:
        strict.value, settings = attempt if isinstance(attempt, tuple) else (attempt, {})
        if solved(cp, question, **settings):
            yield str(question.status)


def symmetric_value(unknown: Any) -> np.ndarray:
    """Numbers of a symmetric unknown, rounding aside, shape (n, n)."""
    return np.asarray(0.5 * (unknown.value + unknown.value.T))


def smallest_eigenvalue(matrix: np.ndarray) -> float:
    """Smallest eigenvalue of the symmetric part, less what rounding and asymmetry may make of it.

    Args:
        matrix: shape (n, n).
    """
    asymmetry = np.abs(matrix - matrix.T).max()
    rounding = len(matrix) * (_ROUNDING * np.abs(matrix).max() + asymmetry)
    return float(np.linalg.eigvalsh(0.5 * (matrix + matrix.T))[0] - rounding)


def first_proven(
    candidates: Iterable[Candidate], margins: Callable[[Candidate], dict[str, float]]
) -> tuple[Candidate, dict[str, float]] | None:
    """The first candidate whose inequalities all hold when recomputed, and their margins; None if there is none.

    Args:
        candidates: what a solver returned. margins: how far each inequality is from failing, recomputed from numbers.
    """
    for candidate in candidates:
        found = margins(candidate)
        if min(found.values()) > 0.0:
            return candidate, found
    return None


def largest_feasible(feasible: Callable[[float], bool], most: float, smallest: float, bisections: int) -> float | None:
    """Largest value up to `most` that is feasible, by so many bisections; None if `smallest` is not."""
    if feasible(most):
        return most
    return bisected(feasible, smallest, most, bisections)[0] if feasible(smallest) else None
