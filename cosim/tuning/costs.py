"""Costs: what a run is reduced to when something is tuned, one number, the smaller the better. Runs nothing."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf, isfinite, log

import numpy as np

from cosim.errors import ScenarioError, nearest
from cosim.evaluation.consistency import measurement_count
from cosim.evaluation.metrics import evaluated_size
from cosim.evaluation.roles import estimation_error
from cosim.results.result import Result
from cosim.run.outcome import Outcome
from cosim.studies.measures import error_measures

KINDS = ("state", "likelihood", "nis", "expectation")


class Cost(ABC):
    """A number of a run that ended; it goes to worker processes, so it holds plain data."""

    @property
    @abstractmethod
    def text(self) -> str:
        """What it is, in words."""

    @property
    def signals(self) -> tuple[str, ...]:
        """Signals ``component.signal`` that must be recorded for it."""
        return ()

    @property
    def code(self) -> Callable[..., float]:
        """What computes it: a cost that was known before is taken over where this is unchanged."""
        return type(self).of

    @property
    def estimates(self) -> tuple[str, ...]:
        """Outputs of the observer on which it depends; none where that is not known."""
        return ()

    @abstractmethod
    def of(self, outcome: Outcome) -> float:
        """The cost.

        Args:
            outcome: of a run that reached its end.

        Raises:
            ScenarioError: the run does not show it; what is missing is named.
        """


@dataclass(frozen=True)
class StateCost(Cost):
    """Sum of mean square errors of estimates; fitness (3.10) of Allaoui 2024.

    Args:
        observer: component. pairs: estimate and true value, ``component.signal`` each; without any, the speed of the
            observer beside the true speed of the report, or its position where no speed is known.
    """

    observer: str
    pairs: Sequence[tuple[str, str]] = ()

    @property
    def text(self) -> str:
        """In words."""
        return "mean square error of the estimates"

    @property
    def signals(self) -> tuple[str, ...]:
        """Both of each pair."""
        return tuple(name for pair in self.pairs for name in pair)

    @property
    def estimates(self) -> tuple[str, ...]:
        """The estimates."""
        return tuple(estimate for estimate, _ in self.pairs) or (f"{self.observer}.speed",)

    def of(self, outcome: Outcome) -> float:
        """The cost, see `Cost.of`."""
        result = outcome.result
        errors = [_of(result, estimate) - _of(result, true) for estimate, true in self.pairs]
        if not errors:
            found = (estimation_error(result, outcome.spec, self.observer, q) for q in ("speed", "position"))
            errors = [error for error in found if error is not None][:1]
        if not errors:
            raise ScenarioError(
                f"The report of the scenario names no true speed or position that {self.observer} estimates; name "
                "estimates and true values: state:observer.current=motor.current."
            )
        rows = _evaluated(outcome)
        time = np.ascontiguousarray(result.time[rows])
        return sum(evaluated_size(time, error[rows]).rms ** 2 for error in errors)


@dataclass(frozen=True)
class LikelihoodCost(Cost):
    """Negative logarithm of the likelihood of the innovations: no true values are needed, only the filter's own words.

    Args:
        observer: component with the output `innovation_likelihood`.
    """

    observer: str

    @property
    def text(self) -> str:
        """In words."""
        return "negative log-likelihood of the innovations"

    @property
    def signals(self) -> tuple[str, ...]:
        """The accumulated log-likelihood."""
        return (f"{self.observer}.innovation_likelihood",)

    @property
    def estimates(self) -> tuple[str, ...]:
        """The accumulated log-likelihood."""
        return self.signals

    def of(self, outcome: Outcome) -> float:
        """The cost, see `Cost.of`."""
        return -float(_of(outcome.result, self.signals[0])[-1])


@dataclass(frozen=True)
class NisCost(Cost):
    """How far the mean normalised innovation squared is from the number of measurements, its expectation.

    Twice too large counts as much as twice too small: ``log(mean / q)^2``.

    Args:
        observer: component with the output `nis`. measurements: q, or None where the observer states it sample by
            sample as `nis_degrees`.
    """

    observer: str
    measurements: int | None = 1

    @property
    def text(self) -> str:
        """In words."""
        return "distance of the normalised innovation squared from its expectation"

    @property
    def signals(self) -> tuple[str, ...]:
        """The normalised innovation squared, and its degrees of freedom where they are outputs."""
        return (*self.estimates, *(() if self.measurements else (f"{self.observer}.nis_degrees",)))

    @property
    def estimates(self) -> tuple[str, ...]:
        """The normalised innovation squared."""
        return (f"{self.observer}.nis",)

    def of(self, outcome: Outcome) -> float:
        """The cost, see `Cost.of`."""
        rows = _evaluated(outcome)
        nis, *degrees = (float(np.mean(_of(outcome.result, name)[rows])) for name in self.signals)
        expected = degrees[0] if degrees else float(self.measurements or 1)
        return log(nis / expected) ** 2 if nis > 0.0 < expected and isfinite(nis) else inf


@dataclass(frozen=True)
class MeasureCost(Cost):
    """A measure of sweeps, such as ``observer.gap_error_max``.

    Args:
        name: of the measure. sign: -1 where the largest is wanted.
    """

    name: str
    sign: float = 1.0

    @property
    def text(self) -> str:
        """The measure by its name."""
        return self.name if self.sign > 0.0 else f"negative {self.name}"

    def of(self, outcome: Outcome) -> float:
        """The cost, see `Cost.of`."""
        measures = error_measures(outcome)
        if self.name not in measures:
            raise ScenarioError(f"The run has no measure {self.name!r}; {nearest(self.name, [*KINDS, *measures])}")
        return self.sign * measures[self.name]


@dataclass(frozen=True)
class ExpectationCost(Cost):
    """What an expectation of the scenario measured.

    Args:
        which: its number in the scenario, from 1, or part of its text. sign: -1 where the largest is wanted.
    """

    which: str
    sign: float = 1.0

    @property
    def text(self) -> str:
        """The expectation as it was named."""
        return f"measured by the expectation {self.which}"

    def of(self, outcome: Outcome) -> float:
        """The cost, see `Cost.of`."""
        evaluated = outcome.expectations
        found = [j for j in evaluated if self.which == str(j.number) or self.which in j.name]
        if not found:
            known = [f"{j.number} ({j.name})" for j in evaluated]
            raise ScenarioError(f"The scenario has no expectation {self.which!r}; known: {', '.join(known) or 'none'}.")
        return max(self.sign * j.measured for j in found)


@dataclass(frozen=True)
class OwnCost(Cost):
    """A function of the user.

    Args:
        function: of the outcome; with several workers one that stands in a module.
    """

    function: Callable[[Outcome], float]

    @property
    def text(self) -> str:
        """Name of the function."""
        return getattr(self.function, "__qualname__", type(self.function).__name__)

    @property
    def code(self) -> Callable[..., float]:
        """The function."""
        return self.function

    def of(self, outcome: Outcome) -> float:
        """The cost, see `Cost.of`."""
        return float(self.function(outcome))


def make_cost(
    stated: str | Cost | Callable[[Outcome], float], observer: str | None, outputs: Sequence[str] = ()
) -> Cost:
    """The cost that is meant.

    Args:
        stated: ``state``, ``state:observer.a=plant.b,observer.c=plant.d``, ``likelihood``, ``nis``,
            ``expectation:NUMBER or part of its text``, the name of a measure (``speed_error_rms``,
            ``observer.gap_error_max``), with ``-`` in front where the largest is wanted; or a function of the outcome.
        observer: the component that is tuned; None where there is none.
        outputs: names of the observer's, by which ``nis`` knows how many measurements there are.

    Raises:
        ScenarioError: it needs an observer and none is named, or it cannot be read.
    """
    if isinstance(stated, Cost):
        return stated
    if not isinstance(stated, str):
        return OwnCost(stated)
    sign, text = (-1.0, stated[1:]) if stated.startswith("-") else (1.0, stated)
    kind, colon, rest = text.partition(":")
    if kind == "expectation":
        if not rest:
            raise ScenarioError("cost expectation: say which, by number or text: expectation:1.")
        return ExpectationCost(rest.strip(), sign)
    if kind in KINDS:
        if observer is None:
            raise ScenarioError(f"The cost {kind!r} is that of an observer; name it (--observer NAME).")
        if kind == "state":
            return StateCost(observer, tuple(_pair(part, observer) for part in rest.split(",")) if colon else ())
        measurements = None if "nis_degrees" in outputs else measurement_count(outputs)
        return LikelihoodCost(observer) if kind == "likelihood" else NisCost(observer, measurements)
    if colon:
        raise ScenarioError(f"cost {stated!r}: {nearest(kind, KINDS)}")
    return MeasureCost(text if "." in text or observer is None else f"{observer}.{text}", sign)


def _pair(text: str, observer: str) -> tuple[str, str]:
    estimate, sign, true = (part.strip() for part in text.partition("="))
    if not sign or "." not in true:
        raise ScenarioError(f"cost state: expected estimate=component.signal (got {text!r}).")
    return estimate if "." in estimate else f"{observer}.{estimate}", true


def _of(result: Result, name: str) -> np.ndarray:
    names = result.table.dtype.names or ()
    if name not in names:
        raise ScenarioError(f"The run did not record {name!r}; {nearest(name, names)}")
    return result[name]


def _evaluated(outcome: Outcome) -> slice:
    """Rows that count: those from the start of the evaluation on."""
    return slice(int(np.searchsorted(outcome.result.time, outcome.spec.evaluate_after)), None)
