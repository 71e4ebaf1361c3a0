"""The ensemble Kalman filter: its covariance is that of members that all run through the model. Pure functions that
trace.

Stochastic form with perturbed measurements: Burgers, van Leeuwen, Evensen, Monthly Weather Review 126 (1998) 1719.
"""

from __future__ import annotations

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
