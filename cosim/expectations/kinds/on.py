"""An indicator is on in time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from cosim.expectations.evaluated import Evaluated, written
from cosim.expectations.evaluated_run import EvaluatedRun, span
from cosim.expectations.expectation import IndicatorExpectation
from cosim.expectations.indicator_levels import ROUNDING, TINY, first_on, held, threshold_of

if TYPE_CHECKING:
    from cosim.expectations.before import Before


class OnExpectation(IndicatorExpectation):
    """An indicator is on at a time at the latest, from the start of the window on; one that is on there already is on
    in time.
    """

    check: Literal["on"]
    start: float | None = Field(default=None, alias="from")
    before: float

    @model_validator(mode="after")
    def _in_order(self) -> OnExpectation:
        if self.start is not None and self.before <= self.start:
            raise ValueError(f"'before' ({self.before:g} s) must lie behind 'from' ({self.start:g} s)")
        return self

    def prepare(self, before: Before) -> Self:
        """The instants lie within the run, the signal exists, and its threshold is known."""
        before.demand_within("from", self.start)
        before.demand_within("before", self.before)
        return super().prepare(before)

    def evaluate(self, run: EvaluatedRun) -> list[Evaluated]:
        """On at `before` at the latest; an indicator that is on when the window begins is on in time."""
        name = f"{self.signal} on by {written(self.before)} s{span(self.start, None)}"
        values, threshold = run.recorded(self.signal), threshold_of(self.signal, self.threshold)
        start = run.start if self.start is None else self.start
        first = first_on(run.result.time, values, threshold, start)
        window = run.window(self.start, self.before)
        common: dict[str, Any] = {"check": self.check, "limit": self.before, "unit": "s"}
        if first is None or (
            first > self.before + ROUNDING * max(1.0, abs(self.before)) and window.reached < self.before
        ):
            text = window.unreached if window.reached < self.before else "never on"
            _, shown = held(run.result.time, values, start, self.before)
            level = float(np.nanmax(shown, initial=-np.inf))
            common["margin"] = -1.0 - max(threshold - level, 0.0) / (abs(threshold) or 1.0)
            return [Evaluated(name, passed=False, text=f"{text} (threshold {written(threshold)})", **common)]
        passed = first <= self.before + ROUNDING * max(1.0, abs(self.before))
        already = " already, when the window begins" if first == start else ""
        text = f"on at {written(first, 's')}{already}, expected by {written(self.before, 's')}"
        margin = (self.before - first) / max(self.before - start, TINY)
        common["margin"] = max(margin, 0.0) if passed else margin
        return [Evaluated(name, passed=passed, measured=first, when=first, text=text, **common)]
