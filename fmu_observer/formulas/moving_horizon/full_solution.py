"""What a window problem solved until nothing moves any more may cost, and what its solution says. Data only."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np


class WindowError(ValueError):
    """A window problem cannot be: contradictory bounds, impossible numbers, or no trajectory that keeps the bounds."""


@dataclass(frozen=True)
class Effort:
    """How much a solution may cost.

    Args:
        tolerance: largest change of a state in the last step, in its standard deviations.
        max_iterations: Gauss-Newton steps. deadline: time after which the best answer so far is given [s].
    """

    tolerance: float = 1e-6
    max_iterations: int = 50
    deadline: float = inf

    def exhausted(self, iterations: int, size: float, seconds: float) -> str:
        """Why another step is one too many; empty where it is not.

        Args:
            iterations: steps done. size: of the last one, in standard deviations. seconds: after another step.
        """
        if iterations >= self.max_iterations:
            return f"not converged in {iterations} steps, the last of {size:.3g} standard deviations"
        return f"deadline of {self.deadline:g} s after {iterations} steps" if seconds > self.deadline else ""


@dataclass(frozen=True, eq=False)
class FullSolution:
    """What the rows of a window say.

    Attributes:
        states: of each row, shape (N, n). noises: of the transitions, in standard deviations, shape (N, n).
        weights: how much each measurement counts, 1 fully, 0 not at all or absent, shape (N, q).
        covariance: of the last row, bounds left out, shape (n, n).
        cost: half the sum of the losses. residual: root of the mean square of the weighted residuals, in their
            deviations. step: largest change in the last step, in standard deviations of the last row; infinite where
            there was none.
        far, broken: as of `gauss_newton.Solution` [1].
        iterations: steps done. seconds: time that they took. active: bounds that are touched in the last row.
        converged: whether the step fell below the tolerance, or met no curvature, so that another would be zero.
        timed_out: whether the deadline came first.
        feasible: whether `states` keep bounds and transitions. reason: why it did not converge; empty where it did.
    """

    states: np.ndarray
    noises: np.ndarray
    weights: np.ndarray
    covariance: np.ndarray
    cost: float
    residual: float
    step: float
    far: float
    broken: float
    iterations: int
    seconds: float
    active: int
    converged: bool
    timed_out: bool
    feasible: bool
    reason: str = ""

    @property
    def estimate(self) -> np.ndarray:
        """State in the last row, shape (n,)."""
        return np.asarray(self.states[-1])
