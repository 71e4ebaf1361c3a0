"""O4: trial and error, one parameter at a time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fmu_observer.design.optimisers.optimiser import Array, Optimiser


@dataclass(eq=False, repr=False, kw_only=True)
class TrialAndError(Optimiser):
    """What a hand does: each parameter up and down by a step, the best is kept; where none is better, half the step.

    The thesis prints the values found by hand and not how; this is [ours], and known as compass search.

    Args:
        start: where to begin, shape (d,); None for the middle of the box.
        step: first step, as a share of the range of each parameter.
    """

    name = "trial_and_error"
    description = "Trial and error, one parameter at a time"
    source = "Allaoui 2024, section III.3.1 (values only); compass search"

    start: ArrayLike | None = None
    step: float = 0.25

    def __post_init__(self) -> None:
        super().__post_init__()
        middle = 0.5 * (self.lower + self.upper)
        self._centre = middle if self.start is None else np.asarray(self.start, float)
        self._steps = self.step * (self.upper - self.lower)
        self._cost: float | None = None

    def propose(self) -> Array:
        """First the start; then each parameter up and down, shape (2 d, d)."""
        if self._cost is None:
            return self._centre[np.newaxis]
        moves = np.diag(self._steps)
        return np.asarray(self._centre + np.concatenate([moves, -moves]))

    def learn(self, candidates: Array, costs: Array, gradients: Array | None) -> None:
        place = int(np.argmin(costs))
        if self._cost is None or costs[place] < self._cost:
            self._centre, self._cost = candidates[place], float(costs[place])
        else:
            self._steps = 0.5 * self._steps
