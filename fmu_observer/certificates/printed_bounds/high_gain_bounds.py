"""The printed bounds of the high-gain observer at samples: how large theta must be, how short the gaps. Plain NumPy and
SciPy.

They are sufficient and very conservative: the exact limits are those of `fmu_observer.certificates`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fmu_observer.certificates.lyapunov import lyapunov_matrix


@dataclass(frozen=True)
class HighGainBounds:
    """What (1.51) and (1.52) ask for.

    Attributes:
        mu: decrease in ``(A - K C)' P + P (A - K C) = -2 mu I`` [1].
        largest, smallest: eigenvalues of P [1]; nan where ``A - K C`` is not Hurwitz and there is no P.
        smallest_theta: (1.51) [1/s]. longest_gap: (1.52) at the theta in use [s].
    """

    mu: float
    largest: float
    smallest: float
    smallest_theta: float
    longest_gap: float


def high_gain_bounds(
    A: np.ndarray, K: np.ndarray, C: np.ndarray, theta: float, lipschitz: float, mu: float = 1.0
) -> HighGainBounds:
    """Bounds of Bouchama 2024, (1.51) and (1.52), by ``(A - K C)' P + P (A - K C) = -2 mu I`` (1.50).

    ``theta >= 2 L sqrt(n) lmax(P) / mu``, and ``2 tau (L + theta) |K| lmax(P)^(3/2) / (mu lmin(P)^(1/2)) <= 1``.

    Args:
        A: block shift matrix, shape (n, n). K: shape (n, q). C: shape (q, n).
        theta: gain in use [1/s]. lipschitz: constant L of the nonlinear remainder [1/s]. mu: any positive number; it
            cancels.

    Returns:
        The bounds; where ``A - K C`` is not Hurwitz no theta is large enough (inf) and no gap short enough (0).
    """
    P = lyapunov_matrix(A - K @ C, 2.0 * mu)
    if P is None:
        return HighGainBounds(mu, np.nan, np.nan, np.inf, 0.0)
    eigenvalues = np.linalg.eigvalsh(P)
    smallest, largest = float(eigenvalues[0]), float(eigenvalues[-1])
    slope = (lipschitz + theta) * float(np.linalg.norm(K, 2))
    return HighGainBounds(
        mu=mu,
        largest=largest,
        smallest=smallest,
        smallest_theta=2.0 * lipschitz * float(np.sqrt(len(A))) * largest / mu,
        longest_gap=mu * float(np.sqrt(smallest / largest)) / (2.0 * slope * largest) if slope > 0.0 else float("inf"),
    )
