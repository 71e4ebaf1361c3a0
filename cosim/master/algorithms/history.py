"""History: what the iteration of one loop took, step by step, in bounded memory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

_NUMBERS_SHOWN = 8


@dataclass(frozen=True)
class IterationSearch:
    """The iteration of one step.

    Args:
        time: end of the step [s]. residuals: scaled residual of each sweep; 1 or less is converged.
    """

    time: float
    residuals: tuple[float, ...]

    @property
    def iterations(self) -> int:
        """Number of sweeps."""
        return len(self.residuals)


@dataclass
class History:
    """All steps in numbers, the worst and the last one in full.

    Args:
        steps: number of steps. sweeps: of all of them together. largest: largest residual that was accepted.
        worst: the step with most sweeps. last: the last step.
    """

    steps: int = 0
    sweeps: int = 0
    largest: float = 0.0
    worst: IterationSearch | None = None
    last: IterationSearch | None = field(default=None)

    def add(self, search: IterationSearch) -> None:
        """A step converged.

        Args:
            search: of the step that was solved.
        """
        self.steps += 1
        self.sweeps += search.iterations
        self.largest = max(self.largest, search.residuals[-1])
        self.last = search
        if self.worst is None or search.iterations > self.worst.iterations:
            self.worst = search

    def summary(self) -> dict[str, Any]:
        """Plain data."""
        worst = self.worst
        return {
            "mean_iterations": self.sweeps / self.steps if self.steps else None,
            "max_iterations": None if worst is None else worst.iterations,
            "largest_residual": self.largest,
            "worst_step": None if worst is None else {"time": worst.time, "residuals": list(worst.residuals)},
        }


def shown(residuals: Sequence[float]) -> str:
    """A history of residuals for a message; of a long one the first and last numbers."""
    texts = [f"{r:.2g}" for r in residuals]
    if len(texts) > _NUMBERS_SHOWN:
        half = _NUMBERS_SHOWN // 2
        texts = [*texts[:half], "...", *texts[-half:]]
    return ", ".join(texts)
