"""Coordinates and clouds: a whole experiment becomes one number, or a point of the plane, and a set of them a cloud.
NumPy on recordings.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fmu_observer.formulas.signatures.dynamic_signature import dynamic_signature
from fmu_observer.formulas.signatures.pencil import EPS, NextScaling
from fmu_observer.formulas.signatures.properties import PROPERTIES

_DIRECTIONS = np.arange(180) * np.pi / 180.0
"""Directions in which two clouds are held apart: one a degree [rad]."""
_THIN = 1e-9
"""Range below which clouds have no extent in a direction, in units of the coordinates."""
_NORMALS = np.stack([np.cos(_DIRECTIONS), np.sin(_DIRECTIONS)])


class Coordinate(NamedTuple):
    """A property of a signature, c = (S_eps^N, r): Omar 2012, section 3.4.3.

    Attributes:
        order: N, past samples a point. quantity: key of `PROPERTIES`. eps: regularisation in the unit of the samples.
        next_scaling: ``norm`` or ``literal``.
    """

    order: int
    quantity: str
    eps: float = EPS
    next_scaling: NextScaling = "norm"

    def of(self, records: np.ndarray) -> np.ndarray:
        """Value for each record.

        Args:
            records: samples first, shape (K, ...).

        Returns:
            Shape (...).

        Raises:
            ValueError: there is no such property, or the records are too short for the order.
        """
        if self.quantity not in PROPERTIES:
            raise ValueError(f"unknown property {self.quantity!r}; use one of: {', '.join(PROPERTIES)}.")
        return PROPERTIES[self.quantity](dynamic_signature(records, self.order, self.eps, self.next_scaling))


class Separation(NamedTuple):
    """How two clouds are held apart by a line.

    Attributes:
        margin: width of the strip between them, as a share of the range of both across it; negative where they overlap
            in every direction.
        gap: the width itself, in units of the coordinates.
        normal: unit vector from the second to the first, shape (2,). threshold: of ``normal . point`` in the middle of
            the strip.
    """

    margin: float
    gap: float
    normal: np.ndarray
    threshold: float

    def turned(self) -> Separation:
        """The same with first and second exchanged."""
        return Separation(self.margin, self.gap, -self.normal, -self.threshold)


class _Extent(NamedTuple):
    """How far a cloud reaches in each of `_DIRECTIONS`.

    Attributes:
        low: smallest projection, shape (k,). high: largest, shape (k,).
    """

    low: np.ndarray
    high: np.ndarray


def extent(points: np.ndarray) -> _Extent:
    """How far a cloud reaches; of many clouds that are compared in pairs each is searched once.

    Args:
        points: shape (2, n).
    """
    projected = _NORMALS.T @ points
    return _Extent(projected.min(axis=1), projected.max(axis=1))


def separation(first: _Extent, second: _Extent) -> Separation:
    """Strip between two clouds that is widest beside their range across it, among lines of one a degree.

    As a share of that range a strip does not depend on the units of the coordinates, and clouds that lie on one line,
    since two properties agree, are not held apart by that line's thinness.

    Args:
        first: of the one cloud. second: of the other.
    """
    gaps = np.stack([first.low - second.high, second.low - first.high])
    widths = np.maximum(first.high, second.high) - np.minimum(first.low, second.low)
    shares = np.where(widths > _THIN, gaps / np.maximum(widths, _THIN), -1.0)
    order, at = np.unravel_index(int(np.argmax(shares)), shares.shape)
    margin, gap = float(shares[order, at]), float(gaps[order, at])
    if order == 0:
        return Separation(margin, gap, _NORMALS[:, at], float(0.5 * (first.low[at] + second.high[at])))
    return Separation(margin, gap, -_NORMALS[:, at], float(-0.5 * (second.low[at] + first.high[at])))
