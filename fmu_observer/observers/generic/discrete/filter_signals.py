"""What a filter that carries a covariance remembers and tells, as signals. It knows no filter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fmu_observer.models.filter_models import FilterModel
from fmu_observer.observers.generic.discrete.arrivals import Arrivals
from plant_models.hybrid import OutputWarning, Signal, discrete_output
from plant_models.hybrid import memory as memory_signal

NOT_POSITIVE = discrete_output(
    "covariance_not_positive",
    "1",
    "1 once the covariance was not positive semidefinite, or a measurement left nothing of a variance",
    warning=OutputWarning(
        "rounding has made its covariance none, so its estimates or deviations mean nothing: take the form joseph or "
        "square_root, or noises and first deviations whose sizes differ less"
    ),
)


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
            memory_signal(f"estimated_{s.name}", s.unit, s.start, f"Estimate: {s.description}")
            for s in self.model.states
        ]
        found += [
            memory_signal(name, "1", np.eye(n), f"{text}, row by row, SI units", shape=(n, n)),
            memory_signal("last_innovation", "1", 0.0, "Last measured minus predicted, SI units", size=q),
            memory_signal(
                "last_innovation_covariance", "1", 0.0, "Covariance of it, row by row, SI units", shape=(q, q)
            ),
            memory_signal("last_nis", "1", 0.0, "Last normalised innovation squared"),
            memory_signal("log_likelihood", "1", 0.0, "Logarithm of the likelihood of all innovations so far"),
        ]
        found.append(memory_signal("covariance_lapsed", "1", 0.0, "1 once P was not positive, or lost a variance"))
        if self.arrivals.several:
            found.append(memory_signal("last_count", "1", 0.0, "How many measurements arrived last together"))
        if self.arrivals.timed:
            found.append(memory_signal("last_time", "s", 0.0, "Time of the estimate"))
        return tuple(found)

    def outputs(self) -> tuple[Signal, ...]:
        """Estimates, their standard deviations, innovations and how they fit."""
        n, q, found = self.model.order, len(self.model.measurements), []

        def told(name: str, unit: str, text: str, size: int | None = None) -> None:
            found.append(discrete_output(name, unit, text, size=size))

        for s in self.model.states:
            told(s.name, s.unit, f"Estimate: {s.description}")
        for s in self.model.states:
            told(f"{s.name}_std", s.unit, f"Standard deviation of the estimate: {s.description}")
        for s in self.model.measurements:
            told(f"innovation_{s.name}", s.unit, f"Last measured minus predicted: {s.description}")
        told("innovation_covariance", "1", "Covariance of the last innovation, row by row, SI units", q * q)
        told("nis", "1", "Normalised innovation squared of the last measurements")
        told("innovation_likelihood", "1", "Logarithm of the likelihood of all innovations so far")
        if self.arrivals.several:
            told("nis_degrees", "1", "Degrees of freedom of the last normalised innovation squared")
        found.append(NOT_POSITIVE)
        if self.covariances:
            told("covariance", "1", "Covariance of the estimate, row by row, SI units", n * n)
        return tuple(found)
