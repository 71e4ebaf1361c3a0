"""Every inequality of Proposition 4-1 recomputed in NumPy from the numbers a solver returned. Plain NumPy."""

from __future__ import annotations

import numpy as np

from fmu_observer.design.proposition_4_1.proposition_inequalities import SCALE, Proposition41Problem, inequalities

ROUNDING = 1e-13  # of the largest number in a matrix: an eigenvalue smaller than this is not told from zero


def margins(problem: Proposition41Problem, P: np.ndarray, gains: np.ndarray) -> dict[str, float]:
    """How far every inequality is from failing: the smallest eigenvalue of what must be positive, less rounding.

    Args:
        problem: the question. P: shape (n, n). gains: K of each vertex, shape (N, n).

    Returns:
        By name; all positive exactly when the numbers prove what was asked. Of (4.44) only that P is positive definite
        is asked, for beta follows from the eigenvalues of P as they are.
    """
    M = [(P @ K)[:, None] for K in gains]
    found = {
        name: smallest_eigenvalue(np.block(rows))
        for name, (_, rows) in inequalities(problem, P, M, problem.alpha).items()
    }
    return found | {SCALE: smallest_eigenvalue(P)}


def smallest_eigenvalue(matrix: np.ndarray) -> float:
    """Smallest eigenvalue of the symmetric part, less what rounding and asymmetry may make of it.

    Args:
        matrix: shape (n, n).
    """
    asymmetry = np.abs(matrix - matrix.T).max()
    rounding = len(matrix) * (ROUNDING * np.abs(matrix).max() + asymmetry)
    return float(np.linalg.eigvalsh(0.5 * (matrix + matrix.T))[0] - rounding)
