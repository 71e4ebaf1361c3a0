"""Covariances as states: flat and as matrix, prediction, correction in Joseph form. Pure functions that trace."""

from __future__ import annotations

import numpy as np

from plant_models.hybrid.system import Array


def flattened(matrix: Array) -> list[Array]:
    """Entries row by row, as scalars.

    Args:
        matrix: shape (n, n).
    """
    rows, columns = matrix.shape
    return [matrix[i, j] for i in range(rows) for j in range(columns)]


def predicted(P: Array, F: Array, QN: Array) -> Array:
    """``F P F' + QN``, shape (n, n)."""
    return F @ P @ F.T + QN


def corrected(x: Array, P: Array, innovation: Array, C: np.ndarray, RN: Array) -> tuple[Array, Array]:
    """Estimate and covariance after a measurement.

    The Joseph form ``(I - K C) P (I - K C)' + K RN K'`` stays symmetric and positive for any rounding of the gain.

    Args:
        x: prediction, shape (n,). P: its covariance, shape (n, n). innovation: ``y - C x``, shape (q,). C: shape (q,
            n).
        RN: covariance of the measurements, shape (q, q).

    Returns:
        Estimate of shape (n,) and covariance of shape (n, n), exactly symmetric.
    """
    spread = C @ P
    K = np.linalg.solve(spread @ C.T + RN, spread).T
    rest = np.eye(C.shape[1]) - K @ C
    joseph = rest @ P @ rest.T + K @ RN @ K.T
    return x + K @ innovation, 0.5 * (joseph + joseph.T)
