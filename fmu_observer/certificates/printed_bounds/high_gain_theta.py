"""The smallest high gain theta that a Lyapunov function proves. Plain NumPy and SciPy."""

from __future__ import annotations

from math import ceil, inf, log, sqrt

import numpy as np

from fmu_observer.certificates.lyapunov import lyapunov_matrix
from fmu_observer.models.observer_model import ObserverModel, shift_matrix

_THETAS = np.geomspace(1.0, 1e4, 4001)


def binomial_gain(order: int) -> np.ndarray:
    """Shape K of the gain with all poles of ``A - K C`` at -1, shape (n,): (2, 1), (3, 3, 1), ...

    Args:
        order: number of states of the chain.
    """
    return np.asarray(np.poly(-np.ones(order))[1:])


def lyapunov_size(K: np.ndarray) -> float:
    """``lmax(P)`` of ``(A - K C)' P + P (A - K C) = -I`` for the chain of integrators [s]; inf when A - K C is not
    Hurwitz.
    """
    P = lyapunov_matrix(chain_error(K))
    return inf if P is None else float(np.linalg.eigvalsh(P)[-1])


def chain_error(K: np.ndarray) -> np.ndarray:
    """``A - K C`` with A the shift matrix and the first state measured, shape (n, n)."""
    closed = shift_matrix(len(K))
    closed[:, 0] -= K
    return np.asarray(closed)


def theta_from_lipschitz(model: ObserverModel, K: np.ndarray) -> float:
    """Theta above which the error decays, ``max(1, 2 sqrt(n) lmax(P) lipschitz)`` [1/s].

    In the coordinates ``e_i / theta^(i-1)`` the linear part grows with theta and a triangular phi does not: each of its
    n rows stays below the Lipschitz constant times the norm of the scaled error.

    Args:
        model: in normal form, its `lipschitz` known. K: shape (n,).
    """
    return max(1.0, 2.0 * sqrt(model.order) * lyapunov_size(K) * model.lipschitz)


def theta_from_slopes(model: ObserverModel, K: np.ndarray) -> float:
    """The same with the slopes of phi instead of one constant: smaller, because damping and coupling shrink with theta
    [1/s].

    Args:
        model: the plant as the observer knows it. K: gain of the linear part, shape (n,).

    Returns:
        The smallest theta of a fine grid from which on ``theta > 2 lmax(P) |inv(S) slope S|``; inf without slopes or
        when there is none, however large.
    """
    size = lyapunov_size(K)
    if not model.slopes or size == inf:
        return inf
    last = max(_surely_enough(np.asarray(slope), 2.0 * size) for slope in model.slopes)
    if last == inf:
        return inf
    ratio = _THETAS[1] / _THETAS[0]
    beyond = _THETAS[-1] * ratio ** np.arange(1, 2 + max(0, ceil(log(last / _THETAS[-1]) / log(ratio))))
    thetas = np.r_[_THETAS, beyond]
    sizes = thetas[:, None] ** np.arange(model.order)
    steepest = [np.linalg.norm(slope * sizes[:, None, :] / sizes[:, :, None], 2, axis=(1, 2)) for slope in model.slopes]
    enough = np.max(steepest, axis=0) * 2.0 * size < thetas
    failing = np.flatnonzero(~enough)
    return float(thetas[failing[-1] + 1] if failing.size else thetas[0])


def _surely_enough(slope: np.ndarray, factor: float) -> float:
    """A theta from which on ``theta > factor |inv(S) slope S|``, at least 1; inf where there is none.

    Of a slope the entries above the diagonal grow with theta, by its first power next to it: less than theta only where
    ``factor`` times their norm is below one, and whatever stands further off grows faster. The rest does not grow.
    """
    next_to = np.diag(np.diag(slope, 1), 1)
    left = 1.0 - factor * float(np.linalg.norm(next_to, 2))
    if np.triu(slope, 2).any() or left <= 0.0:
        return inf
    return max(1.0, factor * float(np.linalg.norm(np.tril(slope))) / left)
