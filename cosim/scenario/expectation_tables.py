"""The tables of expectations: what a scenario may demand of its own run. `cosim.expectations` judges them."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from cosim.scenario.tables import Name, Table

Limit = Annotated[float, Field(ge=0.0)]
Count = Annotated[int, Field(ge=0)]

COUNTS = ("missed", "false", "rejected", "late", "undelivered", "used")


class Expectation(Table):
    """What all expectations share: a name to show."""

    name: str | None = None


class WindowExpectation(Expectation):
    """An expectation that speaks of a window of time, both ends included."""

    start: float | None = Field(default=None, alias="from")
    end: float | None = Field(default=None, alias="to")

    @model_validator(mode="after")
    def _window(self) -> WindowExpectation:
        if self.start is not None and self.end is not None and not self.start < self.end:
            raise ValueError(f"'to' ({self.end:g} s) must lie behind 'from' ({self.start:g} s)")
        return self


class LimitedExpectation(WindowExpectation):
    """The size of something stays within limits."""

    max: Limit | None = None
    rms: Limit | None = None

    @model_validator(mode="after")
    def _limited(self) -> LimitedExpectation:
        if self.max is None and self.rms is None:
            raise ValueError("give 'max', 'rms' or both")
        return self


class ErrorExpectation(LimitedExpectation):
    """The error of an estimate stays within limits."""

    check: Literal["speed_error", "position_error", "slip_error", "adhesion_force_error"]
    of: Name | list[Name] | None = None


class DifferenceExpectation(LimitedExpectation):
    """Two signals stay close to each other."""

    check: Literal["difference"]
    signal: str
    reference: str


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


class OnExpectation(Expectation):
    """An indicator is on at a time at the latest, from the start of the window on; one that is on there already is on
    in time.
    """

    check: Literal["on"]
    signal: str
    start: float | None = Field(default=None, alias="from")
    before: float
    threshold: float | None = None

    @model_validator(mode="after")
    def _in_order(self) -> OnExpectation:
        if self.start is not None and self.before <= self.start:
            raise ValueError(f"'before' ({self.before:g} s) must lie behind 'from' ({self.start:g} s)")
        return self


class OffExpectation(WindowExpectation):
    """An indicator never goes on."""

    check: Literal["off"]
    signal: str
    threshold: float | None = None


class TelegramsExpectation(WindowExpectation):
    """So many balise telegrams at most were missed, false, rejected, late or undelivered; so many at least were
    used.
    """

    check: Literal["telegrams"]
    of: Name | None = None
    missed: Count | None = None
    false: Count | None = None
    rejected: Count | None = None
    late: Count | None = None
    undelivered: Count | None = None
    used: Count | None = None

    @model_validator(mode="after")
    def _counted(self) -> TelegramsExpectation:
        if all(getattr(self, key) is None for key in COUNTS):
            raise ValueError("give at least one of 'missed', 'false', 'rejected', 'late', 'undelivered' and 'used'")
        return self


class CertificateExpectation(Expectation):
    """The gains of an observer are certified for the gaps that were expected and for those that occurred."""

    check: Literal["certificate"]
    of: Name | list[Name] | None = None


class WarningsExpectation(Expectation):
    """The run gave so many warnings at most."""

    check: Literal["warnings"]
    at_most: Count = 0


ExpectationItem = Annotated[
    ErrorExpectation
    | DifferenceExpectation
    | SignalExpectation
    | OnExpectation
    | OffExpectation
    | TelegramsExpectation
    | CertificateExpectation
    | WarningsExpectation,
    Field(discriminator="check"),
]
EXPECTATIONS: dict[str, type[Expectation]] = {
    **dict.fromkeys(("speed_error", "position_error", "slip_error", "adhesion_force_error"), ErrorExpectation),
    "difference": DifferenceExpectation,
    "signal": SignalExpectation,
    "on": OnExpectation,
    "off": OffExpectation,
    "telegrams": TelegramsExpectation,
    "certificate": CertificateExpectation,
    "warnings": WarningsExpectation,
}
"""Tables by what stands in ``check``."""
