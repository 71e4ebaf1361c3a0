"""What a filter that carries a covariance believes, remembers and reports, as values and signals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from fmu_observer.models.filter_models import FilterModel
from fmu_observer.observers.generic.discrete.arrivals import Arrivals
from fmu_observer.observers.model_signals import (
    LAST_NIS,
    LOG_LIKELIHOOD,
    deviation_outputs,
    estimate_outputs,
    estimate_states,
)
from plant_models.hybrid import Array, Signal, discrete_output, warning_output
from plant_models.hybrid import memory as memory_signal


class Belief(NamedTuple):
    """What a filter believes.

    Attributes:
        estimate: shape (n,). spread: its covariance, or the lower factor of it, shape (n, n). drawn: what a prediction
            hands on to the correction after it, or None.
    """

    estimate: Array
    spread: Array
    drawn: Any = None


NOT_POSITIVE = warning_output(
    "covariance_not_positive",
    "1 once the covariance was not positive semidefinite, or a measurement left nothing of a variance",
    "rounding has made its covariance none, so its estimates or deviations mean nothing: take the form joseph or "
    "square_root, or noises and first deviations whose sizes differ less",
)
_ROWS = "row by row, SI units"


@dataclass(frozen=True)
class SignalsOf:
    """Signals of a filter of a model.

    Args:
        model: the model. arrivals: how its measurements arrive. rooted: whether a factor of the covariance is carried.
        covariances: whether the whole covariance is an output.
    """

    model: FilterModel
    arrivals: Arrivals
    rooted: bool
    covariances: bool

    def memory(self) -> tuple[Signal, ...]:
        """Estimates, covariance or its factor, and what is known of the last innovation."""
        n, q = self.model.order, len(self.model.measurements)
        name = "estimate_covariance_factor" if self.rooted else "estimate_covariance"
        text = "Lower factor of the covariance P(k|k)" if self.rooted else "Covariance P(k|k)"
        found = [
            *estimate_states(self.model.states, memory_signal),
            memory_signal(name, "1", np.eye(n), f"{text}, {_ROWS}", shape=(n, n)),
            memory_signal("last_innovation", "1", 0.0, "Last measured minus predicted, SI units", size=q),
            memory_signal("last_innovation_covariance", "1", 0.0, f"Covariance of it, {_ROWS}", shape=(q, q)),
            LAST_NIS,
            LOG_LIKELIHOOD,
            memory_signal("covariance_lapsed", "1", 0.0, "1 once P was not positive, or lost a variance"),
        ]
        if self.arrivals.several:
            found.append(memory_signal("last_count", "1", 0.0, "How many measurements arrived last together"))
        if self.arrivals.timed:
            found.append(memory_signal("last_time", "s", 0.0, "Time of the estimate"))
        return tuple(found)

    def outputs(self) -> tuple[Signal, ...]:
        """Estimates, their standard deviations, innovations and how they fit."""
        model, n, q = self.model, self.model.order, len(self.model.measurements)
        found = [
            *estimate_outputs(model.states, discrete_output),
            *deviation_outputs(model.states, discrete_output),
            *(
                discrete_output(f"innovation_{s.name}", s.unit, f"Last measured minus predicted: {s.description}")
                for s in model.measurements
            ),
            discrete_output("innovation_covariance", "1", f"Covariance of the last innovation, {_ROWS}", size=q * q),
            discrete_output("nis", "1", "Normalised innovation squared of the last measurements"),
            discrete_output("innovation_likelihood", "1", "Logarithm of the likelihood of all innovations so far"),
        ]
        if self.arrivals.several:
            text = "Degrees of freedom of the last normalised innovation squared"
            found.append(discrete_output("nis_degrees", "1", text))
        found.append(NOT_POSITIVE)
        if self.covariances:
            found.append(discrete_output("covariance", "1", f"Covariance of the estimate, {_ROWS}", size=n * n))
        return tuple(found)


def chosen(begun: Array, one: Belief, other: Belief) -> Belief:
    """The one belief where a filter has begun, else the other.

    Args:
        begun: whether it has. one, other: of the same shapes.
    """

    def fields(a: Any, b: Any) -> Any:
        if a is None:
            return None
        return (
            type(a)(*(fields(*pair) for pair in zip(a, b, strict=True)))
            if isinstance(a, tuple)
            else np.where(begun, a, b)
        )

    return Belief(*(fields(*pair) for pair in zip(one, other, strict=True)))
