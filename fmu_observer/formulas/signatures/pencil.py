"""The pencil map: N past samples and the one that follows them become one point of the plane. Pure functions that
trace; they know nothing but NumPy.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Literal, NamedTuple

import numpy as np

from plant_models.hybrid import Array

NextScaling = Literal["norm", "literal"]
EPS = 1e-3
"""Regularisation where none is named: the thesis prints no value."""


class _Pencil(NamedTuple):
    """What the pencil map computes.

    Attributes:
        edge_points: Psi_i, one on each edge of the polygon, shape (2, N, ...). centre: Phi0, shape (2, ...).
        weighted: Phi1, shape (2, ...). position: lam, of the point on the line from `centre` to `weighted`, shape
            (...). point: P, shape (2, ...).
    """

    edge_points: Array
    centre: Array
    weighted: Array
    position: Array
    point: Array


@lru_cache
def polygon(count: int) -> np.ndarray:
    """Vertices Q_i of the regular polygon on the unit circle: Omar 2012, section 2.3.

    Two vertices make a segment, of which all points have the ordinate 0. There the second row is the weight of the
    second vertex in a point, 0 and 1 at the vertices: the pair (abscissa, weight) takes the place of the coordinates.
    The weights of a point need not sum to 1, so that the weight says more than the abscissa.

    Args:
        count: of vertices, N, 2 at least.

    Returns:
        Shape (2, N), read-only: abscissas, then ordinates.

    Raises:
        ValueError: there are fewer than two.
    """
    if count < 2:
        raise ValueError(f"a signature needs 2 past samples at least, the order is {count}.")
    angles = 2.0 * np.pi * np.arange(count) / count
    corners = np.array([[1.0, -1.0], [0.0, 1.0]]) if count == 2 else np.stack([np.cos(angles), np.sin(angles)])
    corners.flags.writeable = False
    return corners


def pencil_point(past: Array, following: Array, eps: Array = EPS, next_scaling: NextScaling = "norm") -> Array:
    """Point P_eps of a window: Omar 2012, (2.3.1)-(2.3.6).

    The past is scaled by its largest size. ``norm`` scales the sample that follows by the same, so that a record and
    its double have one signature. ``literal`` divides it by the largest size of the *scaled* past, as (2.3.6) prints
    it, which is nearly 1: the point then shows the size of the signal too.

    For two past samples the second coordinate is the weight of the second vertex, see `polygon`.

    Args:
        past: samples from the oldest to the newest, shape (N, ...). following: the sample after them, shape (...).
        eps: regularisation in the unit of the samples, positive; ``literal`` also adds it to the scaled size.
        next_scaling: ``norm`` or ``literal``.

    Returns:
        Abscissa and ordinate [1], shape (2, ...).

    Raises:
        ValueError: the order is less than 2, or the scaling is unknown.
    """
    scaled, position = _scaled(past, following, eps, next_scaling)
    count = len(past)
    corners = polygon(count)
    following_corners = np.roll(corners, -1, axis=1)
    halved = 0.5 / count * (following_corners - corners)  # weights of an edge: (1 - Yb) / 2 and (1 + Yb) / 2
    summed = 0.5 / count * (following_corners + corners)
    offset = np.sum(summed, axis=1)  # 0 but for two vertices, whose second coordinate is a weight
    offset = offset if scaled.ndim == 1 else offset.reshape(2, *[1] * (scaled.ndim - 1))
    centre = _apply(halved, scaled) + offset
    weighted = _apply(summed, scaled) + _apply(halved, scaled * scaled)
    return centre + position * (weighted - centre)


def pencil(past: Array, following: Array, eps: Array = EPS, next_scaling: NextScaling = "norm") -> _Pencil:
    """All steps of the pencil map of numbers, as printed: Omar 2012, (2.3.1)-(2.3.6); for drawing and for checking.

    Args:
        past: samples from the oldest to the newest, shape (N, ...). following: the sample after them, shape (...).
        eps: regularisation in the unit of the samples, positive. next_scaling: ``norm`` or ``literal``, see
            `pencil_point`.

    Returns:
        Edge points, their mean, their weighted mean, and the point, each with its coordinates first.

    Raises:
        ValueError: the order is less than 2, or the scaling is unknown.
    """
    past = np.asarray(past, dtype=float)
    scaled, position = _scaled(past, np.asarray(following, dtype=float), eps, next_scaling)
    corners = polygon(len(past))
    corners = corners.reshape(2, len(past), *[1] * (past.ndim - 1))
    edge_points = 0.5 * ((1.0 + scaled) * np.roll(corners, -1, axis=1) - (scaled - 1.0) * corners)
    centre = edge_points.mean(axis=1)
    weighted = (scaled * edge_points).mean(axis=1)
    return _Pencil(edge_points, centre, weighted, position, centre + position * (weighted - centre))


def _scaled(past: Array, following: Array, eps: Array, next_scaling: NextScaling) -> tuple[Array, Array]:
    """The scaled past (2.3.1), shape (N, ...), and the position on the line (2.3.6), shape (...)."""
    size = np.max(np.abs(past), axis=0)
    scaled = past / (size + eps)
    if next_scaling == "norm":
        divisor = size + eps
    elif next_scaling == "literal":
        divisor = size / (size + eps) + eps
    else:
        raise ValueError(f"next_scaling is {next_scaling!r}; it is 'norm' or 'literal'.")
    return scaled, following / divisor - np.sum(scaled, axis=0) / len(past)


def _apply(matrix: np.ndarray, values: Array) -> Array:
    """Product of shape (2, N) and (N, ...), shape (2, ...)."""
    return matrix @ values if values.ndim <= 2 else np.tensordot(matrix, values, axes=(1, 0))
