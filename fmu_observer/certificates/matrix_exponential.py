"""Matrix exponential of small matrices by matrix products alone.

Certificates need hundreds of exponentials of 3 by 3 matrices. SciPy's goes through threaded LAPACK, which on a busy
machine costs milliseconds a call whatever the size; products of small matrices do not.
"""

from __future__ import annotations

from math import ceil, log2

import numpy as np

_TAYLOR_DEGREE = 16  # remainder 0.5^17 / 17! = 2e-20 at the norm the scaling leaves
_SCALED_NORM = 0.5


def small_exponential(matrix: np.ndarray) -> np.ndarray:
    """``exp(matrix)`` by scaling, Taylor polynomial and squaring.

    Args:
        matrix: shape (n, n), n small.

    Returns:
        The exponential, shape (n, n), to about ``norm(matrix)`` roundings.
    """
    norm = float(np.abs(matrix).sum(axis=0).max())
    squarings = max(0, ceil(log2(norm / _SCALED_NORM))) if norm > 0.0 else 0
    scaled = matrix / 2.0**squarings
    identity = np.eye(len(matrix))
    result = identity
    for k in range(_TAYLOR_DEGREE, 0, -1):
        result = identity + scaled @ result / k
    with np.errstate(over="ignore", invalid="ignore"):  # an unstable error may leave the range of numbers
        for _ in range(squarings):
            result = result @ result
    return np.asarray(result)
