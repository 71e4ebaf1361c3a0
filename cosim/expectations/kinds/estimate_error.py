"""The error of an estimate stays within limits."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, Self

from cosim.errors import ScenarioError
from cosim.expectations.evaluated import Evaluated
from cosim.expectations.evaluated_run import EvaluatedRun, NotRecordedError, span
from cosim.expectations.expectation import LimitedExpectation
from cosim.expectations.sizes import difference, evaluate_sizes
from cosim.results.shown_unit import ShownUnit
from cosim.toml_table import Name

if TYPE_CHECKING:
    from cosim.expectations.before import Before

ERRORS = {
    "speed_error": ("true_speed", "speed", "m/s"),
    "position_error": ("true_position", "position", "m"),
    "slip_error": ("true_slip", "slip", "1"),
    "adhesion_force_error": ("true_adhesion_force", "adhesion_force", "N"),
}
"""By check: role of the true value in the report, output of the observer, SI unit."""


class ErrorExpectation(LimitedExpectation):
    """The error of an estimate stays within limits."""

    check: Literal["speed_error", "position_error", "slip_error", "adhesion_force_error"]
    of: Name | list[Name] | None = None

    def first_evaluated(self, before: Before) -> float:
        """The start of the evaluation [s]."""
        return max(before.start, before.report.evaluate_after)

    def prepare(self, before: Before) -> Self:
        """The true value is known, and each observer estimates."""
        super().prepare(before)
        role, output, _ = ERRORS[self.check]
        if getattr(before.report, role) is None:
            raise ScenarioError(
                f'the true value is not known; say which signal it is with report.{role} = "component.signal"'
            )
        observers = before.named(self.of, before.observers, "observer")
        if not observers:
            raise ScenarioError("there is no observer; name the component that estimates with 'of'")
        for observer in observers:
            before.demand_output(observer, output)
        return self

    def evaluate(self, run: EvaluatedRun) -> list[Evaluated]:
        """Errors of the estimates of each observer, from the start of the evaluation on where no window is given."""
        role, output, unit = ERRORS[self.check]
        true = getattr(run.spec, role)
        if true is None:
            raise NotRecordedError(f"nothing measured: the report has no {role}")
        window = run.window(self.start, self.end, max(run.start, run.spec.evaluate_after))
        found = []
        for observer in [self.of] if isinstance(self.of, str) else self.of or run.spec.observers:
            error = difference(run.recorded(f"{observer}.{output}"), run.recorded(true))
            name = f"{self.check} of {observer}"
            found += evaluate_sizes(
                name + "{}" + span(self.start, self.end), self, window, error, ShownUnit(unit, kept=unit)
            )
        return found
