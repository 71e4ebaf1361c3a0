"""The Lyapunov matrix of an error, and its extreme sizes: what printed bounds are made of. NumPy and SciPy."""

from __future__ import annotations

import numpy as np
import scipy


def lyapunov_matrix(closed: np.ndarray, decrease: float = 1.0) -> np.ndarray | None:
    """P of ``(A - K C)' P + P (A - K C) = -decrease I``, shape (n, n); None where ``A - K C`` is not Hurwitz.

    Args:
        closed: ``A - K C``, shape (n, n) [1/s]. decrease: a positive number [1].
    """
    if np.linalg.eigvals(closed).real.max() >= 0.0:
        return None
    return np.asarray(scipy.linalg.solve_continuous_lyapunov(closed.T, -decrease * np.eye(len(closed))))
