"""Constants of the theorem on adaptive observers with a predicted output, and the sampling period that it allows.

Numbers of a state-affine model over a window. Knows models, and nothing of observers.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp

import numpy as np

from fmu_observer.models.state_affine import StateAffineModel

_STEP = 2e-3  # [s], of the Riemann sums
_SETTLING = 20.0  # times 1 / mu, until S has forgotten its start


@dataclass(frozen=True)
class AdaptiveBounds:
    """Constants of Theorem 4.1 of Hann 2014.

    Attributes:
        window: T, and T1 too [s]. mu: decay of S [1/s]. unknowns: m. alpha0: smallest eigenvalue of the Gramian of
            ``C lambda`` over the window (4.8). alpha1: of the observability Gramian over it (4.6). s_min, s_max:
            extreme eigenvalues of S, settled (Lemma 4.2). regressor: M = sup |Phi|, (4.4). sensitivity: bound c_lambda
            of ``|lambda|_1``, (4.11). drift: sigma_1c = sup ``|C A|_1``. driven: M_c = sup ``|C Phi|_1``.
    """

    window: float
    mu: float
    unknowns: int
    alpha0: float
    alpha1: float
    s_min: float
    s_max: float
    regressor: float
    drift: float
    driven: float

    @property
    def sensitivity(self) -> float:
        """``c_lambda = 4 M beta / (mu alpha)``, (4.11)."""
        return 4.0 * self.regressor * self.s_max / (self.mu * self.s_min)

    @property
    def longest_period(self) -> float:
        """tau_MASP of (4.63) for a vanishing rate [s]; always below a third of a second."""
        return _masp(self)

    def explain(self) -> str:
        """The constants in one line."""
        return (
            f"T = {self.window:g} s, alpha0 = {self.alpha0:.3g}, c_lambda = {self.sensitivity:.3g}, sigma_1c = "
            f"{self.drift:.3g} 1/s, M_c = {self.driven:.3g}"
        )


def _masp(b: AdaptiveBounds) -> float:
    """``1 / (m (c_lambda sigma_1c + M_c)^2 exp(2 T) / alpha0 + alpha1 exp(-2 mu T1) + 3)`` [s], which is (4.63).

    Args:
        b: the constants.
    """
    if b.alpha0 <= 0.0:
        return 0.0
    growth = b.unknowns * (b.sensitivity * b.drift + b.driven) ** 2 * exp(2.0 * b.window) / b.alpha0
    return 1.0 / (growth + b.alpha1 * exp(-2.0 * b.mu * b.window) + 3.0)


def gain_bound(window: float, alpha0: float) -> float:
    """Smallest eigenvalue of inv(R) that Lemma 4.3 grants, ``exp(-2 T) alpha0``.

    Args:
        window: T [s]. alpha0: see `AdaptiveBounds`.
    """
    return exp(-2.0 * window) * alpha0


def adaptive_bounds(model: StateAffineModel, mu: float, window: float = 1.0, begin: float = 0.0) -> AdaptiveBounds:
    """Constants over a window, by Riemann sums (Remark 4.1); inputs at their starts.

    Args:
        model: state-affine. mu: decay of S [1/s]. window: T [s]. begin: of the window [s]; lambda starts at 0 and S at
            identity at time 0, as in the published observer.
    """
    excited, observed, largest, settled = _window_sums(model, mu, window, begin)
    return AdaptiveBounds(
        window=window,
        mu=mu,
        unknowns=len(model.unknowns),
        alpha0=max(float(np.linalg.eigvalsh(excited)[0]), 0.0),
        alpha1=float(np.linalg.eigvalsh(observed)[0]),
        s_min=1.0 / float(settled[-1]),
        s_max=1.0 / float(settled[0]),
        regressor=float(largest[0]),
        drift=float(largest[1]),
        driven=float(largest[2]),
    )


def _window_sums(
    model: StateAffineModel, mu: float, window: float, begin: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Gramians of ``C lambda`` and of observability over the window, shapes (m, m) and (n, n), suprema of ``|Phi|``,
    ``|C A|_1`` and ``|C Phi|_1``, shape (3,), and eigenvalues of inv(S) at the end, shape (n,).
    """
    u = model.start_inputs
    n, m = model.order, len(model.unknowns)
    L, Z, Phi = np.zeros((n, m)), np.eye(n), np.eye(n)
    excited, observed = np.zeros((m, m)), np.zeros((n, n))
    largest = np.zeros(3)
    C, end = model.C, begin + max(window, _SETTLING / mu)
    for k in range(round(end / _STEP)):
        t = k * _STEP
        A, regressor = np.asarray(model.drift(t, u)), np.asarray(model.regressor(t, u))
        if begin <= t < begin + window:
            seen, shown = C @ L, C @ Phi
            excited += _STEP * seen.T @ seen
            observed += _STEP * shown.T @ shown
            Phi = Phi + _STEP * A @ (Phi + 0.5 * _STEP * A @ Phi)
        norms = (np.abs(regressor).max(), np.abs(C @ A).sum(axis=1).max(), np.abs(C @ regressor).sum(axis=1).max())
        largest = np.maximum(largest, norms)
        L, Z = _moved(model, u, mu, t, L, Z)
    return excited, observed, largest, np.linalg.eigvalsh(Z)


def settled_gain(model: StateAffineModel, mu: float) -> np.ndarray:
    """``inv(S) C'`` once S has settled, for A as it is at time 0, shape (n, q).

    Args:
        model: state-affine. mu: decay of S [1/s].
    """
    u = model.start_inputs
    n, A = model.order, np.asarray(model.drift(0.0, u))
    left = mu * np.eye(n * n) + np.kron(np.eye(n), A.T) + np.kron(A.T, np.eye(n))
    S = np.linalg.solve(left, (model.C.T @ model.C).ravel()).reshape(n, n)
    return np.asarray(np.linalg.solve(S, model.C.T))


def _moved(
    model: StateAffineModel, u: np.ndarray, mu: float, t: float, L: np.ndarray, Z: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """lambda and inv(S) a step later, by the midpoint rule."""

    def slopes(t: float, L: np.ndarray, Z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        A, K = np.asarray(model.drift(t, u)), Z @ model.C.T
        dL = (A - K @ model.C) @ L + np.asarray(model.regressor(t, u))
        return dL, mu * Z + A @ Z + Z @ A.T - K @ K.T

    dL, dZ = slopes(t, L, Z)
    dL, dZ = slopes(t + 0.5 * _STEP, L + 0.5 * _STEP * dL, Z + 0.5 * _STEP * dZ)
    Z = Z + _STEP * dZ
    return L + _STEP * dL, 0.5 * (Z + Z.T)
