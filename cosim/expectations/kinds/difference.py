"""Two signals stay close to each other."""

from __future__ import annotations

from typing import Literal

from cosim.expectations.expectation import LimitedExpectation, PairExpectation
from cosim.expectations.judged import Judged
from cosim.expectations.judged_run import JudgedRun, span
from cosim.expectations.sizes import difference, judge_sizes


class DifferenceExpectation(PairExpectation, LimitedExpectation):
    """Two signals stay close to each other."""

    check: Literal["difference"]

    def judge(self, run: JudgedRun) -> list[Judged]:
        """One signal minus another."""
        error = difference(run.recorded(self.signal), run.recorded(self.reference))
        window = run.window(self.start, self.end)
        name = f"difference of {self.signal} and {self.reference}"
        return judge_sizes(name + "{}" + span(self.start, self.end), self, window, error, run.unit(self.signal))
