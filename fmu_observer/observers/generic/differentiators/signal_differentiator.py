"""Base of the differentiators as systems: their signals, their outputs and what they ask of the signal.

It knows hybrid systems, and nothing of the equations of a differentiator.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, ClassVar

from fmu_observer.certificates.finding import Finding, condition_found
from fmu_observer.formulas.differentiation.differentiator_gains import LEVANT_GAINS
from fmu_observer.observers.evaluated_observer import EvaluatedObserver
from plant_models.hybrid import Array, Signal, discrete_output, input_signal, memory, output_signal, parameter, state
from plant_models.hybrid.option import require_whole

LARGEST = len(LEVANT_GAINS) - 1
FILTERED = {"order": (0, 1, 2), "filtering_order": tuple(range(1, LARGEST))}
"""Choices of a differentiator that filters."""


class SignalDifferentiator(EvaluatedObserver):
    """Base of the differentiators of one scalar signal f with ``|f^(n+1)| <= L``.

    The contract: a subclass sets `discrete` where the estimates are memory and `least_filtering` where it needs filter
    states, gives the filter states and further signals
    to ``super().__init__``, and writes `flow` or `jump`, and `accuracy`. The filter states are `filters`, the estimates
    of f and its n derivatives `estimates`.

    Between communication points the signal is held. Evaluations more frequent than the signal is renewed see a
    staircase: keep the interval between evaluations (internal step or sampling period) equal to the interval at which
    the signal comes.

    Args:
        order: number n of derivatives.
        filtering_order: number nf of filter states; n + nf is at most 5.
        unit: unit of the signal; its derivatives have ``unit/s``, ``unit/s2``, ...
        extra_parameters, extra_memory: further declarations of the subclass.

    Raises:
        ValueError: no gains are tabulated for n + nf, or an order is not a whole number.
    """

    discrete: ClassVar[bool] = False
    least_filtering: ClassVar[int] = 0

    def __init__(
        self,
        order: int,
        filtering_order: int,
        unit: str,
        *,
        extra_parameters: tuple[Signal, ...] = (),
        extra_memory: tuple[Signal, ...] = (),
    ) -> None:
        require_whole(self.name, 0, order=order, filtering_order=filtering_order)
        if filtering_order < self.least_filtering:
            least = f"at least {self.least_filtering}; levant_differentiator has none"
            raise ValueError(f"{self.name}: filtering order {filtering_order}, expected {least}.")
        if order + filtering_order > LARGEST:
            expected = f"whole numbers from 0 on with a sum of at most {LARGEST}, for which gains are tabulated"
            raise ValueError(f"{self.name}: order {order} with filtering order {filtering_order}: expected {expected}.")
        self.order, self.filtering_order = order, filtering_order
        kind = memory if self.discrete else state
        units = [_rate_unit(unit, i) for i in range(-filtering_order, order + 1)]
        self.filters = [kind(f"filter_{i + 1}", units[i], 0.0, f"Filter state {i + 1}") for i in range(filtering_order)]
        names = ["value", *(f"derivative_{i}" for i in range(1, order + 1))]
        words = ["the signal", *(f"its derivative {i}" for i in range(1, order + 1))]
        described = list(zip(names, units[filtering_order:], words, strict=True))
        self.estimates = [kind(f"estimated_{name}", u, 0.0, f"Estimate of {text}") for name, u, text in described]
        self.states = (*self.filters, *self.estimates, *extra_memory)
        self.inputs = (input_signal("signal", unit, 0.0, "Signal to differentiate"),)
        output = discrete_output if self.discrete else output_signal
        self.outputs = tuple(output(name, u, f"Estimate of {text}") for name, u, text in described)
        what = f"Bound L of derivative {order + 1} of the signal"
        bound = parameter("bound", _rate_unit(unit, order + 1), 1.0, what, min=1e-12)
        self.parameters = (bound, *extra_parameters)
        filters_too = {"filtering_order": filtering_order} if filtering_order else {}
        super().__init__(order=order, unit=unit, **filters_too)

    @abstractmethod
    def interval(self, p: Any) -> float:
        """Time between two evaluations [s]: the internal step, or the sampling period."""

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return {s.name: getattr(x, f"estimated_{s.name}") for s in self.outputs}

    def condition_of(self, p: Any) -> Finding:
        """What the differentiator asks of its signal, and how well it can do, for the parameters in use.

        The gains are tabulated ones, whose convergence in finite time is Levant's theorem; so the condition is one on
        the signal:
        L bounds its derivative n + 1. `unit_sine_rate` is the largest rate [rad/s] of a sine of amplitude 1 that is
        within L, and ``chatter_i = L h^(n+1-i)`` the size of the error of derivative i that a time h between
        evaluations leaves.
        """
        bound, h, n = float(p.bound), self.interval(p), self.order
        chatter = {f"chatter_{i}": bound * h ** (n + 1 - i) for i in range(n + 1)}
        return condition_found(
            holds=bound > 0.0,
            numbers={
                "order": n,
                "filtering_order": self.filtering_order,
                "bound": bound,
                "interval [s]": h,
                "unit_sine_rate [rad/s]": max(bound, 0.0) ** (1.0 / (n + 1)),
                **chatter,
            },
            statement="bound > 0, and the signal's derivative of order n + 1 stays within it",
            source=self.source,
        )


def _rate_unit(unit: str, order: int) -> str:
    """Unit of a derivative of a signal; negative orders are integrals."""
    if order == 0:
        return unit
    power = "" if abs(order) == 1 else str(abs(order))
    if order > 0:
        return f"{unit}/s{power}"
    return f"s{power}" if unit == "1" else f"s{power}.{unit}"
