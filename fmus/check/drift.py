"""Drift: how fast an FMU leaves what the same FMU computes to a finer tolerance. It is what its solver's own errors add
up to.
"""

from __future__ import annotations

import numpy as np

from fmus.check.restoring import solver_tolerance
from fmus.check.runner import Runner
from fmus.fmi.slave import Slave

STEPS = 100
FINER = 0.01
"""Share of the tolerance that the other instance is told."""


def drift(runner: Runner) -> np.ndarray:
    """Largest difference of each output over the time since the start, shape (q,), in its unit for each second.

    The first half of the steps is left out, where a difference that does not grow would count for much.

    Args:
        runner: the instance under test.

    Raises:
        FAILURES: the FMU refuses the finer tolerance, or cannot be stepped for so long.
    """
    pattern = (runner.h,) * STEPS
    runner.begin()
    coarse = np.array(runner.steps(pattern))

    def make() -> Slave:
        component = runner.fresh()
        component.tolerance = FINER * (component.tolerance or solver_tolerance(runner))
        return component

    other = runner.twin(make)
    try:
        other.begin()
        fine = np.array(other.steps(pattern))
    finally:
        other.put_away()
    elapsed = runner.h * np.arange(1, STEPS + 1)[:, None]
    return np.asarray(np.max((np.abs(coarse - fine) / elapsed)[STEPS // 2 :], axis=0))
