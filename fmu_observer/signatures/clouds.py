"""Coordinates and clouds: a whole experiment becomes one number, or a point of the plane, and a set of them a cloud.
NumPy on recordings.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fmu_observer.signatures.dynamic_signature import dynamic_signature
from fmu_observer.signatures.pencil import EPS, NextScaling
from fmu_observer.signatures.properties import PROPERTIES

DIRECTIONS = np.arange(180) * np.pi / 180.0
"""Directions in which two clouds are held apart: one a degree."""


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
        margin: width of the strip between them, negative where they overlap in every direction.
        normal: unit vector from the second to the first, shape (2,). threshold: of ``normal . point`` in the middle of
            the strip.
    """

    margin: float
    normal: np.ndarray
    threshold: float


def separation(first: np.ndarray, second: np.ndarray) -> Separation:
    """Widest strip between two clouds among lines of one a degree.

    The width is the distance of the convex hulls, or less by 1 % of the clouds' size at most, since the best line may
    lie half a degree beside.

    Args:
        first: shape (2, n). second: shape (2, k).
    """
    normals = np.stack([np.cos(DIRECTIONS), np.sin(DIRECTIONS)])
    normals = np.concatenate([normals, -normals], axis=1)
    above, below = (normals.T @ first).min(axis=1), (normals.T @ second).max(axis=1)
    best = int(np.argmax(above - below))
    return Separation(float(above[best] - below[best]), normals[:, best], float(0.5 * (above[best] + below[best])))
