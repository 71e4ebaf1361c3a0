"""How steep a model's nonlinearity is in scaled coordinates ``z_i = x_i / s^(i-1)``. Plain NumPy.

The printed conditions of Lipschitz observers hold in any coordinates; the ones in which the states are of one size are
the sharpest.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fmu_observer.models.observer_model import ObserverModel

_FURTHEST = 1e8  # scale up to which is searched, and one over it: beyond it the powers leave the range of numbers
_PROGRESS = 1e-3  # relative; what grows less over a third of the grid tends to what it is


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


def best_scale(margin: Callable[[float], float], closed: np.ndarray, scales: np.ndarray) -> float:
    """Scale at which a margin is largest.

    The grid is moved to where the matrix of the error is smallest, if that lies outside of it: units of the states do
    not count. Where an end of the grid is best the search goes on beyond it in the same ratio: until the margin falls,
    or tends to a value that it reaches nowhere, or `_FURTHEST`.

    Args:
        margin: by the scale; larger is better. closed: matrix of the error, shape (n, n). scales: geometric grid that
            is tried first, shape (k,).
    """
    around = _FURTHEST ** np.linspace(-1.0, 1.0, 129)
    smallest = around[int(np.argmin([np.linalg.norm(scaled(closed, s)) for s in around]))]
    if not scales[0] <= smallest <= scales[-1]:
        scales = scales * smallest / np.sqrt(scales[0] * scales[-1])
    ratio, block = float(scales[1] / scales[0]), len(scales) // 3
    tried = {float(s): margin(float(s)) for s in scales}
    for first, towards in ((float(scales[-1]), ratio), (float(scales[0]), 1.0 / ratio)):
        end, least = first, -np.inf
        while max(tried.values()) == tried[end] > least and _FURTHEST >= end >= 1.0 / _FURTHEST:
            least = (1.0 + _PROGRESS) * tried[end]
            further = [end * towards**k for k in range(1, block + 1)]
            tried |= {s: margin(s) for s in further}
            end = further[-1]
    return max(tried, key=tried.__getitem__)
