"""Two signals stay close to each other."""

from __future__ import annotations

from typing import Literal

from cosim.expectations.evaluated import Evaluated
from cosim.expectations.evaluated_run import EvaluatedRun, span
from cosim.expectations.expectation import LimitedExpectation, PairExpectation
from cosim.expectations.sizes import difference, evaluate_sizes


class DifferenceExpectation(PairExpectation, LimitedExpectation):
    """Two signals stay close to each other."""

    check: Literal["difference"]

    def evaluate(self, run: EvaluatedRun) -> list[Evaluated]:
        """One signal minus another."""
        error = difference(run.recorded(self.signal), run.recorded(self.reference))
        window = run.window(self.start, self.end)
        name = f"difference of {self.signal} and {self.reference}"
        return evaluate_sizes(name + "{}" + span(self.start, self.end), self, window, error, run.shown(self.signal))
