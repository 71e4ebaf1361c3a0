"""From continuous noise to the covariance of one sampling period. Plain NumPy and SciPy."""

from __future__ import annotations

import numpy as np
import scipy


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
