"""The sufficient bounds of high-gain observers at samples by Hann 2014, as printed and as their proofs need them. Plain
NumPy and SciPy.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, sqrt

import numpy as np
import scipy

from fmu_observer.certificates.lyapunov import lyapunov_matrix


@dataclass(frozen=True)
class DynamicThetaBounds:
    """What Theorem 3.1 says of a shape K and a Lipschitz constant.

    Attributes:
        mu, smallest: of (3.6) with P scaled to ``lmax(P) = 1`` as (3.35) asks.
        b: smallest factor of (3.47), at least 1.
        theta_limit: what theta tends to by (3.7) [1/s]. theta_rate: ``mu/(6 b)`` of the same law [1].
        longest_gap: tau_MASP by (3.8), at the theta asked for [s].
    """

    mu: float
    smallest: float
    b: float
    theta_limit: float
    theta_rate: float
    longest_gap: float


@dataclass(frozen=True)
class DecayBounds:
    """What Theorem 3.4 says of a shape K, theta, eta and a Lipschitz constant.

    Attributes:
        printed_smallest_theta: ``theta_0 = 4 sqrt(n) L |P| / mu`` [1/s].
        smallest_theta: the same with the factor ``lmax(P)/lmin(P)`` that (3.88)-(3.89) need [1/s].
        alpha, beta: decay rate and gain of the Lyapunov function, (3.90).
        longest_gap: tau_MASP by (3.109), for an error that is only just stable [s].
        speed: what multiplies the gap in (3.105), ``theta + L + theta |K| + eta`` [1/s].
    """

    printed_smallest_theta: float
    smallest_theta: float
    alpha: float
    beta: float
    longest_gap: float
    speed: float

    def small_gain(self, gap: float, sigma: float) -> float:
        """Gain of the loop by (3.105), below 1 where the error falls by ``exp(-sigma t)``.

        (3.109) leaves the factor ``exp(sigma gap)`` out.

        Args:
            gap: longest gap [s]. sigma: rate asked for, below alpha / 2 [1/s].
        """
        return gap * float(np.exp(sigma * gap)) / self.longest_gap if self.longest_gap > 0.0 else inf

    def strict_gap(self, sigma: float) -> float:
        """Gap at which (3.105) is 1, its factor ``exp(sigma gap)`` kept [s].

        Args:
            sigma: rate asked for, below alpha / 2 [1/s]; 0 gives (3.109).
        """
        return float(scipy.special.lambertw(sigma * self.longest_gap).real) / sigma if sigma > 0.0 else self.longest_gap


def dynamic_theta_bounds(
    A: np.ndarray, K: np.ndarray, C: np.ndarray, lipschitz: float, theta_max: float
) -> DynamicThetaBounds:
    """Bounds of Hann 2014, Theorem 3.1.

    Args:
        A: block shift matrix, shape (n, n). K: shape (n, q). C: shape (q, n).
        lipschitz: constant L of the nonlinear remainder [1/s]. theta_max: largest theta of the run [1/s].

    Returns:
        The bounds; where ``A - K C`` is not Hurwitz theta has no limit (inf) and no gap is short enough (0).
    """
    P = lyapunov_matrix(A - K @ C)
    if P is None or not np.isfinite(lipschitz):
        return DynamicThetaBounds(np.nan, np.nan, np.nan, inf, 0.0, 0.0)
    values = np.linalg.eigvalsh(P)
    n, mu, smallest = len(A), 1.0 / float(values[-1]), float(values[0] / values[-1])
    levels = np.diag((np.arange(n) // len(C)).astype(float))
    b = max(1.0, float(np.abs(scipy.linalg.eigh(P @ levels + levels @ P, P, eigvals_only=True)).max()))
    bracket = (2.0 * sqrt(n) * lipschitz + 1.0) / smallest
    size = sqrt(2.0 * theta_max) * float(np.linalg.norm(K, 2)) * (theta_max + sqrt(n) * lipschitz)
    longest = sqrt(mu * smallest) / size if size > 0.0 else inf
    return DynamicThetaBounds(mu, smallest, b, 1.0 + 6.0 * bracket / mu, mu / (6.0 * b), longest)


def decay_bounds(
    A: np.ndarray, K: np.ndarray, C: np.ndarray, theta: float, decay_rate: float, lipschitz: float
) -> DecayBounds:
    """Bounds of Hann 2014, Theorem 3.4.

    Args:
        A: block shift matrix, shape (n, n). K: shape (n, q). C: shape (q, n). theta: [1/s]. decay_rate: eta [1/s].
        lipschitz: constant L of the nonlinear remainder [1/s].

    Returns:
        The bounds; where ``A - K C`` is not Hurwitz no theta is large enough (inf) and no gap short enough (0).
    """
    P = lyapunov_matrix(A - K @ C)
    if P is None:
        return DecayBounds(inf, inf, 0.0, inf, 0.0, inf)
    values = np.linalg.eigvalsh(P)
    smallest, largest = float(values[0]), float(values[-1])
    printed = 4.0 * sqrt(len(A)) * lipschitz * largest
    alpha, beta = theta / (4.0 * largest), theta * float(np.linalg.norm(P @ K, 2)) / sqrt(smallest)
    speed = theta + lipschitz + theta * float(np.linalg.norm(K, 2)) + decay_rate
    longest = alpha * sqrt(smallest) / (2.0 * beta * speed) if beta * speed > 0.0 else inf
    return DecayBounds(printed, printed * largest / smallest, alpha, beta, longest, speed)
