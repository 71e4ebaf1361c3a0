"""Descent along gradients by L-BFGS-B of SciPy, asked and told."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import ArrayLike

from fmu_observer.design.optimisers.optimiser import Array, Optimiser

_DIFFERENCE = 1e-4  # half of the distance of central differences, as a share of the range


class _WantedError(Exception):
    """The descent needs the cost at a point that is not known yet."""

    def __init__(self, point: Array) -> None:
        super().__init__()
        self.point = point


@dataclass(eq=False, repr=False, kw_only=True)
class LikelihoodGradient(Optimiser):
    """L-BFGS-B from several starts side by side, with exact gradients where they are told.

    The cost is meant to be the negative logarithm of the innovation likelihood, whose exact gradient
    `fmu_observer.design.likelihood` gives; any smooth cost will do. Where no gradients are told, each candidate is
    asked for with its 2 d neighbours, and central differences take their place.

    SciPy calls the cost and cannot be asked and told, so a descent is computed anew from the costs known until it wants
    one more: the same numbers in a few milliseconds, without a thread.

    Args:
        starts: number of descents, from random points. start: where the first begins, shape (d,); None for a random
            point. gradients: whether they will be told.
    """

    name = "likelihood_gradient"
    description = "Gradient descent (L-BFGS-B), several starts"
    source = "Byrd, Lu, Nocedal, Zhu 1995; SciPy"

    starts: int = 1
    start: ArrayLike | None = None
    gradients: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        self._starts = (self.uniform(self.starts) - self.lower) / (self.upper - self.lower)
        if self.start is not None:
            self._starts[0] = (np.asarray(self.start, float) - self.lower) / (self.upper - self.lower)
        self._known: dict[bytes, tuple[float, Array]] = {}
        self._wanted: list[Array] = []

    def propose(self) -> Array:
        """The next point of each descent, with its neighbours where gradients are not told; none at the end of all."""
        points = (self._next(start) for start in self._starts)
        self._wanted = [point for point in points if point is not None]
        if not self._wanted:
            return np.empty((0, self.dimension))
        units = np.stack(self._wanted)
        if not self.gradients:
            moves = _DIFFERENCE * np.eye(self.dimension)
            around = np.concatenate([np.zeros((1, self.dimension)), moves, -moves])
            units = np.clip(units[:, np.newaxis] + around, 0.0, 1.0).reshape(-1, self.dimension)
        return np.asarray(self.lower + units * (self.upper - self.lower))

    def learn(self, candidates: Array, costs: Array, gradients: Array | None) -> None:
        count, width = 2 * self.dimension + 1, self.upper - self.lower
        for place, point in enumerate(self._wanted):
            if self.gradients:
                if gradients is None:
                    raise ValueError(f"{self.name}: made with gradients=True, told none.")
                self._known[point.tobytes()] = float(costs[place]), gradients[place] * width
                continue
            rows = slice(place * count, (place + 1) * count)
            units, values = (candidates[rows] - self.lower) / width, costs[rows]
            self._known[point.tobytes()] = float(values[0]), _slopes(units, values)

    def _next(self, start: Array) -> Array | None:
        """Where the descent from this start wants the cost next; None where it has ended."""

        def cost(point: Array) -> tuple[float, Array]:
            if point.tobytes() not in self._known:
                raise _WantedError(point.copy())
            value, slopes = self._known[point.tobytes()]
            # a wall in place of what is not finite: the line search turns back
            return (
                (value, slopes) if np.isfinite(value) and np.isfinite(slopes).all() else (1e100, np.zeros(len(point)))
            )

        try:
            scipy.optimize.minimize(cost, start, jac=True, method="L-BFGS-B", bounds=[(0.0, 1.0)] * len(start))
        except _WantedError as wanted:
            return wanted.point
        return None


def _slopes(units: Array, costs: Array) -> Array:
    """Differences around a point, shape (d,): central, or to the one neighbour that has a cost.

    Args:
        units: the point, its d upper and its d lower neighbours, shape (2 d + 1, d). costs: of them.
    """
    d = units.shape[1]
    ends = np.where(np.isfinite(costs), np.arange(2 * d + 1), 0)  # the point itself in place of one without a cost
    upper, lower, axes = ends[1 : d + 1], ends[d + 1 :], np.arange(d)
    distances = units[upper, axes] - units[lower, axes]
    moved = distances != 0.0
    return np.where(moved, (costs[upper] - costs[lower]) / np.where(moved, distances, 1.0), 0.0)
