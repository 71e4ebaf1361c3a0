"""The arrival cost: what the rows that have left the window still say of the state before it. A value.

It is the quadratic ``(x - mean)' inv(P) (x - mean)`` of the state just before the window's first row. When the oldest
row leaves, the cost moves on by that row's own step of the Kalman filter, linearised where the window has put the
state (`gauss_newton.passed`). For a linear system it is therefore exact at every length of the window: the estimate is
that of the Kalman filter over all rows (Rao, Rawlings, Lee: Automatica 37 (2001) 1619).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from plant_models.hybrid import Array


class ArrivalCost(NamedTuple):
    """What is known of the state before the window's first row.

    Attributes:
        point: state at which the transition into the first row is linearised, shape (n,).
        mean: shape (n,). covariance: P row by row, shape (n * n,).
    """

    point: Array
    mean: Array
    covariance: Array


def arrival_cost_at(start: Array, covariance: Array) -> ArrivalCost:
    """The arrival cost of a first guess.

    Args:
        start: shape (n,). covariance: of it, shape (n, n).
    """
    return ArrivalCost(start, start, np.reshape(covariance, (covariance.shape[0] ** 2,)))


def arrival_cost_from(flat: Array, order: int) -> ArrivalCost:
    """The arrival cost from its flat form.

    Args:
        flat: point, mean and covariance one after the other, shape (2 n + n^2,). order: n.
    """
    return ArrivalCost(flat[:order], flat[order : 2 * order], flat[2 * order :])
