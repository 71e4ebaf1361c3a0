"""Distance of a point to an envelope, as a share of the envelope's own extent along the line between them. NumPy; uses
the envelope and nothing else.
"""

from __future__ import annotations

import numpy as np

from fmu_observer.formulas.signatures.envelope import Envelope, rotated

_DIRECTIONS = 90
"""Lines through a point among which the smallest distance is sought: one every two degrees."""


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
    x, y = rotated(points, envelope.angle)[..., None, None]  # lines and slabs behind
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
