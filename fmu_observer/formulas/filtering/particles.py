"""Filters with members: the bootstrap particle filter, a distribution of any shape as weighted points, and the ensemble
Kalman filter. Pure functions that trace.

Gordon, Salmond, Smith, IEE Proceedings F 140 (1993) 107; resampling by Kitagawa, Journal of Computational and Graphical
Statistics 5 (1996) 1, in its deterministic form, which draws no numbers.
"""

from __future__ import annotations

from functools import reduce
from typing import NamedTuple

import numpy as np

from fmu_observer.formulas.filtering.kalman import normalised_square
from fmu_observer.formulas.filtering.square_root import factor
from plant_models.hybrid import Array


class _EnsembleCorrected(NamedTuple):
    """What a measurement makes of an ensemble.

    Attributes:
        members: after it, shape (n, M). nis: normalised innovation squared of the mean [1].
    """

    members: Array
    nis: Array


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


def mean_of(members: Array) -> Array:
    """Mean of the members, shape (n,).

    Args:
        members: shape (n, M).
    """
    count = members.shape[1]
    return members @ np.full(count, 1.0 / count)


def deviations_of(members: Array, mean: Array) -> Array:
    """Members less their mean, over ``sqrt(M - 1)``, so that ``D D'`` is their covariance; shape (n, M).

    Args:
        members: shape (n, M), M at least 2. mean: of them, shape (n,).
    """
    return (members - mean.reshape(mean.shape[0], 1)) / np.sqrt(members.shape[1] - 1.0)


def variances_of(members: Array) -> Array:
    """Variances of the members, shape (n,).

    Args:
        members: shape (n, M).
    """
    deviations = deviations_of(members, mean_of(members))
    return (deviations * deviations) @ np.ones(members.shape[1])


def drawn(covariance: Array, draws: Array) -> Array:
    """Gaussian numbers of a covariance, shape (n, M).

    Args:
        covariance: shape (n, n), semidefinite. draws: independent standard normal numbers, shape (n, M).
    """
    return factor(covariance) @ draws


def correct_members(members: Array, seen: Array, y: Array, RN: Array, draws: Array) -> _EnsembleCorrected:
    """Every member corrected by the gain of the ensemble and a perturbed measurement of its own.

    Args:
        members: predictions, shape (n, M). seen: what each of them measures, shape (q, M).
        y: measurement, shape (q,). RN: covariance of its noise, shape (q, q).
        draws: independent standard normal numbers, shape (q, M).

    Returns:
        Members and NIS.
    """
    expected = mean_of(seen)
    spread, readings = deviations_of(members, mean_of(members)), deviations_of(seen, expected)
    S = readings @ readings.T + RN
    K = np.linalg.solve(S, readings @ spread.T).T
    perturbed = y.reshape(y.shape[0], 1) + drawn(RN, draws) - seen
    return _EnsembleCorrected(members + K @ perturbed, normalised_square(y - expected, S))
