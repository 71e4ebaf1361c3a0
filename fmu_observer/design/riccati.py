"""The steady state of a Kalman filter, and whether there is one. Plain NumPy and SciPy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy


@dataclass(frozen=True)
class SteadyFilter:
    """Steady state of the filter ``x+ = A x + w``, ``y = C x + v``.

    Attributes:
        gain: filter gain K of ``xh(k|k) = xh(k|k-1) + K (y - C xh(k|k-1))``, shape (n, q).
        predicted: covariance P(k|k-1), shape (n, n). updated: P(k|k), shape (n, n).
        spectral_radius: of ``A (I - K C)`` [1].
    """

    gain: np.ndarray
    predicted: np.ndarray
    updated: np.ndarray
    spectral_radius: float


def steady_filter(A: np.ndarray, C: np.ndarray, QN: np.ndarray, RN: np.ndarray) -> SteadyFilter | None:
    """Solve the discrete Riccati equation of the filter.

    Args:
        A: shape (n, n). C: shape (q, n). QN: process covariance of one period, shape (n, n). RN: measurement
            covariance, shape (q, q).

    Returns:
        The steady state; None when there is no stabilising solution (a mode on or outside the unit circle that C does
        not see, or a mode on the circle that the process noise does not drive).
    """
    try:
        P = scipy.linalg.solve_discrete_are(A.T, C.T, QN, RN)
    except (np.linalg.LinAlgError, ValueError):
        return None
    gain = np.linalg.solve(C @ P @ C.T + RN, C @ P).T
    rest = np.eye(len(A)) - gain @ C
    radius = float(np.abs(np.linalg.eigvals(A @ rest)).max())
    return SteadyFilter(gain, P, rest @ P, radius) if radius < 1.0 else None
