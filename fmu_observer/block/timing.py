"""How a runtime is driven through time, seen from its parameters: how much work a step is, and whether time can run at
all.

Reads the runtime's parameters and clock; moves nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, isfinite, ulp

import numpy as np

from plant_models.hybrid import HybridSystem, Snapshot, scalar_names
from plant_models.hybrid.noise import is_seed
from plant_models.hybrid.requirements import unfulfilled
from plant_models.hybrid.runtime import GRID_TOLERANCE

MOST_INTERNAL_STEPS = 1e9
"""Internal steps in one communication step, and instants of one periodic event, as in the exported FMU."""


class Timing:
    """Where the parameters stand that decide about the grid and the periodic events.

    Args:
        system: the hybrid system.
    """

    def __init__(self, system: HybridSystem) -> None:
        names = list(scalar_names(system.parameter_signals))
        self._system = system
        self.step_position = names.index("internal_step")
        self._offset = -len(names)  # of the parameters in a snapshot's memory
        self._seed = names.index("seed") if system.noises else None
        self._periodic = [
            (names.index(event.period), None if event.offset is None else names.index(event.offset))
            for event in system.periodic_events
        ]
        self._lengths = [self.step_position, *(period for period, _ in self._periodic)]

    def count_steps(
        self, end: float, t: float, t0: float, p: Sequence[float] | np.ndarray, ticks: Sequence[int]
    ) -> float:
        """Internal steps, or instants of one periodic event, up to `end` [s]; the larger of the two.

        Args:
            end: where time goes [s]. t, t0: where it is, and where it began [s].
            p: parameters, shape (p,). ticks: instants of each periodic event that have been.
        """
        h = float(p[self.step_position])
        count, last = (end - t) / h, end + GRID_TOLERANCE * h + 4.0 * ulp(end)  # what is due to rounding is due
        for (period, offset), tick in zip(self._periodic, ticks, strict=True):
            instant = t0 + (0.0 if offset is None else float(p[offset])) + tick * float(p[period])
            count = max(count, (last - instant) / float(p[period]))
        return count

    def plain_step(self, p: Sequence[float] | np.ndarray) -> float:
        """Communication steps up to this [s] are far from the bound, so that nobody needs to count; 0 where that is not
        sure.

        Args:
            p: values of the parameters, shape (k,).
        """
        shortest = min(map(float, map(p.__getitem__, self._lengths)))
        return (
            0.1 * MOST_INTERNAL_STEPS * shortest if GRID_TOLERANCE * float(p[self.step_position]) <= shortest else 0.0
        )

    def can_run(self, snapshot: Snapshot) -> bool:
        """Whether time can run on from a snapshot of a runtime whose time has begun."""
        p = snapshot.memory[self._offset :].tolist()
        if not all(0.0 < p[i] < inf for i in self._lengths):
            return False
        if not all(offset is None or isfinite(p[offset]) for _, offset in self._periodic):
            return False
        if self._seed is not None and not is_seed(p[self._seed]):
            return False
        if unfulfilled(self._system, snapshot.memory[self._offset :]) is not None:
            return False
        return self.count_steps(snapshot.t, snapshot.t, snapshot.t0, p, snapshot.ticks) <= MOST_INTERNAL_STEPS
