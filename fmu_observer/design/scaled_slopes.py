"""How steep a model's nonlinearity is in scaled coordinates ``z_i = x_i / s^(i-1)``. Plain NumPy.

The printed conditions of Lipschitz observers hold in any coordinates; the ones in which the states are of one size are
the sharpest.
"""

from __future__ import annotations

import numpy as np

from fmu_observer.models import ObserverModel


def powers(scale: float, order: int) -> np.ndarray:
    """Sizes of the states, ``s^0 ... s^(n-1)``, shape (n,).

    Args:
        scale: of the coordinates, ``x_i / scale^i``. order: number of states of the chain.
    """
    return np.asarray(scale ** np.arange(order, dtype=float))


def scaled(matrix: np.ndarray, scale: float) -> np.ndarray:
    """``inv(S) M S`` with ``S = diag(1, s, ..., s^(n-1))``: a matrix of the flow in scaled coordinates, shape (n,
    n).

    Args:
        scale: of the coordinates, ``x_i / scale^i``.
    """
    sizes = powers(scale, len(matrix))
    return np.asarray(matrix * sizes[None, :] / sizes[:, None])


def scaled_lipschitz(model: ObserverModel, scale: float, centre: np.ndarray | None = None) -> float:
    """Lipschitz constant of ``phi - centre x`` in scaled coordinates [1/s].

    The largest norm over the vertices of its Jacobian where the model has them (a norm is convex), else `lipschitz`
    times the condition number of the scaling.

    Args:
        model: the model. scale: s. centre: linear part counted to A, shape (n, n); None for none. Needs vertices.
    """
    shift = np.zeros((model.order, model.order)) if centre is None else centre
    if model.slopes:
        return max(float(np.linalg.norm(scaled(slope - shift, scale), 2)) for slope in model.slopes)
    sizes = powers(scale, model.order)
    return float(model.lipschitz * sizes.max() / sizes.min())
