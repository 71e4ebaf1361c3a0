"""O3 as its algorithms are printed: whole parameters migrate, rare habitats mutate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from fmu_observer.design.optimisers.optimiser import Array, Optimiser


@dataclass(eq=False, repr=False, kw_only=True)
class BiogeographyPrinted(Optimiser):
    """Biogeography-based optimisation, Algorithms 3.1 and 3.2.

    Migration: habitat i is changed with probability lambda_i; then each habitat j gives it, with probability mu_j, the
    value of one parameter chosen at random. Mutation: each parameter of habitat i is drawn anew with the probability
    ``m_i = m_max (1 - P_i / P_max)``, P_i that of its number of species; P is the steady state of the linear rates with
    I = E, a binomial distribution. The best habitat is put back where it was lost.

    Algorithm 3.2 chooses a parameter "with probability P_i" before that. Read as one more factor, nothing mutates with
    more than 1 in 200, and the search stands still; so P_i acts through m_i alone, as in Simon 2008.

    Args:
        population: number of habitats. mutation: m_max.
    """

    name = "biogeography_printed"
    description = "Biogeography-based optimisation, algorithms as printed"
    source = "Allaoui 2024, Algorithms 3.1-3.2"

    population: int = 20
    mutation: float = 0.1

    def __post_init__(self) -> None:
        super().__post_init__()
        population = self.population
        species = np.arange(population, 0, -1)  # the best habitat has the most
        self._emigration = species / population
        chances = scipy.stats.binom.pmf(species, population, 0.5)
        self._rates = self.mutation * (1.0 - chances / chances.max())
        self._habitats: Array | None = None
        self._costs = np.empty(0)

    def propose(self) -> Array:
        """The habitats after migration and mutation, shape (population, d)."""
        if self._habitats is None:
            return self.uniform(self.population)
        n, d = self._habitats.shape
        moved = self._habitats.copy()
        changed = self.random.random(n) < 1.0 - self._emigration
        gives = self.random.random((n, n)) < self._emigration
        places = self.random.integers(0, d, (n, n))
        for j in range(n):  # in this order, since a later one overwrites an earlier one
            takers = np.flatnonzero(changed & gives[:, j])
            moved[takers, places[takers, j]] = self._habitats[j, places[takers, j]]
        mutates = self.random.random((n, d)) < self._rates[:, np.newaxis]
        return np.where(mutates, self.uniform(n), moved)

    def learn(self, candidates: Array, costs: Array, gradients: Array | None) -> None:
        candidates, costs = self.ranked(candidates, costs)
        if self._habitats is not None and self._costs[0] < costs[0]:
            candidates = np.concatenate([self._habitats[:1], candidates[:-1]])
            costs = np.concatenate([self._costs[:1], costs[:-1]])
        self._habitats, self._costs = candidates, costs
