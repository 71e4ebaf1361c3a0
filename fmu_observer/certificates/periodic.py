"""Certificate of an observer that is corrected at a fixed period while its equations change from period to period.

One Lyapunov function for all transitions over a period; found by a cone solver, recomputed in NumPy.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np

from fmu_observer.certificates.quadratic import common_quadratic_form, decrease, transition_condition


@dataclass(frozen=True)
class PeriodicStability:
    """What was found.

    Attributes:
        spectral_radius: largest factor by which the error grows in a period where the equations stay [1].
        margin: smallest recomputed decrease of the function in a period, at trace(P) = n in scaled coordinates; -inf
            where there is no candidate.
        lyapunov_matrix: P in the units of the error, shape (n, n); empty where there is none.
    """

    spectral_radius: float
    margin: float
    lyapunov_matrix: np.ndarray

    @property
    def holds(self) -> bool:
        """Whether the error vanishes, whatever the order of the transitions."""
        return self.margin > 0.0


def periodic_stability(transitions: np.ndarray) -> PeriodicStability:
    """Seek one quadratic function that falls over every one of the transitions.

    Args:
        transitions: of the error over a period, shape (count, n, n).
    """
    radius = float(np.abs(np.linalg.eigvals(transitions)).max())
    if radius >= 1.0:
        return PeriodicStability(radius, -inf, np.zeros((0, 0)))
    middle = transitions[len(transitions) // 2]
    # sizes of the components where they fall together: the eigenvectors' own
    sizes = np.abs(np.linalg.eig(middle)[1]).max(axis=1)
    condition = transition_condition(transitions * (sizes[None, :] / sizes[:, None]))
    found = common_quadratic_form(condition)
    if found is None:
        return PeriodicStability(radius, -inf, np.zeros((0, 0)))
    margin = -float(decrease(condition, found.P).max())
    return PeriodicStability(radius, margin, found.P / np.outer(sizes, sizes))
