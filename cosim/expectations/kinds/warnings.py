"""The run gave so many warnings at most."""

from __future__ import annotations

from typing import Literal

from cosim.evaluation.summary_entries import list_entry
from cosim.expectations.evaluated import Evaluated
from cosim.expectations.evaluated_run import EvaluatedRun
from cosim.expectations.expectation import Count, Expectation

_WARNINGS_SHOWN = 3


class WarningsExpectation(Expectation):
    """The run gave so many warnings at most."""

    check: Literal["warnings"]
    at_most: Count = 0

    def evaluate(self, run: EvaluatedRun) -> list[Evaluated]:
        """The number of warnings of the run."""
        warnings = [str(text) for text in list_entry(run.result, "warnings")]
        passed = len(warnings) <= self.at_most
        text = f"{len(warnings)}, expected at most {self.at_most}"
        if not passed:
            text += (
                ": " + " | ".join(warnings[:_WARNINGS_SHOWN]) + (" | ..." if len(warnings) > _WARNINGS_SHOWN else "")
            )
        if run.result.failure is not None:
            text += "; not reached: the run ended early" if passed else ""
            passed = False
        return [Evaluated("warnings", "warnings", passed, float(len(warnings)), float(self.at_most), text=text)]
