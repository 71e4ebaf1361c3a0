"""Model matrices of the discrete unknown-input observer and their discretisation. Plain NumPy and SciPy."""

from __future__ import annotations

import numpy as np
import scipy


def uio_matrices(mass: float, drag_slope: float) -> tuple[np.ndarray, np.ndarray]:
    """Continuous model of (3.88)-(3.89) with the slip disturbance in the right column of the second row.

    State ``[p, y, d1, d2, d1', d2']``: position, odometer speed, slip speed ``v - y``, acceleration disturbance, and
    their rates. The print has the 1 of row 2 in column 3; with it in column 4 the printed A_d, B_d come out and the
    pair is observable.

    Args:
        mass: train mass [kg]. drag_slope: ``(b + c v) / M`` at the speed of linearisation [1/s].

    Returns:
        A of shape (6, 6) and B of shape (6,), input in newtons.
    """
    A = np.zeros((6, 6))
    A[0, 1] = A[0, 2] = A[1, 3] = A[2, 4] = A[3, 5] = 1.0
    A[1, 1] = -drag_slope
    B = np.zeros(6)
    B[1] = 1.0 / mass
    return A, B


def discretise(A: np.ndarray, B: np.ndarray, period: float) -> tuple[np.ndarray, np.ndarray]:
    """Zero-order-hold discretisation: ``A_d`` of shape (n, n) and ``B_d`` of shape (n,) for a period [s].

    Args:
        A: shape (n, n). B: shape (n, m).
    """
    n = len(B)
    block = np.zeros((n + 1, n + 1))
    block[:n, :n], block[:n, n] = A, B
    exponential = scipy.linalg.expm(block * period)
    return exponential[:n, :n], exponential[:n, n]
