"""Descent along gradients by L-BFGS-B of SciPy, asked and told."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import ArrayLike

from fmu_observer.optimisers.optimiser import Array, Optimiser

DIFFERENCE = 1e-4  # half of the distance of central differences, as a share of the range


class _WantedError(Exception):
    """The descent needs the cost at a point that is not known yet."""

    def __init__(self, point: Array) -> None:
        super().__init__()
        self.point = point


class LikelihoodGradient(Optimiser):
    """L-BFGS-B from several starts side by side, with exact gradients where they are told.

    The cost is meant to be the negative logarithm of the innovation likelihood, whose exact gradient
    `fmu_observer.tuning.likelihood` gives; any smooth cost will do. Where no gradients are told, each candidate is
    asked for with its 2 d neighbours, and central differences take their place.

    SciPy calls the cost and cannot be asked and told, so a descent is computed anew from the costs known until it wants
    one more: the same numbers in a few milliseconds, without a thread.

    Args:
        lower, upper: bounds, shape (d,). seed: of the generator.
        starts: number of descents, from random points. start: where the first begins, shape (d,); None for a random
            point. gradients: whether they will be told.
    """

    name = "likelihood_gradient"
    description = "Gradient descent (L-BFGS-B), several starts"
    source = "Byrd, Lu, Nocedal, Zhu 1995; SciPy"

    def __init__(
        self,
        lower: ArrayLike,
        upper: ArrayLike,
        *,
        seed: int = 0,
        starts: int = 1,
        start: ArrayLike | None = None,
        gradients: bool = False,
    ) -> None:
        super().__init__(lower, upper, seed=seed)
        self._starts = (self.uniform(starts) - self.lower) / (self.upper - self.lower)
        if start is not None:
            self._starts[0] = (np.asarray(start, float) - self.lower) / (self.upper - self.lower)
        self._gradients = gradients
        self._known: dict[bytes, tuple[float, Array]] = {}
        self._wanted: list[Array] = []

    def propose(self) -> Array:
        """The next point of each descent, with its neighbours where gradients are not told; none at the end of all."""
        points = (self._next(start) for start in self._starts)
        self._wanted = [point for point in points if point is not None]
        if not self._wanted:
            return np.empty((0, self.dimension))
        units = np.stack(self._wanted)
        if not self._gradients:
            moves = DIFFERENCE * np.eye(self.dimension)
            around = np.concatenate([np.zeros((1, self.dimension)), moves, -moves])
            units = np.clip(units[:, np.newaxis] + around, 0.0, 1.0).reshape(-1, self.dimension)
        return self.lower + units * (self.upper - self.lower)

    def learn(self, candidates: Array, costs: Array, gradients: Array | None) -> None:
        """Take the costs in, see `Optimiser.learn`."""
        d, width = self.dimension, self.upper - self.lower
        for place, point in enumerate(self._wanted):
            if self._gradients:
                if gradients is None:
                    raise ValueError(f"{self.name}: made with gradients=True, told none.")
                self._known[point.tobytes()] = float(costs[place]), gradients[place] * width
                continue
            rows = slice(place * (2 * d + 1), (place + 1) * (2 * d + 1))
            units, values = (candidates[rows] - self.lower) / width, costs[rows]
            distances = np.diag(units[1 : d + 1] - units[d + 1 :])
            with np.errstate(invalid="ignore"):
                slopes = (values[1 : d + 1] - values[d + 1 :]) / distances
            self._known[point.tobytes()] = float(values[0]), slopes

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
