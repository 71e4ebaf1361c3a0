"""The unscented transform and the filter made of it. Pure functions that trace.

With ``d_i = f(chi_i) - f(chi_0)`` and ``e = sum Wm_i d_i`` the covariance of the thesis,
``sum Wc_i (y_i - ybar)(y_i - ybar)'``, is ``Wm_1 sum d_i d_i' + (beta - alpha^2) e e'``. So it is computed here: the
weights of the centre, about -1 / alpha^2, never appear, nothing cancels, and for ``beta >= alpha^2`` every term is
positive.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np

from fmu_observer.formulas.filtering.kalman import Corrected, solved, symmetric
from fmu_observer.formulas.filtering.square_root import corrected_by, triangular
from plant_models.hybrid import Array

Function = Callable[[Array], Array]  # (state of shape (n,)) -> shape (m,)


@cache
def _ones(count: int) -> Array:
    return np.ones(count)


@cache
def _signs(n: int) -> Array:
    """By which the columns of a factor become the distances of the points from the centre, shape (n, 2 n + 1)."""
    return np.hstack([np.zeros((n, 1)), np.eye(n), -np.eye(n)])


class Weights(NamedTuple):
    """Weights of the scaled unscented transform of n numbers: Allaoui 2024, (2.37)-(2.39).

    Attributes:
        spread: distance of the points from the centre, in columns of the factor, sqrt(n + lambda) [1].
        mean_centre: Wm_0. covariance_centre: Wc_0. each: Wm_i = Wc_i of the other points.
        bend: ``beta - alpha^2``, weight of the square of the shift of the mean.
    """

    spread: Array
    mean_centre: Array
    covariance_centre: Array
    each: Array
    bend: Array


def weights(n: int, alpha: Array = 1e-3, beta: Array = 2.0, kappa: Array = 0.0) -> Weights:
    """Weights of 2 n + 1 sigma points, with ``lambda = alpha^2 (n + kappa) - n``.

    Args:
        n: how many numbers are drawn together. alpha: spread of the points [1], positive.
        beta: 2 for Gaussian numbers [1]. kappa: 0, or 3 - n; above -n [1].
    """
    square = alpha * alpha * (n + kappa)
    lam = square - n
    centre = lam / square
    return Weights(np.sqrt(square), centre, centre + 1.0 - alpha * alpha + beta, 0.5 / square, beta - alpha * alpha)


class Scattered(NamedTuple):
    """Values of a function at sigma points, as it goes into means and covariances.

    Attributes:
        centre: value at the centre, shape (m,). deviations: of the values at the other points from it, shape (m, 2 n).
    """

    centre: Array
    deviations: Array


def sigma_points(x: Array, S: Array, spread: Array) -> Array:
    """Points ``x``, ``x + spread S_i``, ``x - spread S_i``: Allaoui 2024, (2.32)-(2.34).

    Args:
        x: centre, shape (n,). S: factor of the covariance, shape (n, n), its columns S_i. spread: see `Weights`.

    Returns:
        Shape (n, 2 n + 1), the centre first.
    """
    n = x.shape[0]
    return x.reshape(n, 1) + (spread * S) @ _signs(n)  # a third of the time of stacking them


def scattered(function: Function, points: Array) -> Scattered:
    """A function at sigma points.

    Args:
        function: of one point. points: shape (n, 2 n + 1), the centre first.
    """
    values = [function(points[:, i]) for i in range(points.shape[1])]
    return Scattered(values[0], np.stack([value - values[0] for value in values[1:]], axis=1))


def shift(found: Scattered, w: Weights) -> Array:
    """How far the mean lies from the value at the centre, ``sum Wm_i d_i``, shape (m,).

    Args:
        found: values at the points. w: weights.
    """
    return w.each * (found.deviations @ _ones(found.deviations.shape[1]))


def mean(found: Scattered, w: Weights) -> Array:
    """Weighted mean ``chi_0 + sum Wm_i (chi_i - chi_0)``, shape (m,): Allaoui 2024, (2.35).

    Args:
        found: values at the points. w: weights.
    """
    return found.centre + shift(found, w)


def covariance(found: Scattered, other: Scattered, w: Weights) -> Array:
    """Weighted covariance of two functions at the same points, shape (m, k): Allaoui 2024, (2.36), (2.52).

    Args:
        found: values of the one, m of them. other: values of the other, k of them. w: weights.
    """
    apart = shift(found, w)
    return _covariance(found, other, apart, apart if other is found else shift(other, w), w)


def _covariance(found: Scattered, other: Scattered, apart: Array, along: Array, w: Weights) -> Array:
    """That of two functions whose shifts are known already."""
    bend = (w.bend * apart).reshape(apart.shape[0], 1) * along  # np.outer takes three times as long
    return w.each * (found.deviations @ other.deviations.T) + bend


def moments(found: Scattered, w: Weights) -> tuple[Array, Array]:
    """Mean, shape (m,), and covariance, shape (m, m), of a function at sigma points.

    Args:
        found: values at the points. w: weights.
    """
    apart = shift(found, w)
    return found.centre + apart, symmetric(_covariance(found, found, apart, apart, w))


def _root_columns(found: Scattered, w: Weights) -> Array:
    """Columns C with ``C C'`` the weighted covariance, shape (m, 2 n + 1); for ``beta >= alpha^2``.

    Args:
        found: values at the points. w: weights.
    """
    bend = np.sqrt(np.maximum(w.bend, 0.0)) * shift(found, w)
    return np.hstack([np.sqrt(w.each) * found.deviations, bend.reshape(bend.shape[0], 1)])


def correct(x: Array, P: Array, states: Scattered, seen: Scattered, y: Array, RN: Array, w: Weights) -> Corrected:
    """Estimate and covariance after a measurement: Allaoui 2024, (2.50)-(2.55), the innovation of the measured y.

    Args:
        x: prediction, shape (n,). P: its covariance, shape (n, n).
        states: the points drawn for the measurement. seen: what each of them measures, q values.
        y: measurement, shape (q,). RN: covariance of its additive noise, shape (q, q). w: weights.

    Returns:
        Estimate, covariance, gain and covariance of the innovation.
    """
    along = shift(seen, w)
    S = symmetric(_covariance(seen, seen, along, along, w)) + RN
    cross = _covariance(states, seen, shift(states, w), along, w)
    K = solved(S, cross.T).T
    return Corrected(x + K @ (y - (seen.centre + along)), symmetric(P - K @ cross.T), K, S)


def correct_root(
    x: Array, states: Scattered, seen: Scattered, y: Array, noise: Array, w: Weights, unseen: Array | None = None
) -> Corrected:
    """The square-root form of `correct`: no covariance is formed.

    Args:
        x: prediction, shape (n,). states: the points drawn for the measurement. seen: what each of them measures, q
            values. y: measurement, shape (q,).
        noise: factor of the covariance of its additive noise, shape (q, r). w: weights, ``beta >= alpha^2``.
        unseen: factor of what the prediction's covariance has beyond that of the points, shape (n, s): the process
            noise, where points of the transition are used again. None for points drawn from the prediction.

    Returns:
        Estimate, lower factor of the covariance, gain and covariance of the innovation.
    """
    spread, readings = _root_columns(states, w), _root_columns(seen, w)
    if unseen is not None:
        spread = np.hstack([spread, unseen])
        readings = np.hstack([readings, np.zeros((readings.shape[0], unseen.shape[1]))])
    return corrected_by(x, y - mean(seen, w), noise, readings, spread)


def predicted_root(found: Scattered, noise: Array, w: Weights) -> Array:
    """Lower factor of the covariance of a transition with additive noise, shape (n, n).

    Args:
        found: the transition at the points. noise: factor of the process noise, shape (n, r).
        w: weights, ``beta >= alpha^2``.
    """
    return triangular(np.hstack([_root_columns(found, w), noise]))
