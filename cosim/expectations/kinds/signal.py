"""A signal stays within bounds."""

from __future__ import annotations

from math import inf
from typing import TYPE_CHECKING, Any, Literal, Self

from pydantic import model_validator

from cosim.expectations.evaluated import Evaluated
from cosim.expectations.evaluated_run import EvaluatedRun, span
from cosim.expectations.expectation import WindowExpectation
from cosim.expectations.sizes import bounded

if TYPE_CHECKING:
    from cosim.expectations.before import Before


class SignalExpectation(WindowExpectation):
    """A signal stays within bounds; ``final`` bounds its last value in the window."""

    check: Literal["signal"]
    signal: str
    min: float | None = None
    max: float | None = None
    final: tuple[float, float] | None = None

    @model_validator(mode="after")
    def _bounded(self) -> SignalExpectation:
        if self.min is None and self.max is None and self.final is None:
            raise ValueError("give 'min', 'max' or 'final' (lowest and highest last value)")
        if self.min is not None and self.max is not None and self.min > self.max:
            raise ValueError(f"'min' ({self.min:g}) lies above 'max' ({self.max:g})")
        if self.final is not None and self.final[0] > self.final[1]:
            raise ValueError(
                f"'final': the lowest value ({self.final[0]:g}) lies above the highest ({self.final[1]:g})"
            )
        return self

    def prepare(self, before: Before) -> Self:
        """The signal exists."""
        super().prepare(before)
        before.unit(self.signal)
        return self

    def evaluate(self, run: EvaluatedRun) -> list[Evaluated]:
        """Smallest, largest and last value of a signal."""
        values, unit, window = run.recorded(self.signal), run.shown(self.signal), run.window(self.start, self.end)
        shown, when = values[window.rows], window.time
        base: dict[str, Any] = {"check": self.check}
        name = f"{self.signal}{{}}{span(self.start, self.end)}"
        found = []
        if self.min is not None:
            found.append(bounded(name.format(", min"), base, window, when, shown, self.min, inf, unit))
        if self.max is not None:
            found.append(bounded(name.format(", max"), base, window, when, shown, -inf, self.max, unit))
        if self.final is not None:
            found.append(
                bounded(name.format(", final"), base, window, when[-1:], shown[-1:], *self.final, unit, last=True)
            )
        return found
