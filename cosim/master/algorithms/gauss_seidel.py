"""Gauss-Seidel: one component after the other, fresh signals with the newest value."""

from __future__ import annotations

from cosim.master.algorithms.algorithm import Algorithm


class GaussSeidel(Algorithm):
    """Components in the order of the plan. A signal that is fed back to an earlier one is held over the step for all
    targets.
    """

    name = "gauss-seidel"

    def advance(self, t: float, until: float) -> None:  # noqa: D102 - see Algorithm
        for step in self.plan.steps:
            step.step(t, until)
