"""Base of the observers that a sampled measurement corrects by way of an innovation held or decaying until the next
one.

It knows models and certificates; the chain form that high-gain observers ask for is checked here.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from fmu_observer.certificates.aperiodic import certify_sampled_error, with_switching_noted
from fmu_observer.certificates.finding import Finding, as_printed, to_simulate
from fmu_observer.certificates.gap_error import GapError
from fmu_observer.certificates.gap_findings import CONSTANT_GAP
from fmu_observer.models.observer_model import ObserverModel, shift_matrix
from fmu_observer.observers.evaluated_observer import GapCertified
from fmu_observer.observers.gated_observer import GatedObserver
from fmu_observer.observers.model_observer import ModelObserver
from fmu_observer.observers.model_search import model_search
from plant_models.hybrid import Array, Signal, scalar_names, state, vector

PERIOD = "period of the samples"


class SampledObserver(ModelObserver, GatedObserver, GapCertified):
    """Base of the observers corrected at the model's own `event`, its payload the measurements, periodic or not.

    A subclass writes `flow`, `update`, `condition_of` and `vertex_error`, the error equations for one Jacobian of the
    model. What it keeps of the measurements is the state `sampled_state`, declared by `per_measurement`: a vector by
    `sampled_part`, and back by `named_part`.
    """

    timing = "event"
    sampled_state: ClassVar[str] = "innovation"
    internal_step = 5e-3

    @abstractmethod
    def vertex_error(self, drift: np.ndarray, p: Any) -> GapError:
        """Error equations where the model's flow has the Jacobian `drift`, shape (n, n)."""

    def gap_finding(self, gap: float, p: Any) -> Finding:
        """Certificate over the vertices of the model's Jacobian."""
        vertices = tuple(self.vertex_error(drift, p) for drift in self.model.drifts)
        certificate = certify_sampled_error(vertices, gap, self.error_model())
        return with_switching_noted(certificate, vertices, "slopes") if len(vertices) > 1 else certificate

    @property
    def usual_gap(self) -> float:
        """The model's own period [s]."""
        return self.model.sample_period

    def limit_findings(self, values: np.ndarray) -> Iterator[Finding]:
        """How long it may wait for a sample: bounds as printed, the exact limit, and runs beside its model."""
        p = self.unpack_parameters(values)
        exact = self.gap_finding(self.usual_gap, p).condition(CONSTANT_GAP)
        high = 4.0 * exact.limit if np.isfinite(exact.limit) else exact.value
        yield from self.printed_bounds(p)
        test = "first period at which the error grows from sample to sample, at an extreme slope"
        yield replace(exact, what=PERIOD, source=test)
        if high > 0.0:
            yield to_simulate(model_search(self, "period", high / 50.0, high, self.named_values(values)), PERIOD)

    def printed_bounds(self, p: Any) -> tuple[Finding, ...]:
        """Bounds of the sampling period that the source prints; by default that of the condition, where it has one."""
        condition = self.condition_of(p)
        gap = condition.numbers.get("longest_gap")
        return () if gap is None else (as_printed(PERIOD, gap, condition.statement, condition.source),)

    def named_values(self, values: np.ndarray) -> dict[str, float]:
        """Parameters by scalar name, those that another program sets left out.

        Args:
            values: of all parameters, shape (k,).
        """
        return dict(zip(scalar_names(self.parameter_signals), map(float, values), strict=True))

    def error_model(self) -> str:
        """The error equations of the certificate in words."""
        linear = f"error equations of the model {self.model.name!r}"
        if not self.model.slopes:
            return f"{linear}, exact if it is linear; {self.remark()}"
        count = len(self.model.slopes)
        return (
            f"{linear} at the {count} extreme slope(s) of its nonlinear part, the slope constant over a gap; "
            f"{self.remark()}"
        )

    def remark(self) -> str:
        """What else the certificate leaves out."""
        return "noise and model errors, inputs to it, are left out"

    @property
    def outputs_count(self) -> int:
        """Number of measurements, q."""
        return len(self.model.measurements)

    def levels(self) -> tuple[int, ...]:
        """Place of every estimate in its chain of derivatives, for a model in chain form."""
        return tuple(i // self.outputs_count for i in range(self.model.order))

    def sampled_part(self, x: Any) -> Array:
        """What is kept of the measurements, shape (q,)."""
        value = getattr(x, self.sampled_state)
        return vector(value) if self.outputs_count == 1 else value

    def named_part(self, values: Array) -> dict[str, Array]:
        """The way back: what is kept of the measurements, or its derivative, by name of the state.

        Args:
            values: shape (q,).
        """
        return {self.sampled_state: values[0] if self.outputs_count == 1 else values}


def per_measurement(model: ObserverModel, name: str, description: str, kind: Callable[..., Signal] = state) -> Signal:
    """A state (or memory, by `kind`) per measurement: a scalar with its unit, or a vector, with the unit if they share
    one.

    Args:
        name: of the signal. description: one line.

    Raises:
        ValueError: the model has no measurement.
    """
    units = {s.unit for s in model.measurements}
    if not units:
        raise ValueError(f"Observer model {model.name!r} has no measurement; an observer needs at least one.")
    unit = units.pop() if len(units) == 1 else "1"
    return kind(name, unit, 0.0, description, size=None if len(model.measurements) == 1 else len(model.measurements))


def check_chain(model: ObserverModel, who: str) -> int:
    """Width of the chain of a model in the normal form that high-gain observers need.

    Args:
        who: name of the observer, for the message.

    Returns:
        Number of states in a block, which is the number of measurements.

    Raises:
        ValueError: A is no block shift matrix, or the measurements are not the first block.
    """
    n, q = model.order, len(model.measurements)
    fits = q > 0 and n % q == 0
    if fits:
        fits = np.array_equal(model.A, shift_matrix(n // q, q)) and np.array_equal(model.C, np.eye(q, n))
    if not fits:
        raise ValueError(
            f"{who} does not suit the model {model.name!r}: it needs A the block shift matrix and C = [I 0], each "
            f"state the derivative of the one before and the first block measured; got A = {model.A.tolist()}, C = "
            f"{model.C.tolist()}. Put the rest into phi."
        )
    return q
