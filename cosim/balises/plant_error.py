"""The plant's error: how far its own solver leaves open where it is, as a part of the bound of a crossing's time.

A search over redone steps ends within 1e-11 s of the trajectory it is shown. A solver with a variable step shows
another one at each restart and for each division of a step, apart by about its tolerance: what the probe saw and what
that allows add up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from fmus.check.restoring import SOLVER_FACTOR

STANDING = 1e-12
"""Below this speed [m/s] a plant stands."""


@dataclass(frozen=True)
class PlantError:
    """What the plant's solver contributes to the bound.

    Args:
        spread: how far its position was seen apart between results that differ by the solver's steps alone [m].
        tolerance: relative, of its solver; 0 where it has none, or where its steps were seen to make no difference.
        drift: how fast its position leaves what a finer tolerance gives [m/s]. start: of the run [s].
        unknown: why nothing can be said; empty where something can.
    """

    spread: float = 0.0
    tolerance: float = 0.0
    drift: float = 0.0
    start: float = 0.0
    unknown: str = ""

    def time(self, at: float, position: float, speed: float) -> float:
        """Bound of the error [s] of the time `at` [s] when it was at a position [m] with a speed [m/s]; NaN where not
        known.
        """
        if self.unknown:
            return math.nan
        solver = SOLVER_FACTOR * self.tolerance * max(abs(position), 1.0)
        return (self.spread + solver + self.drift * (at - self.start)) / max(abs(speed), STANDING)

    def words(self) -> str:
        """What it holds, for people."""
        if self.unknown:
            return f"unknown: {self.unknown}"
        parts = [f"positions {self.spread:.2g} m apart under the probe"] if self.spread else []
        parts += [f"{self.drift:.2g} m a second from what a finer tolerance gives"] if self.drift else []
        parts += [f"{SOLVER_FACTOR:g} times its tolerance of {self.tolerance:g}"] if self.tolerance else []
        return f"of the search, and of the plant's solver: {', '.join(parts) or 'nothing that is known'}"
