"""CMA-ES, by the package `cma`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fmu_observer.design.optimisers.optimiser import Array, Optimiser
from plant_models.missing_package import optional_package


@dataclass(eq=False, repr=False, kw_only=True)
class CovarianceMatrixAdaptation(Optimiser):
    """Covariance matrix adaptation evolution strategy, the modern comparison; by the package `cma` of its author.

    The search runs in the unit cube, within the bounds by the transformation of that package.

    Args:
        population: candidates an iteration; None for ``4 + 3 ln d``.
        start: first mean, shape (d,); None for the middle of the box.
        step: first standard deviation, as a share of the range.

    Raises:
        ImportError: the package is not installed.
    """

    name = "cma_es"
    description = "Covariance matrix adaptation evolution strategy"
    source = "Hansen 2016, The CMA Evolution Strategy: A Tutorial; package cma"

    population: int | None = None
    start: ArrayLike | None = None
    step: float = 0.3

    def __post_init__(self) -> None:
        super().__post_init__()
        cma = optional_package("cma", "The optimiser cma_es")
        first = 0.5 * (self.lower + self.upper) if self.start is None else np.asarray(self.start, float)
        settings: dict[str, Any] = {
            "bounds": [0.0, 1.0],
            "randn": lambda *shape: self.random.standard_normal(shape),
            "seed": np.nan,  # its own generator is not used
            "verbose": -9,
            "verb_log": 0,
        }
        if self.dimension == 1:
            settings["maxstd"] = np.inf  # the package fails where it limits the only deviation there is
        if self.population is not None:
            settings["popsize"] = self.population
        unit = np.clip((first - self.lower) / (self.upper - self.lower), 0.0, 1.0)
        self._strategy = cma.CMAEvolutionStrategy(unit, self.step, settings)
        self._units: list[Array] = []

    def propose(self) -> Array:
        """A sample of the present normal distribution, shape (population, d); none where it has collapsed."""
        if self._strategy.stop():
            return np.empty((0, self.dimension))
        self._units = self._strategy.ask()
        return np.asarray(self.lower + np.array(self._units) * (self.upper - self.lower))

    def learn(self, candidates: Array, costs: Array, gradients: Array | None) -> None:
        if len(costs):
            worst = float(np.max(costs[np.isfinite(costs)], initial=0.0))
            # infinite costs would be warned of: what has none ranks behind all others
            self._strategy.tell(self._units, np.where(np.isfinite(costs), costs, 2.0 * abs(worst) + 1.0).tolist())
