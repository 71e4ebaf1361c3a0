"""Envelope of points of the plane, slabs of equal population with a lower and an upper bound in the best frame, and how
far a point is from it. NumPy.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_DIRECTIONS = 90
"""Lines through a point among which the smallest distance is sought: one every two degrees."""

_SLABS = 30
"""Slabs of the example of Omar 2012, section 4.5."""
ANGLES = 181
"""Angles from 0 to pi at which the best envelope is sought: one a degree."""


@dataclass(frozen=True)
class Envelope:
    """Rectangles side by side that hold all points, in a turned frame: Omar 2012, (4.5.1)-(4.5.12).

    Args:
        angle: by which the points are turned before [rad]. edges: abscissas between slabs in that frame, rising, shape
        (q + 1,). lower: smallest ordinate of each slab there, shape (q,). upper: largest, shape (q,).
    """

    angle: float
    edges: np.ndarray
    lower: np.ndarray
    upper: np.ndarray

    @property
    def area(self) -> float:
        """Sum of the slabs' areas, in the square of the points' unit: Omar 2012, (4.5.14)."""
        return float(np.sum(np.diff(self.edges) * (self.upper - self.lower)))

    @property
    def corners(self) -> np.ndarray:
        """Corners of the slabs in the frame of the points, four a slab, shape (2, q, 4)."""
        left, right = self.edges[:-1], self.edges[1:]
        turned = np.stack([[left, right, right, left], [self.lower, self.lower, self.upper, self.upper]])
        return _rotated(np.moveaxis(turned, 1, 2), -self.angle)

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Whether points lie in a slab or on its border.

        Args:
            points: in the frame of the points, shape (2, ...).

        Returns:
            Of booleans, shape (...).
        """
        x, y = _rotated(points, self.angle)[..., None]
        inside = (x >= self.edges[:-1]) & (x <= self.edges[1:]) & (y >= self.lower) & (y <= self.upper)
        return np.asarray(inside.any(axis=-1))


def _rotated(points: np.ndarray, angle: float | np.ndarray) -> np.ndarray:
    """Points turned about the origin, ``R_th p``: Omar 2012, section 4.5."""
    x, y = np.asarray(points, dtype=float)
    if np.ndim(angle):
        angle = np.asarray(angle)[:, None]
    return np.stack([np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y])


def envelope(points: np.ndarray, slabs: int = _SLABS, angle: float = 0.0) -> Envelope:
    """Envelope at an angle, ``E_th = E_0(R_th S)``: Omar 2012, (4.5.2)-(4.5.4), (4.5.12).

    A slab reaches from the last point of the slab before it to its own last point. (4.5.2) prints (i - 1) / N_p for the
    share of the points below edge i; read is (i - 1) / q.

    Args:
        points: shape (2, N_p). slabs: q, at most as many as points. angle: by which the points are turned [rad].

    Raises:
        ValueError: there are fewer points than slabs, or points that are not finite.
    """
    frame = _rotated(_checked(points, slabs), angle)
    edges, lower, upper = _slabs(frame, slabs)
    return Envelope(float(angle), edges, lower, upper)


def envelope_areas(points: np.ndarray, slabs: int = _SLABS, angles: np.ndarray | None = None) -> np.ndarray:
    """Areas A_th of the envelopes at several angles: Omar 2012, (4.5.14).

    Args:
        points: shape (2, N_p). slabs: q. angles: shape (k,) [rad]; None for one a degree from 0 to pi.

    Returns:
        Shape (k,), in the square of the points' unit.

    Raises:
        ValueError: there are fewer points than slabs, or points that are not finite.
    """
    chosen = np.linspace(0.0, np.pi, ANGLES) if angles is None else np.asarray(angles, dtype=float)
    edges, lower, upper = _slabs(_rotated(_checked(points, slabs), chosen), slabs)
    return np.asarray(np.sum(np.diff(edges) * (upper - lower), axis=-1))


def best_envelope(points: np.ndarray, slabs: int = _SLABS, angles: np.ndarray | None = None) -> Envelope:
    """Envelope at the angle of the smallest area: Omar 2012, (4.5.13).

    Args:
        points: shape (2, N_p). slabs: q. angles: among which is chosen, shape (k,) [rad]; None for one a degree from 0
            to pi.

    Raises:
        ValueError: there are fewer points than slabs, or points that are not finite.
    """
    chosen = np.linspace(0.0, np.pi, ANGLES) if angles is None else np.asarray(angles, dtype=float)
    return envelope(points, slabs, float(chosen[np.argmin(envelope_areas(points, slabs, chosen))]))


