"""Model matrices and gain design of the discrete unknown-input observer. Plain NumPy and SciPy, no hybrid system.

The observer itself needs none of this at run time: its gains are parameters, and these functions say where their start
values come from and give new ones for other sampling periods.
"""

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


def process_covariance(A: np.ndarray, density: np.ndarray, period: float) -> np.ndarray:
    """Covariance that white noise leaves in ``dx = A x + w`` over one period (Van Loan, IEEE TAC 23 (1978) 395).

    Args:
        A: shape (n, n). density: spectral density of w, shape (n, n) [x2/s]. period: [s].

    Returns:
        ``integral of exp(A s) density exp(A' s) from 0 to period``, shape (n, n), symmetric.
    """
    n = len(A)
    block = np.zeros((2 * n, 2 * n))
    block[:n, :n], block[:n, n:], block[n:, n:] = -A, density, A.T
    exponential = scipy.linalg.expm(block * period)
    covariance = exponential[n:, n:].T @ exponential[:n, n:]
    return np.asarray(0.5 * (covariance + covariance.T))
