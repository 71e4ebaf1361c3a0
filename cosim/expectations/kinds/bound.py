"""The error of an estimate stays within the bound that is reported beside it."""

from __future__ import annotations

from dataclasses import replace
from math import inf
from typing import TYPE_CHECKING, Literal, Self

import numpy as np

from cosim.errors import ScenarioError
from cosim.expectations.evaluated import Evaluated, at, with_unit
from cosim.expectations.evaluated_run import EvaluatedRun, span
from cosim.expectations.expectation import PairExpectation
from cosim.expectations.sizes import bounded, difference
from cosim.results.shown_unit import ShownUnit

if TYPE_CHECKING:
    from cosim.expectations.before import Before


AS_PRINTED = "_as_printed"
"""How outputs end that show what a source prints, and bound nothing."""


class BoundExpectation(PairExpectation):
    """The error of a signal never exceeds a bound that another signal reports."""

    check: Literal["bound"]
    bound: str

    def prepare(self, before: Before) -> Self:
        """The three signals exist, and have one dimension."""
        super().prepare(before)
        before.demand_equal_dimension(self.signal, self.bound)
        if self.bound.endswith(AS_PRINTED):
            raise ScenarioError(
                f"'bound': {self.bound} is what its source prints, which errors may exceed; take error_bound or "
                "carried_bound of the same observer"
            )
        return self

    def evaluate(self, run: EvaluatedRun) -> list[Evaluated]:
        """The largest share of the bound that the error takes; it is broken where that exceeds 1."""
        error = np.abs(difference(run.recorded(self.signal), run.recorded(self.reference)))
        bound, window, unit = run.recorded(self.bound), run.window(self.start, self.end), run.shown(self.signal)
        name = f"{self.bound} of {self.signal} beside {self.reference}{span(self.start, self.end)}"
        share = _share(error, bound)[window.rows]
        found = bounded(name, {"check": self.check}, window, window.time, share, -inf, 1.0, ShownUnit())
        if not np.isfinite(found.measured):
            return [found]
        row = int(np.argmax(share))
        sizes = (unit.difference(float(values[window.rows][row])) for values in (error, bound))
        worst = " of ".join(with_unit(size, unit.name) for size in sizes)
        broken = int(np.count_nonzero(share > 1.0))
        text = f"at most {100.0 * found.measured:.3g} % of the bound, {worst}{at(found.when)}"
        if broken:
            text = f"broken at {broken} of {len(share)} rows, {worst}{at(found.when, 'worst at')}"
        elif window.broken:
            text += f"; {window.unreached}"
        return [replace(found, text=text)]


def _share(error: np.ndarray, bound: np.ndarray) -> np.ndarray:
    """Error in parts of the bound, above 1 exactly where it exceeds it, shape (rows,)."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        share = np.where(bound > 0.0, error / np.where(bound > 0.0, bound, 1.0), np.finfo(float).max)
    share = np.where((error == 0.0) & (bound == 0.0), 0.0, share)
    just_above = np.nextafter(1.0, 2.0)
    share = np.where(
        error > bound, np.maximum(share, just_above), np.where(error <= bound, np.minimum(share, 1.0), share)
    )
    return np.where(np.isnan(error) | np.isnan(bound), np.nan, share)