def _slabs(frame: np.ndarray, slabs: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Edges, lower and upper bounds of points in their frame, shape (2, ..., N_p); the last axis is that of slabs."""
    x, y = frame
    order = np.argsort(x, axis=-1, kind="stable")
    x, y = np.take_along_axis(x, order, axis=-1), np.take_along_axis(y, order, axis=-1)
    count = x.shape[-1]
    starts = np.arange(slabs + 1) * count // slabs
    edges = np.concatenate([x[..., :1], x[..., starts[1:] - 1]], axis=-1)
    lower = np.minimum.reduceat(y, starts[:-1], axis=-1)
    upper = np.maximum.reduceat(y, starts[:-1], axis=-1)
    return edges, lower, upper


def _checked(points: np.ndarray, slabs: int) -> np.ndarray:
    array = np.asarray(points, dtype=float)
    if array.ndim != 2 or array.shape[0] != 2:
        raise ValueError(f"an envelope needs points of shape (2, N), these have shape {array.shape}.")
    if not 1 <= slabs <= array.shape[1]:
        raise ValueError(f"{slabs} slabs for {array.shape[1]} points; each slab needs a point.")
    if not np.all(np.isfinite(array)):
        raise ValueError("a point is not finite; leave it out first.")
    return array


def line_distance(points: np.ndarray, envelope: Envelope, direction: float | np.ndarray) -> np.ndarray:
    """Distance along a line, ``d_phi = min |p - z| / mu``: Omar 2012, (4.5.15)-(4.5.16).

    z runs over what the line has in common with the envelope, and mu is the length of that. Both are computed from the
    rectangles, exactly, so that no radius of a search (4.5.17) is needed. A point in the envelope has the distance 0.

    Args:
        points: shape (2, ...). envelope: of other points. direction: phi, of the line [rad], a number or shape (k,).

    Returns:
        Shape (...), or (..., k) [1]: infinite where the line has nothing in common with the envelope, or a length of 0
        [ours: the thesis does not say].
    """
    x, y = _rotated(points, envelope.angle)[..., None, None]  # lines and slabs behind
    turned = np.atleast_1d(np.asarray(direction, dtype=float))[:, None] + envelope.angle
    last = np.arange(len(envelope.lower)) == len(envelope.lower) - 1  # a line on the border of two slabs is in one
    across = _interval(envelope.edges[:-1] - x, envelope.edges[1:] - x, np.cos(turned), last)
    along = _interval(envelope.lower - y, envelope.upper - y, np.sin(turned), np.ones_like(last))
    begin, end = np.maximum(across[0], along[0]), np.minimum(across[1], along[1])
    length = np.where(end > begin, end - begin, 0.0)
    nearest = np.where(end >= begin, np.maximum(np.maximum(begin, -end), 0.0), np.inf).min(axis=-1)
    whole = length.sum(axis=-1)
    share = np.divide(nearest, whole, out=np.full(whole.shape, np.inf), where=whole > 0.0)
    distance = np.where(nearest == 0.0, 0.0, share)
    return distance if np.ndim(direction) else distance[..., 0]


def envelope_distance(points: np.ndarray, envelope: Envelope, directions: int = _DIRECTIONS) -> np.ndarray:
    """Smallest distance over lines in all directions: Omar 2012, (4.5.18).

    Args:
        points: shape (2, ...). envelope: of other points. directions: number of lines, equally spaced from 0 to pi.

    Returns:
        Shape (...) [1]; 0 in the envelope, infinite where no line meets it.
    """
    chosen = np.arange(directions) * np.pi / directions
    return np.asarray(line_distance(points, envelope, chosen).min(axis=-1))


def _interval(
    low: np.ndarray, high: np.ndarray, slope: np.ndarray, closed: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Where ``low <= r slope <= high``; without a slope everywhere or nowhere, `high` counting where it is closed."""
    flat = np.abs(slope) < 1e-12
    safe = np.where(flat, 1.0, slope)
    first, second = low / safe, high / safe
    within = (low <= 0.0) & ((high > 0.0) | (closed & (high == 0.0)))
    unlimited = np.where(within, np.inf, -np.inf)
    return np.where(flat, -unlimited, np.minimum(first, second)), np.where(flat, unlimited, np.maximum(first, second))
