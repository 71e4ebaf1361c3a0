"""The sufficient bounds printed for high-gain observers at samples, beside the exact limits. Plain NumPy and the
certificates.

The printed bounds are correct and far too small to design with: they are here so that a reader can see by how much.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np
import scipy

from fmu_observer.certificates.aperiodic import certify_sampled_error
from fmu_observer.certificates.gap_finding import CONSTANT_GAP
from fmu_observer.certificates.printed_bounds.high_gain_bounds import HighGainBounds, high_gain_bounds
from fmu_observer.certificates.sampled_error import SampledError
from fmu_observer.models.observer_model import shift_matrix

_SHAPE = (2.0, 1.0)  # K of the train observers, Bouchama 2024, (3.29)
_THETAS = (1.0, 2.0, 4.0, 5.0, 8.0)  # [1/s], those of the table


@dataclass(frozen=True)
class DesignBoundRow:
    """One line of the table of bounds: the longest gap each formula allows at one gain.

    Attributes:
        theta: high gain [1/s]. by_1_52, by_3_32, by_3_67, by_3_87: longest gap by that formula [s]; negative where the
            gain is too small for the formula.
        constant: first unstable constant gap, exact [s]. aperiodic: longest gap certified for every mixture of gaps
        [s].
    """

    theta: float
    by_1_52: float
    by_3_32: float
    by_3_67: float
    by_3_87: float
    constant: float
    aperiodic: float


def lipschitz_constant(mass: float, davis_b: float, davis_c: float, top_speed: float) -> float:
    """Lipschitz constant ``(b + 2 c v_max) / M`` of the running resistance [1/s]: beta of Bouchama 2024, (3.31).

    Args:
        mass: [kg]. davis_b: [N.s/m]. davis_c: [N.s2/m2]. top_speed: speed up to which it holds [m/s].
    """
    return (davis_b + 2.0 * davis_c * top_speed) / mass


def gain_matrix(n: int = 2) -> np.ndarray:
    """P with ``P + A' P + P A = C' C``, A the shift matrix, of which ``K = inv(P) C'``: Bouchama 2024, (3.29),
    repaired.

    The print has ``A - K C`` in place of A, which makes P negative definite.

    Args:
        n: order.

    Returns:
        P of shape (n, n).
    """
    measured = np.zeros((n, n))
    measured[0, 0] = 1.0
    return np.asarray(scipy.linalg.solve_continuous_lyapunov((shift_matrix(n) + 0.5 * np.eye(n)).T, measured))


def smallest_theta_1_51(lipschitz: float, K: Sequence[float] = _SHAPE, mu: float = 1.0) -> float:
    """``theta >= 2 L sqrt(n) lambda_max(P) / mu`` [1/s], Bouchama 2024, (1.51); see `high_gain_bounds`.

    Args:
        lipschitz: L [1/s]. K: shape (n,). mu: decay [1]; the bound does not depend on it.
    """
    return _bounds(1.0, lipschitz, K, mu).smallest_theta


def longest_gap_1_52(theta: float, lipschitz: float, K: Sequence[float] = _SHAPE, mu: float = 1.0) -> float:
    """tau [s] with ``2 tau (L + theta) |K| lambda_max^1.5 / (mu lambda_min^0.5) = 1``: Bouchama 2024, (1.52).

    Args:
        theta: high gain [1/s]. lipschitz: L [1/s]. K: shape (n,). mu: decay [1].
    """
    return _bounds(theta, lipschitz, K, mu).longest_gap


def smallest_theta_3_31(lipschitz: float) -> float:
    """``theta >= sqrt(2 beta)`` [1/s], Bouchama 2024, (3.31).

    Args:
        lipschitz: beta [1/s].
    """
    return sqrt(2.0 * lipschitz)


def longest_gap_3_32(theta: float, lipschitz: float) -> float:
    """``(theta - 2 beta/theta) / (2 sqrt(5) theta^2 sqrt(lambda_max/lambda_min))`` [s], Bouchama 2024, (3.32).

    The eigenvalues are those of `gain_matrix`, and ``sqrt(5) = |K|`` of K = (2, 1). Negative below
    `smallest_theta_3_31`.

    Args:
        theta: high gain [1/s]. lipschitz: beta [1/s].
    """
    return longest_gap_3_87(theta, lipschitz)


def longest_gap_3_67(theta: float, lipschitz: float = 0.0) -> float:
    """``(theta - 2 beta/theta) / (2 theta (theta + beta) |K| sqrt(lambda_max/lambda_min))`` [s], Bouchama 2024, (3.67).

    The bound of the wheel stage. Its beta is undefined in print; the equations give 0, for the stage has no nonlinear
    term.

    Args:
        theta: high gain [1/s]. lipschitz: beta [1/s].
    """
    return (theta - 2.0 * lipschitz / theta) / (2.0 * theta * (theta + lipschitz) * _gain_size())


def longest_gap_3_87(theta: float, lipschitz: float) -> float:
    """``(theta - 2 beta/theta) / (2 theta^2 |K| sqrt(lambda_max/lambda_min))`` [s], Bouchama 2024, (3.87): (3.32) once
    more.

    Args:
        theta: high gain [1/s]. lipschitz: beta [1/s].
    """
    return (theta - 2.0 * lipschitz / theta) / (2.0 * theta**2 * _gain_size())


def bound_table(thetas: Sequence[float] = _THETAS, lipschitz: float = 0.0) -> tuple[DesignBoundRow, ...]:
    """Printed bounds beside the exact limits of the double integrator with K = (2, 1).

    Args:
        thetas: high gains [1/s], positive. lipschitz: Lipschitz constant of the resistance [1/s], in the formulas and
            as a drag slope between 0 and it in the exact limits.

    Raises:
        ValueError: a gain is not positive.
    """
    return tuple(_row(float(theta), lipschitz) for theta in thetas)


def bound_text(rows: Sequence[DesignBoundRow]) -> str:
    """The table as plain text, one line a gain, all gaps in seconds.

    Args:
        rows: one for each gain.
    """
    head = (
        f"{'theta':>6} {'(1.52)':>8} {'(3.32)':>8} {'(3.67)':>8} {'(3.87)':>8} {'mixed gaps':>11} {'constant gap':>13}"
    )
    lines = [
        f"{row.theta:6.3g} {row.by_1_52:8.4f} {row.by_3_32:8.4f} {row.by_3_67:8.4f} {row.by_3_87:8.4f} "
        f"{row.aperiodic:11.4f} {row.constant:13.4f}"
        for row in rows
    ]
    return "\n".join([head, *lines])


def _row(theta: float, lipschitz: float) -> DesignBoundRow:
    if not theta > 0.0:
        raise ValueError(f"Bounds: theta must be positive [1/s], got {theta!r}.")
    gain, decay = (theta * _SHAPE[0], theta**2 * _SHAPE[1]), theta * _SHAPE[0]
    vertices = tuple(SampledError.of([[0.0, 1.0], [0.0, -s]], gain, decay) for s in sorted({0.0, lipschitz}))
    exact = certify_sampled_error(vertices, 2.0 / theta, "double integrator with drag")
    return DesignBoundRow(
        theta,
        by_1_52=longest_gap_1_52(theta, lipschitz),
        by_3_32=longest_gap_3_32(theta, lipschitz),
        by_3_67=longest_gap_3_67(theta, lipschitz),
        by_3_87=longest_gap_3_87(theta, lipschitz),
        constant=exact.condition(CONSTANT_GAP).limit,
        aperiodic=exact.limit,
    )


def _bounds(theta: float, lipschitz: float, K: Sequence[float], mu: float) -> HighGainBounds:
    n = len(K)
    return high_gain_bounds(shift_matrix(n), np.reshape(K, (n, 1)), np.eye(1, n), theta, lipschitz, mu)


def _gain_size() -> float:
    """``|K| sqrt(lambda_max(P) / lambda_min(P))`` with K = inv(P) C' [1]."""
    P = gain_matrix()
    smallest, largest = np.linalg.eigvalsh(P)
    return float(np.linalg.norm(np.linalg.inv(P)[:, 0]) * sqrt(largest / smallest))
