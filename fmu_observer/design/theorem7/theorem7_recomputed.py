"""Every inequality of Theorem 7 recomputed in NumPy from the numbers a solver returned. Plain NumPy."""

from __future__ import annotations

import numpy as np

from fmu_observer.design.theorem7.theorem7_inequalities import Theorem7Problem, Unknowns, inequalities

ROUNDING = 1e-13  # of the largest number in a matrix: an eigenvalue smaller than this is not told from zero


def margins(problem: Theorem7Problem, unknowns: Unknowns, performance: bool) -> dict[str, float]:
    """How far every inequality is from failing, by name: the smallest eigenvalue of what must be positive, less
    rounding.

    Args:
        problem: the question. unknowns: numbers. performance: as in `inequalities`.

    Returns:
        Margins; all positive exactly when the numbers prove what was asked.
    """
    found = {"P": _smallest_eigenvalue(unknowns.P), "Q": _smallest_eigenvalue(unknowns.Q)}
    if problem.mu > 0.0:
        found["sigma_1"] = float(unknowns.inverse_sigma)
    if performance:
        found["gamma squared"] = float(unknowns.gamma2)
    for name, rows in inequalities(problem, unknowns, performance).items():
        found[name] = _smallest_eigenvalue(-np.block(rows))
    return found


def _smallest_eigenvalue(matrix: np.ndarray) -> float:
    asymmetry = np.abs(matrix - matrix.T).max()
    rounding = len(matrix) * (ROUNDING * np.abs(matrix).max() + asymmetry)
    return float(np.linalg.eigvalsh(0.5 * (matrix + matrix.T))[0] - rounding)
