"""Thau's condition: how large a Lipschitz constant a Luenberger gain stands. Plain NumPy and SciPy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fmu_observer.certificates.lyapunov import lyapunov_matrix
from fmu_observer.models.observer_model import ObserverModel
from fmu_observer.models.scaled_slopes import best_scale, scaled, scaled_lipschitz

_SCALES = np.geomspace(0.1, 100.0, 301)


@dataclass(frozen=True)
class ThauBound:
    """Bounds of the Lipschitz constant for ``(A - L C)' P + P (A - L C) = -I`` [1/s].

    Attributes:
        valid: ``1 / (2 lmax(P))``: below it the error decays. printed: ``1 / lmin(P)`` as in (1.8), which is unsafe.
        scale: s of the coordinates ``z_i = x_i / s^(i-1)`` they hold in. lipschitz: constant of phi in these
        coordinates.
    """

    valid: float
    printed: float
    scale: float
    lipschitz: float

    @property
    def holds(self) -> bool:
        """Whether the valid bound stands above the constant."""
        return self.lipschitz < self.valid


def _thau_bound(closed: np.ndarray) -> tuple[float, float]:
    """The valid and the printed bound of Bouchama 2024, (1.8), Theorem 1, at Q = I, which gives the best valid one.

    The derivative of ``e' P e`` is at most ``(-lmin(Q) + 2 alpha lmax(P)) |e|^2``, so ``alpha < lmin(Q) / (2 lmax(P))``
    is enough. The print has ``alpha < lmax(Q) / lmin(P)``, which is not.

    Args:
        closed: ``A - L C``, shape (n, n) [1/s].

    Returns:
        Both bounds [1/s]; zeros when `closed` is not Hurwitz.
    """
    P = lyapunov_matrix(closed)
    if P is None:
        return 0.0, 0.0
    sizes = np.linalg.eigvalsh(P)
    return float(0.5 / sizes[-1]), float(1.0 / sizes[0])


def scaled_thau_bound(model: ObserverModel, gain: np.ndarray, scale: float = 1.0) -> ThauBound:
    """`_thau_bound` of a model with a gain L of shape (n, q), in the coordinates of one scale."""
    valid, printed = _thau_bound(scaled(model.A - gain @ model.C, scale))
    return ThauBound(valid, printed, scale, scaled_lipschitz(model, scale))


def best_thau_bound(model: ObserverModel, gain: np.ndarray) -> ThauBound:
    """The bound in the coordinates in which it leaves the largest factor over the constant.

    Args:
        model: the plant as the observer knows it. gain: shape (n, q).
    """

    def margin(scale: float) -> float:
        bound = scaled_thau_bound(model, gain, scale)
        return bound.valid / max(bound.lipschitz, 1e-12)

    return scaled_thau_bound(model, gain, best_scale(margin, model.A - gain @ model.C, _SCALES))
