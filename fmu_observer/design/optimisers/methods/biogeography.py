"""O3: biogeography-based optimisation with blended migration, as the experiments of the thesis used it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fmu_observer.design.optimisers.optimiser import Array, Optimiser


@dataclass(eq=False, repr=False, kw_only=True)
class Biogeography(Optimiser):
    """Biogeography-based optimisation, blended: habitats move towards those from which they take.

    Immigration ``lambda = 1 - mu`` and emigration ``mu`` are linear in the rank (3.6)-(3.7), I = E = 1. A parameter of
    habitat i moves with probability lambda_i: ``X_i <- X_i + alpha (X_j - X_i)``, j by roulette on mu. Its absorption
    coefficient alpha = 0.9 stands in the experiments (III.3.2) and not in Algorithms 3.1 and 3.2, so the experiments
    cannot have used those; they are `biogeography_printed`. [Ours]: Gaussian mutation of 0.02 of the range, a fifth
    of the habitats is kept.

    Args:
        population: number of habitats. absorption: alpha. mutation: probability that a parameter mutates.
        mutation_size: standard deviation of a mutation, as a share of the range. kept: share of the habitats kept.

    Raises:
        ValueError: there are fewer than 3 habitats.
    """

    name = "biogeography"
    description = "Biogeography-based optimisation, blended migration"
    source = "Allaoui 2024, (3.6)-(3.7), section III.3.2"

    population: int = 20
    absorption: float = 0.9
    mutation: float = 0.1
    mutation_size: float = 0.02
    kept: float = 0.2

    def __post_init__(self) -> None:
        super().__post_init__()
        count = self.population
        if count < 3:
            raise ValueError(f"{self.name}: a habitat takes from others, so there are at least 3 (got {count}).")
        self._spread = self.mutation_size * (self.upper - self.lower)
        self._kept = round(self.kept * count)
        self._habitats: Array | None = None
        self._costs = np.empty(0)

    def propose(self) -> Array:
        """The habitats after migration and mutation, shape (population, d)."""
        if self._habitats is None:
            return self.uniform(self.population)
        n, shape = self.population, self._habitats.shape
        emigration = np.linspace(1.0, 0.0, n)
        chances = np.tile(emigration, (n, 1))
        np.fill_diagonal(chances, 0.0)  # nothing comes from the habitat itself
        edges = np.cumsum(chances / chances.sum(axis=1, keepdims=True), axis=1)
        moves = self.random.random(shape) < (1.0 - emigration)[:, np.newaxis]
        draws = self.random.random(shape)
        sources = np.minimum((draws[:, :, np.newaxis] >= edges[:, np.newaxis, :]).sum(axis=2), n - 1)
        taken = self._habitats[sources, np.arange(self.dimension)]
        moved = self._habitats + np.where(moves, self.absorption * (taken - self._habitats), 0.0)
        mutates = self.random.random(shape) < self.mutation
        return moved + np.where(mutates, self._spread * self.random.standard_normal(shape), 0.0)

    def learn(self, candidates: Array, costs: Array, gradients: Array | None) -> None:
        candidates, costs = self.ranked(candidates, costs)
        if self._habitats is not None:
            new = self.population - self._kept
            candidates = np.concatenate([self._habitats[: self._kept], candidates[:new]])
            costs = np.concatenate([self._costs[: self._kept], costs[:new]])
        self._habitats, self._costs = self.ranked(candidates, costs)
