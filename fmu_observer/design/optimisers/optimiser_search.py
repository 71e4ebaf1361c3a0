"""A search: an optimiser asked and told until it ends, with the best cost after each iteration."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fmu_observer.design.optimisers.optimiser import Array, Optimiser

Cost = Callable[[Array], Array]


@dataclass(frozen=True)
class Search:
    """What a search found.

    Args:
        best: the best candidate, shape (d,). cost: its cost.
        costs: best cost after each iteration, the first population is iteration 0, shape (k,).
        evaluations: costs asked for up to each iteration, shape (k,).
    """

    best: Array
    cost: float
    costs: Array
    evaluations: Array

    def evaluations_to(self, target: float) -> float:
        """Evaluations until the cost was at a target; infinite where it never was.

        Args:
            target: a cost.
        """
        there = np.flatnonzero(self.costs <= target)
        return float(self.evaluations[there[0]]) if len(there) else np.inf


def minimise(optimiser: Optimiser, cost: Cost, iterations: int) -> Search:
    """Ask and tell.

    Args:
        optimiser: new or restored.
        cost: gives the costs, shape (m,), of candidates, shape (m, d).
        iterations: after the first population.

    Returns:
        The search, shorter where the optimiser came to its end before.

    Raises:
        ValueError: no cost was finite.
    """
    costs, counts = [], []
    for _ in range(iterations + 1):
        candidates = optimiser.ask()
        if not len(candidates):
            break
        optimiser.tell(candidates, cost(candidates))
        costs.append(optimiser.best_cost)
        counts.append(optimiser.evaluations)
    if optimiser.best is None:
        raise ValueError(
            f"{optimiser.name}: none of {optimiser.evaluations} candidates has a finite cost; look at one of them "
            "alone, and at the bounds."
        )
    return Search(optimiser.best, optimiser.best_cost, np.array(costs), np.array(counts, float))
