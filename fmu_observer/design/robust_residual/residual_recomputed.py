"""The inequalities of a robust residual recomputed in NumPy from the numbers a solver returned."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fmu_observer.design.robust_residual.residual_inequalities import Rows

ROUNDING = 1e-13  # of the largest number in a matrix: an eigenvalue smaller than this is not told from zero


def margins(blocks: Mapping[str, Rows]) -> dict[str, float]:
    """How far each inequality is from failing: the smallest eigenvalue of its negative, less rounding.

    Args:
        blocks: numbers by name, each to be negative.

    Returns:
        Margins by name; all positive exactly when the numbers prove what was asked.
    """
    return {name: least(-np.block(rows)) for name, rows in blocks.items()}


def least(matrix: np.ndarray) -> float:
    """Smallest eigenvalue of a symmetric matrix, less what rounding and asymmetry may hide.

    Args:
        matrix: shape (n, n).
    """
    rounding = len(matrix) * (ROUNDING * np.abs(matrix).max() + np.abs(matrix - matrix.T).max())
    return float(np.linalg.eigvalsh(0.5 * (matrix + matrix.T))[0] - rounding)
