"""The second step: how small a fault is seen over all frequencies, proven from below and bounded from above."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np

from fmu_observer.design.cone_solver import first_proven
from fmu_observer.design.residual_analysis import bands_above, minimum_gain
from fmu_observer.design.robust_residual.problem import ResidualProblem
from fmu_observer.design.robust_residual.residual_inequalities import margins, sensitivity
from fmu_observer.design.robust_residual.residual_solver import sensitivity_candidates


@dataclass(frozen=True)
class ResidualSensitivity:
    """How strongly a fault shows, over all frequencies.

    Attributes:
        proven: gamma for which (3.57) was recomputed; 0 where it holds for none.
        ceiling: least gain over all frequencies at the vertices held still; no gamma can be larger.
    """

    proven: float
    ceiling: float

    def explain(self) -> str:
        """One sentence for the user, numbers included."""
        if self.proven > 0.0:
            return f"||r|| > {self.proven:.4g} ||f|| for every fault; at most {self.ceiling:.4g} can be had."
        return (
            f"No gamma > 0 was proven over all frequencies, and none above {self.ceiling:.1g} can be. Integrators in "
            "the observer make it zero at rest: they take a persistent fault for a disturbance. Ask over a band "
            "instead."
        )


def proven_sensitivity(problem: ResidualProblem, gains: np.ndarray) -> ResidualSensitivity:
    """The largest gamma of (3.57) for given gains, over all frequencies: step 2 of Algorithm 3-2, Aguiar Cota 2019.

    Args:
        problem: vertices, channels and M. gains: K_i, shape (N, n, q).

    Returns:
        What is proven, and what no proof can exceed.

    Raises:
        ValueError: the gains have another shape. ImportError: cvxpy (extra `lmi`) is not installed.
    """
    gains = problem.gains(gains)
    ceiling = min(minimum_gain(channel) for channel in problem.fault_channels(gains))
    found = first_proven(
        sensitivity_candidates(problem, gains),
        lambda one: {"gamma squared": one[1], **margins(sensitivity(problem, gains, *one))},
    )
    return ResidualSensitivity(0.0 if found is None else sqrt(found[0][1]), ceiling)


def common_bands(problem: ResidualProblem, gains: np.ndarray, gamma: float) -> list[tuple[float, float]]:
    """The bands in which the gain from fault to residual is at least gamma at every vertex held still.

    Args:
        problem: vertices, channels and M. gains: K_i, shape (N, n, q). gamma: sensitivity.

    Returns:
        Ends of the bands [rad/s], the last one inf where it has no end.

    Raises:
        ValueError: the gains have another shape, or gamma is not positive.
    """
    common = [(0.0, np.inf)]
    for channel in problem.fault_channels(gains):
        bands = bands_above(channel, gamma)
        pairs = [(max(a, c), min(b, d)) for a, b in common for c, d in bands]
        common = [(low, high) for low, high in pairs if low < high]
    return common
