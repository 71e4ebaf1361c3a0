"""The time axis of a run: communication points are indexed, never accumulated."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class TimeAxis:
    """Communication points ``t_k = start + k * step``, k = 0 ... count, the last one included.

    Args:
        start: [s]. step: [s]. count: number of steps.
    """

    start: float
    step: float
    count: int

    def __getitem__(self, k: int) -> float:
        return self.start + k * self.step

    @property
    def stop(self) -> float:
        """The last communication point [s]."""
        return self[self.count]

    @property
    def announced_stop(self) -> float:
        """The end that is announced to components [s]: behind no step, rounded as they round it themselves."""
        return max(self.stop, self[self.count - 1] + self.step) if self.count else self.stop
