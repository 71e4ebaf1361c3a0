"""What all expectations share: a table of a scenario file, a check before the run, and a judgement after it."""

from __future__ import annotations

from abc import abstractmethod
from typing import TYPE_CHECKING, Annotated, Self

from pydantic import Field, model_validator

from cosim.expectations.evaluated import Evaluated
from cosim.expectations.evaluated_run import EvaluatedRun
from cosim.toml_table import TomlTable

if TYPE_CHECKING:
    from cosim.expectations.before import Before

Limit = Annotated[float, Field(ge=0.0)]
Count = Annotated[int, Field(ge=0)]


class Expectation(TomlTable):
    """An expectation. Its fields are the keys in a scenario file; ``check: Literal["..."]`` says its name there.

    Args:
        name: to show, None for what it says.
    """

    if TYPE_CHECKING:
        check: str
    name: str | None = None

    def prepare(self, before: Before) -> Self:
        """Check it against the components, before the run.

        Args:
            before: what is known then.

        Returns:
            The expectation, with what was left to us.

        Raises:
            CosimError: it names what is not there, or can never be judged.
        """
        return self

    @abstractmethod
    def evaluate(self, run: EvaluatedRun) -> list[Evaluated]:
        """Hold a run against it.

        Args:
            run: the run.

        Returns:
            An entry for each thing that it limits.

        Raises:
            NotRecordedError: what it asks for is not among the results.
        """


class WindowExpectation(Expectation):
    """An expectation that speaks of a window of time, both ends included."""

    start: float | None = Field(default=None, alias="from")
    end: float | None = Field(default=None, alias="to")

    @model_validator(mode="after")
    def _window(self) -> WindowExpectation:
        if self.start is not None and self.end is not None and not self.start < self.end:
            raise ValueError(f"'to' ({self.end:g} s) must lie behind 'from' ({self.start:g} s)")
        return self

    def prepare(self, before: Before) -> Self:
        """The window lies within the run, and holds at least one point that is recorded."""
        before.demand_window(self.start, self.end, self.first_evaluated(before))
        return self

    def first_evaluated(self, before: Before) -> float:
        """Where the window begins if ``from`` is not given [s].

        Args:
            before: what is known before the run.
        """
        return before.start


class LimitedExpectation(WindowExpectation):
    """The size of something stays within limits."""

    max: Limit | None = None
    rms: Limit | None = None

    @model_validator(mode="after")
    def _limited(self) -> LimitedExpectation:
        if self.max is None and self.rms is None:
            raise ValueError("give 'max', 'rms' or both")
        return self


class IndicatorExpectation(Expectation):
    """An expectation of an indicator, which is on above a threshold."""

    signal: str
    threshold: float | None = None

    def prepare(self, before: Before) -> Self:
        """The signal exists, and its threshold is known."""
        checked = super().prepare(before)
        before.unit(self.signal)
        if self.threshold is not None:
            return checked
        return checked.model_copy(update={"threshold": before.threshold(self.signal)})


class PairExpectation(WindowExpectation):
    """An expectation of a signal beside another one of the same dimension."""

    signal: str
    reference: str

    def prepare(self, before: Before) -> Self:
        """Both signals exist, and have one dimension."""
        super().prepare(before)
        before.demand_equal_dimension(self.signal, self.reference)
        return self
