"""`Optimiser`: the interface of all optimisers. It asks for costs, is told them, and can be saved between the two."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


@dataclass(eq=False, repr=False)
class Optimiser(ABC):
    """Minimises a cost over a box, one population after the other.

    ``candidates = optimiser.ask()`` gives points, shape (m, d); ``optimiser.tell(candidates, costs)`` takes their
    costs. A cost that is not a finite number counts as worse than any. All random numbers come from one generator, so
    that the seed and the costs told decide everything: a saved state is the seed and the costs, and what follows a
    restore is bit-identical.

    Args:
        lower, upper: finite bounds of the search, shape (d,).
        seed: of the generator.

    Raises:
        ValueError: a bound is missing, not finite, or not below the other; no optimiser searches without bounds.
    """

    name: ClassVar[str]
    description: ClassVar[str]
    source: ClassVar[str]

    lower: Array
    upper: Array
    seed: int = field(default=0, kw_only=True)

    def __post_init__(self) -> None:
        self.lower, self.upper = (np.atleast_1d(np.asarray(end, float)) for end in (self.lower, self.upper))
        if self.lower.ndim != 1 or self.lower.shape != self.upper.shape or not self.lower.size:
            raise ValueError(
                f"{self.name}: expected a lower and an upper bound for each parameter, got shapes {self.lower.shape} "
                f"and {self.upper.shape}."
            )
        if not (np.isfinite(self.lower).all() and np.isfinite(self.upper).all() and (self.lower < self.upper).all()):
            raise ValueError(
                f"{self.name}: bounds must be finite, the lower below the upper one (got {self.lower.tolist()} and "
                f"{self.upper.tolist()}); an optimiser does not search without bounds."
            )
        self.random = np.random.default_rng(self.seed)
        self.best: Array | None = None
        self.best_cost = np.inf
        self.evaluations = 0
        self._asked: Array | None = None
        self._reported: list[tuple[list[float], list[list[float]] | None]] = []

    @property
    def dimension(self) -> int:
        """Number of parameters d."""
        return len(self.lower)

    @property
    def iteration(self) -> int:
        """Populations with costs so far; the first is the start of the search, iteration 0 of the tables."""
        return len(self._reported)

    def ask(self) -> Array:
        """The candidates whose costs are wanted, shape (m, d), within the bounds; unchanged until their costs are in.

        Returns:
            The candidates; none, shape (0, d), where the optimiser has come to its end.
        """
        if self._asked is None:
            self._asked = np.clip(self.propose(), self.lower, self.upper)
            self._asked.setflags(write=False)
        return self._asked

    def tell(self, candidates: ArrayLike, costs: ArrayLike, gradients: ArrayLike | None = None) -> None:
        """Take the costs of the candidates asked for.

        Args:
            candidates: as `ask` gave them, shape (m, d).
            costs: their costs, shape (m,); what is not finite counts as infinite.
            gradients: of the cost at each, shape (m, d), where they are known; used by `likelihood_gradient` only.

        Raises:
            ValueError: these candidates were not asked for, or the shapes do not fit.
        """
        points, values = np.asarray(candidates, float), np.asarray(costs, float)
        if self._asked is None or not np.array_equal(points, self._asked):
            raise ValueError(f"{self.name}: these costs are of candidates that it did not ask for; call ask() first.")
        if values.shape != (len(points),):
            raise ValueError(f"{self.name}: expected {len(points)} costs, got shape {values.shape}.")
        slopes = None if gradients is None else np.asarray(gradients, float)
        if slopes is not None and slopes.shape != points.shape:
            raise ValueError(f"{self.name}: expected gradients of shape {points.shape}, got {slopes.shape}.")
        values = np.where(np.isfinite(values), values, np.inf)
        self._reported.append((values.tolist(), None if slopes is None else slopes.tolist()))
        self._asked = None
        self.evaluations += len(points)
        place = int(np.argmin(values)) if len(values) else -1
        if place >= 0 and values[place] < self.best_cost:
            self.best, self.best_cost = points[place].copy(), float(values[place])
        self.learn(points, values, slopes)

    def state(self) -> dict[str, Any]:
        """What the search so far follows from, as plain data: the seed, and the costs of its candidates."""
        costs = [{"costs": [None if np.isinf(c) else c for c in costs], "gradients": g} for costs, g in self._reported]
        return {"method": self.name, "seed": self.seed, "told": costs}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go to a saved state; what follows is bit-identical to what followed there.

        Args:
            state: from `state`, of an optimiser made with the same arguments.

        Raises:
            ValueError: the state belongs to another method or seed, or to other options; or this optimiser has costs
                already.
        """
        if (state["method"], state["seed"]) != (self.name, self.seed) or self._reported:
            raise ValueError(
                f"{self.name} with seed {self.seed}: the state is of {state['method']} with seed {state['seed']}, or "
                "the search has begun; restore into a new optimiser made with the same arguments."
            )
        for population in state["told"]:
            self.tell(self.ask(), [np.inf if c is None else c for c in population["costs"]], population["gradients"])

    def uniform(self, count: int) -> Array:
        """Points spread evenly at random over the box, shape (count, d).

        Args:
            count: how many.
        """
        return self.random.uniform(self.lower, self.upper, (count, self.dimension))

    @staticmethod
    def ranked(candidates: Array, costs: Array) -> tuple[Array, Array]:
        """Candidates and costs, the best first.

        Args:
            candidates: shape (m, d). costs: shape (m,).
        """
        order = np.argsort(costs, kind="stable")
        return candidates[order], costs[order]

    @abstractmethod
    def propose(self) -> Array:
        """The next candidates, shape (m, d); what lies outside the bounds is clipped to them."""

    @abstractmethod
    def learn(self, candidates: Array, costs: Array, gradients: Array | None) -> None:
        """Take the costs in.

        Args:
            candidates: shape (m, d). costs: shape (m,), infinite where there is none. gradients: shape (m, d), or None.
        """
