"""How nonlinear a discrete Luenberger observer may be: a small-gain condition on the unit circle. Plain NumPy and
SciPy.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, sin

import numpy as np
import scipy

from fmu_observer.models.observer_model import ObserverModel
from fmu_observer.models.scaled_slopes import best_scale, scaled, scaled_lipschitz

_POINTS, _FEW = 2048, 128  # on the upper half of the unit circle, for the answer and for the choice of coordinates
_SCALES = np.geomspace(0.1, 100.0, 121)


@dataclass(frozen=True)
class DiscreteBound:
    """The small-gain condition ``lipschitz < bound``, both per period [1].

    Attributes:
        spectral_radius: of ``A_d - L C``. bound: smallest singular value of ``z I - (A_d - L C)`` on the unit circle,
            less what may lie between the points of the grid. lipschitz: of what the transition over one period adds to
            A_d. scale: of the coordinates.
    """

    spectral_radius: float
    bound: float
    lipschitz: float
    scale: float

    @property
    def holds(self) -> bool:
        """Whether the error decays for every nonlinearity of that constant."""
        return self.spectral_radius < 1.0 and self.lipschitz < self.bound


def centre_of(model: ObserverModel) -> np.ndarray:
    """A with the mean of the slopes of phi: the linear model the rest deviates least from, shape (n, n)."""
    return np.asarray(model.A + (np.mean(model.slopes, axis=0) if model.slopes else 0.0))


def _circle_distance(closed: np.ndarray, points: int = _POINTS) -> float:
    """Lower bound of the smallest singular value of ``z I - closed`` over the unit circle.

    Singular values move by no more than z does, so half the distance of two grid points is taken off.
    """
    angles = np.linspace(0.0, pi, points)
    pencils = np.exp(1j * angles)[:, None, None] * np.eye(len(closed)) - closed
    smallest = float(np.linalg.svd(pencils, compute_uv=False)[:, -1].min())
    return max(0.0, smallest - 2.0 * sin(0.25 * (angles[1] - angles[0])))


def _transition_lipschitz(model: ObserverModel, period: float, scale: float) -> float:
    """Bound of the Lipschitz constant of ``transition(x) - exp(A_c T) x``, A_c the centre, in scaled coordinates.

    ``exp(mu T) (exp(rho T) - 1)`` by Gronwall's lemma, mu the logarithmic norm of A_c and rho the constant of ``phi``
    about its centre.

    Args:
        model: the plant as the observer knows it. period: sampling period [s].
        scale: of the coordinates, ``x_i / scale^i``.
    """
    centre = centre_of(model)
    A = scaled(centre, scale)
    mu = float(np.linalg.eigvalsh(0.5 * (A + A.T))[-1])
    rho = scaled_lipschitz(model, scale, centre - model.A)
    with np.errstate(over="ignore", invalid="ignore"):
        found = float(np.exp(mu * period) * np.expm1(rho * period))
    return float("inf") if np.isnan(found) else found


def discrete_bound(model: ObserverModel, gain: np.ndarray, period: float) -> DiscreteBound:
    """The condition for a gain L of shape (n, q) at a period [s], in the best coordinates found.

    ``e+ = (A_d - L C) e + g`` with ``|g| <= lipschitz |e|`` decays when the loop gain is below one (small-gain theorem;
    quadratic stability for norm-bounded uncertainty asks the same).

    Args:
        model: the plant as the observer knows it.
    """
    closed = scipy.linalg.expm(centre_of(model) * period) - gain @ model.C
    radius = float(np.abs(np.linalg.eigvals(closed)).max())
    if radius >= 1.0:
        return DiscreteBound(radius, 0.0, _transition_lipschitz(model, period, 1.0), 1.0)
    if model.phi is None or model.lipschitz == 0.0:
        return DiscreteBound(radius, _circle_distance(closed), 0.0, 1.0)

    def margin(scale: float) -> float:
        return _circle_distance(scaled(closed, scale), _FEW) / _transition_lipschitz(model, period, scale)

    scale = best_scale(margin, closed, _SCALES)
    return DiscreteBound(
        radius, _circle_distance(scaled(closed, scale)), _transition_lipschitz(model, period, scale), scale
    )
