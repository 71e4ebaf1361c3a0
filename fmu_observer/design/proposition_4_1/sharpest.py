"""The matrix of the carried bound: of all that prove the decay of given gains, the one whose bound is the sharpest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Any

import numpy as np

from fmu_observer.design.cone_solver import smallest_eigenvalue
from fmu_observer.design.proposition_4_1.proposition_solver import sharpest


@dataclass(frozen=True, eq=False)
class BoundMatrix:
    """A matrix P with ``P F + F' P + 2 m P < 0``, recomputed.

    Attributes:
        P: shape (n, n), scaled to ``K' P K = 1``. m: decay rate [1/s]. margin: smallest eigenvalue recomputed.
        factor: ``sqrt(C inv(P) C')``, what an error of level 1 may have as its first component.
    """

    P: np.ndarray
    m: float
    margin: float
    factor: float


def bound_matrix(drifts: Any, gain: Sequence[float], m: float) -> BoundMatrix:
    """P for `lyapunov_matrix` of the observers with a held odometer reading [ours].

    A reading that is wrong by g drives the level by ``|K|_P g``, and ``sqrt(C inv(P) C')`` of the level is what a
    bound reports: the product of the two is what it is larger by than it need be, and it is minimised. The overshoot
    beta of Proposition 4-1, the ratio of the axes of P, plays no part in a bound that is carried.

    Args:
        drifts: error matrices ``A - K C``, shape (n, n) or (N, n, n) [1/s]. gain: K, shape (n,).
        m: decay rate, below that of the slowest pole [1/s].

    Returns:
        The matrix; what it proves is recomputed in NumPy.

    Raises:
        ValueError: the decay cannot be proven.
        ImportError: cvxpy (extra `lmi`) is not installed.
    """
    matrices = np.asarray(drifts, dtype=float)
    matrices = matrices[None] if matrices.ndim == 2 else matrices
    K = np.asarray(gain, dtype=float)
    for P, _ in sharpest(matrices, K, m):
        scaled = P / float(K @ P @ K)
        moved = [scaled @ F for F in matrices]
        margin = min(smallest_eigenvalue(scaled), *(smallest_eigenvalue(-(F + F.T) - 2.0 * m * scaled) for F in moved))
        if margin > 0.0:
            return BoundMatrix(scaled, m, margin, sqrt(float(np.linalg.inv(scaled)[0, 0])))
    slowest = -max(float(np.linalg.eigvals(F).real.max()) for F in matrices)
    raise ValueError(
        f"Bound matrix: a decay of {m:g} 1/s cannot be proven for these gains; the slowest pole decays with "
        f"{slowest:.4g} 1/s, so ask for less than that."
    )
