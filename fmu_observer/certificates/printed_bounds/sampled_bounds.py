"""The sufficient bounds printed for high-gain observers at samples, beside the exact limits. Plain NumPy and the
certificates.

The printed bounds are correct and far too small to design with: they are here so that a reader can see by how much.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import sqrt

import numpy as np
import scipy

from fmu_observer.certificates.aperiodic import certify_sampled_error
from fmu_observer.certificates.finding import Finding, as_printed
from fmu_observer.certificates.gap_findings import CONSTANT_GAP
from fmu_observer.certificates.printed_bounds.high_gain_bounds import HighGainBounds, high_gain_bounds
from fmu_observer.certificates.sampled_error import SampledError
from fmu_observer.models.observer_model import shift_matrix

_SHAPE = (2.0, 1.0)  # K of the train observers, Bouchama 2024, (3.29)


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


def _longest_gap_1_52(theta: float, lipschitz: float, K: Sequence[float] = _SHAPE, mu: float = 1.0) -> float:
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


def _longest_gap_3_32(theta: float, lipschitz: float) -> float:
    """``(theta - 2 beta/theta) / (2 sqrt(5) theta^2 sqrt(lambda_max/lambda_min))`` [s], Bouchama 2024, (3.32), (3.87).

    The eigenvalues are those of `gain_matrix`, and ``sqrt(5) = |K|`` of K = (2, 1). Negative below
    `smallest_theta_3_31`.

    Args:
        theta: high gain [1/s]. lipschitz: beta [1/s].
    """
    return (theta - 2.0 * lipschitz / theta) / (2.0 * theta**2 * _gain_size())


def _longest_gap_3_67(theta: float, lipschitz: float = 0.0) -> float:
    """``(theta - 2 beta/theta) / (2 theta (theta + beta) |K| sqrt(lambda_max/lambda_min))`` [s], Bouchama 2024, (3.67).

    The bound of the wheel stage. Its beta is undefined in print; the equations give 0, for the stage has no nonlinear
    term.

    Args:
        theta: high gain [1/s]. lipschitz: beta [1/s].
    """
    return (theta - 2.0 * lipschitz / theta) / (2.0 * theta * (theta + lipschitz) * _gain_size())


def sampled_findings(theta: float, lipschitz: float = 0.0) -> tuple[Finding, ...]:
    """Printed bounds of the gap beside the exact limits of the double integrator with K = (2, 1), at one high gain.

    Args:
        theta: high gain [1/s], positive. lipschitz: Lipschitz constant of the resistance [1/s], in the formulas and as
            a drag slope between 0 and it in the exact limits.

    Returns:
        By (1.52), (3.32) and (3.87), (3.67); a bound is negative where the gain is too small for its formula. Then
        mixed gaps and the constant one.

    Raises:
        ValueError: the gain is not positive.
    """
    if not theta > 0.0:
        raise ValueError(f"Bounds: theta must be positive [1/s], got {theta!r}.")
    gain, decay = (theta * _SHAPE[0], theta**2 * _SHAPE[1]), theta * _SHAPE[0]
    vertices = tuple(SampledError.of([[0.0, 1.0], [0.0, -s]], gain, decay) for s in sorted({0.0, lipschitz}))
    exact = certify_sampled_error(vertices, 2.0 / theta, "double integrator with drag")
    printed = {
        "(1.52)": _longest_gap_1_52(theta, lipschitz),
        "(3.32), (3.87)": _longest_gap_3_32(theta, lipschitz),
        "(3.67)": _longest_gap_3_67(theta, lipschitz),
    }
    bounds = (as_printed("gap", value, "", f"Bouchama 2024, {formula}") for formula, value in printed.items())
    return (*bounds, replace(exact, holds=None, demand=None), exact.condition(CONSTANT_GAP))


def _bounds(theta: float, lipschitz: float, K: Sequence[float], mu: float) -> HighGainBounds:
    n = len(K)
    return high_gain_bounds(shift_matrix(n), np.reshape(K, (n, 1)), np.eye(1, n), theta, lipschitz, mu)


def _gain_size() -> float:
    """``|K| sqrt(lambda_max(P) / lambda_min(P))`` with K = inv(P) C' [1]."""
    P = gain_matrix()
    smallest, largest = np.linalg.eigvalsh(P)
    return float(np.linalg.norm(np.linalg.inv(P)[:, 0]) * sqrt(largest / smallest))
