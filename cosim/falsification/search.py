"""Points of the unit cube at which something may be smallest: points spread at random, then CMA-ES from the best of
them, again and again. NumPy and the optimisers; knows no scenarios.
"""

from __future__ import annotations

from math import inf, log

import numpy as np

from cosim.studies.distributions import unit_points
from fmu_observer.design.optimisers.methods.cma_es import CovarianceMatrixAdaptation
from plant_models.missing_package import optional_package

_JUST_BELOW = np.nextafter(1.0, 0.0)  # distributions end before a share of 1
_STEP = 0.25  # first deviation, of the range
_PATIENCE = 6  # populations without progress after which a search begins anew
_PROGRESS = 1e-3  # of the spread of the first points


class RestartedSearch:
    """Asks for points and is told their costs; the same for the same seed and costs.

    A start spreads points over the cube (Latin hypercube); CMA-ES goes on from the best of them with a deviation of a
    quarter of the range, until it has collapsed or six populations in turn were no better; then the next start follows,
    with points of its own. So a cost without any slope is searched at random by half.

    Args:
        dimension: of the cube. seed: of all that is left to chance. spread: points of a start; None for four
            populations.

    Raises:
        ImportError: the package cma is not installed.
    """

    def __init__(self, dimension: int, seed: int, spread: int | None = None) -> None:
        optional_package("cma", "A search for what breaks an expectation")  # said at once
        self._dimension, self._seed, self._starts = dimension, seed, 0
        self.population = 4 + int(3.0 * log(dimension))
        self._spread = spread or 4 * self.population
        self._climb: CovarianceMatrixAdaptation | None = None
        self._best, self._waited, self._least = inf, 0, 0.0

    def ask(self) -> np.ndarray:
        """The points whose costs are wanted next, shape (m, d), in [0, 1)."""
        if self._climb is not None:
            points = np.empty((0, self._dimension)) if self._waited > _PATIENCE else self._climb.ask()
            if len(points):
                return np.minimum(points, _JUST_BELOW)
            self._climb = None
        self._starts += 1
        return unit_points("latin", self._spread, self._dimension, self._seed + 7919 * self._starts)

    def tell(self, points: np.ndarray, costs: np.ndarray) -> None:
        """Take the costs in.

        Args:
            points: as `ask` gave them, shape (m, d). costs: the smaller the better, infinite where there is none,
                shape (m,).
        """
        least = float(np.min(costs))
        if self._climb is None:
            known = costs[np.isfinite(costs)]
            self._best, self._waited = least, 0
            self._least = _PROGRESS * float(np.ptp(known)) if len(known) else 0.0
            zero, one = np.zeros(self._dimension), np.ones(self._dimension)
            best = points[int(np.argmin(costs))]
            seed = self._seed + 7919 * self._starts
            self._climb = CovarianceMatrixAdaptation(zero, one, seed=seed, start=best, step=_STEP)
            return
        self._climb.tell(self._climb.ask(), costs)
        self._waited = 0 if least < self._best - self._least else self._waited + 1
        self._best = min(self._best, least)
