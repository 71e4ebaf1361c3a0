"""The bootstrap particle filter: a distribution of any shape as weighted points. Pure functions that trace.

Gordon, Salmond, Smith, IEE Proceedings F 140 (1993) 107; resampling by Kitagawa, Journal of Computational and Graphical
Statistics 5 (1996) 1, in its deterministic form, which draws no numbers.
"""

from __future__ import annotations

from functools import reduce
from typing import NamedTuple

import numpy as np

from fmu_observer.formulas.filtering.kalman import normalised_square
from plant_models.hybrid import Array


class Weighted(NamedTuple):
    """Mean and covariance of weighted points.

    Attributes:
        mean: shape (n,). covariance: shape (n, n).
    """

    mean: Array
    covariance: Array


def moments(points: Array, weights: Array) -> Weighted:
    """Mean and covariance.

    Args:
        points: shape (n, M). weights: of sum 1, shape (M,).
    """
    mean = points @ weights
    apart = points - mean.reshape(points.shape[0], 1)
    return Weighted(mean, (apart * weights) @ apart.T)


def reweighted(weights: Array, seen: Array, y: Array, RN: Array) -> Array:
    """Weights after a measurement with Gaussian noise, of sum 1, shape (M,).

    The largest likelihood is divided out first, so that particles far off do not all vanish in rounding.

    Args:
        weights: before, shape (M,). seen: what each particle measures, shape (q, M). y: measurement, shape (q,).
        RN: covariance of its noise, shape (q, q).
    """
    innovations = y.reshape(y.shape[0], 1) - seen
    squares = np.ones(y.shape[0]) @ (innovations * np.linalg.solve(RN, innovations))
    nearest = reduce(np.minimum, [squares[i] for i in range(squares.shape[0])])
    raised = weights * np.exp(-0.5 * (squares - nearest))
    total = raised @ np.ones(raised.shape[0])
    return np.where(total > 0.0, raised / np.where(total > 0.0, total, 1.0), weights)


def effective_size(weights: Array) -> Array:
    """How many particles of equal weight are worth as much: ``1 / sum w^2``.

    Args:
        weights: of sum 1, shape (M,).
    """
    return 1.0 / (weights @ weights)


def resampled(points: Array, weights: Array) -> Array:
    """Points of equal weight in place of weighted ones: the one in which ``(i + 1/2) / M`` of the weight is reached.

    Args:
        points: shape (n, M). weights: of sum 1, shape (M,).

    Returns:
        Shape (n, M), in the order of the points.
    """
    count = points.shape[1]
    reached = np.tril(np.ones((count, count))) @ weights
    before = reached - weights
    steps = [(i + 0.5) / count * reached[count - 1] for i in range(count)]
    chosen = [np.where(before <= step, np.where(step < reached, 1.0, 0.0), 0.0) for step in steps]
    return points @ np.stack(chosen, axis=1)


def innovation_square(seen: Array, weights: Array, y: Array, RN: Array) -> Array:
    """Normalised innovation squared of the mean, as if the particles were Gaussian [1].

    Args:
        seen: what each particle measures, shape (q, M). weights: of sum 1, shape (M,). y: measurement, shape (q,).
        RN: covariance of its noise, shape (q, q).
    """
    found = moments(seen, weights)
    return normalised_square(y - found.mean, found.covariance + RN)
