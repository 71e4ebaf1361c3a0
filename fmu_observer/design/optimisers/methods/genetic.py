"""O1: genetic algorithm over real strings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fmu_observer.design.optimisers.optimiser import Array, Optimiser


@dataclass(eq=False, repr=False, kw_only=True)
class Genetic(Optimiser):
    """Genetic algorithm, section III.2.1, with the numbers of III.3.2: population 100, crossover 0.8, mutation 0.01.

    The operators are named in the thesis and not chosen, so these are [ours]: real strings, parents by roulette with
    fitness ``1 / sqrt(rank)``, one-point crossover of genes (3.2), mutation of a gene to any value within the bounds,
    the best two survive. Values found in the thesis lie far outside its initial range [0, 0.1], so that range is where
    the search starts, and no bound.

    Args:
        population: number of individuals. crossover: probability that two parents are crossed. mutation: probability
            that a gene is drawn anew. elite: how many of the best survive.
        start: range of the first population, (low, high) of all parameters, as far as it lies within the bounds; None
            for the bounds.
    """

    name = "genetic"
    description = "Genetic algorithm, real strings"
    source = "Allaoui 2024, (3.1)-(3.3), section III.3.2"

    population: int = 100
    crossover: float = 0.8
    mutation: float = 0.01
    elite: int = 2
    start: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        self._members: Array | None = None
        self._costs = np.empty(0)

    def propose(self) -> Array:
        """Children, shape (population - elite, d); the elite is not evaluated again. First the whole population."""
        if self._members is None:
            if self.start is None:
                return self.uniform(self.population)
            low, high = (np.clip(end, self.lower, self.upper) for end in self.start)
            return self.random.uniform(low, high, (self.population, self.dimension))
        count, d = self.population - self.elite, self.dimension
        chances = 1.0 / np.sqrt(np.arange(1, self.population + 1))
        pairs = self.random.choice(self.population, (count, 2), p=chances / chances.sum())
        crossed = self.random.random(count) < self.crossover
        # genes from the first parent up to the point, then from the second
        points = np.where(crossed, self.random.integers(1, max(d, 2), count), d)
        first = np.arange(d) < points[:, np.newaxis]
        children = np.where(first, self._members[pairs[:, 0]], self._members[pairs[:, 1]])
        return np.where(self.random.random((count, d)) < self.mutation, self.uniform(count), children)

    def learn(self, candidates: Array, costs: Array, gradients: Array | None) -> None:
        if self._members is not None:
            candidates = np.concatenate([self._members[: self.elite], candidates])
            costs = np.concatenate([self._costs[: self.elite], costs])
        self._members, self._costs = self.ranked(candidates, costs)
