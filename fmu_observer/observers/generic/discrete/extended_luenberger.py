"""The discrete Luenberger observers: extended (nonlinear), and that of linear models."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy

from fmu_observer.certificates.finding import Finding, condition_found
from fmu_observer.certificates.printed_bounds.discrete_bounds import centre_of, discrete_bound
from fmu_observer.design.pole_placement import observability_matrix, observer_gain
from fmu_observer.models.discrete_model import transition
from fmu_observer.models.known_models import find_model
from fmu_observer.models.observer_model import ObserverModel, named_as, stacked_of
from fmu_observer.models.suitability import require_linear
from fmu_observer.observability import MeasuredSystem, UnobservableError, require_observable
from fmu_observer.observers.generic.discrete.arrivals import at_sample, initialised_memory
from fmu_observer.observers.model_observer import ModelObserver, as_matrix
from plant_models.hybrid import Array, Signal, memory
from plant_models.hybrid.missing import or_else

SPEED = 2.0  # [1/s] of the default poles: exp(-SPEED T) [ours]


class ExtendedLuenberger(ModelObserver):
    """Extended Luenberger observer ``xh+ = A_d xh + B_d u + f(xh, u) + L (y - C xh)``: Bouchama 2024, (1.34)-(1.35).

    The right-hand side without the correction is the model over one sampling period, inputs held
    (`models.discretisation.transition`), so it follows `sample_period`; the gain does not, it belongs to the period it
    was designed for; where the last measurement is missing, nothing else follows. The correction is that of the last
    sample, as printed: after the sample at t_k the outputs are the
    estimate of x(t_k) from the measurements up to t_{k-1}.

    The thesis prints no condition (its LMI is in a reference). Ours is the small-gain theorem: what phi adds to the
    linear transition over a period has a Lipschitz constant below the distance of ``A_d - L C`` from the unit circle,
    in the best scaled coordinates. Default L [ours]: poles at exp(-2 T), all of them with one measurement, for the
    linear model about which phi deviates least.
    """

    name = "extended_luenberger"
    description = "Discrete Luenberger observer of a nonlinear model, periodic measurements"
    source = "Bouchama 2024, (1.34)-(1.35), condition ours"
    timing = "periodic"
    discrete = leaves_out = True
    internal_step = 0.1  # nothing flows between samples
    option_choices = {"model": ("pendulum", "linear_pendulum", "freight_train")}

    def __init__(self, model: str | ObserverModel = "pendulum") -> None:
        chosen = find_model(model)
        self.gain_parameters = (self.gain_parameter("gain", default_gain(chosen), "Gain L of one period, row by row"),)
        self.extra_memory = initialised_memory(*_innovations(chosen))
        super().__init__(chosen)

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """One period with the last correction; then the innovation is read."""
        outputs = self.model.measurements
        L = as_matrix(p.gain, self.model.order, len(outputs))

        def advance(x: Any) -> dict[str, Array]:
            moved = transition(self.model, self.estimates(x), self.known(u), p.sample_period)
            return self.named_estimates(moved + L @ stacked_of(x, outputs, "innovation_"))

        def correct(x: Any) -> dict[str, Array]:
            expected = self.model.measured(self.estimates(x))
            return named_as(outputs, or_else(self.measured(u), expected) - expected, "innovation_")

        return at_sample(x, advance, correct)

    def condition_of(self, p: Any) -> Finding:
        """The small-gain condition at the sampling period in use."""
        L, T = as_matrix(np.asarray(p.gain), self.model.order, len(self.model.measurements)), float(p.sample_period)
        found, matrix = (
            discrete_bound(self.model, L, T),
            observability_matrix(scipy.linalg.expm(centre_of(self.model) * T), self.model.C),
        )
        return condition_found(
            holds=found.holds,
            numbers={
                "rank": int(np.linalg.matrix_rank(matrix)),
                "order": self.model.order,
                "spectral_radius": found.spectral_radius,
                "lipschitz": found.lipschitz,
                "bound": found.bound,
                "scale": found.scale,
            },
            statement="A_d - L C is Schur (spectral_radius < 1), and lipschitz < bound in coordinates x_i / "
            "scale^(i-1)",
            source=self.source,
        )


class DiscreteLuenberger(ExtendedLuenberger):
    """Discrete Luenberger ``xh+ = A_d xh + B_d u + L (y - C xh)``, ``A_d - L C`` Schur: Bouchama 2024, (1.29)-(1.32).

    A_d, B_d are the exact zero-order-hold discretisation at `sample_period`, computed at every sample, so they follow
    the parameter; the gain belongs to the period it was designed for. After the sample at t_k the outputs are the
    estimate of x(t_k) from the measurements up to t_{k-1}, as printed. Default L [ours]: all poles at exp(-2 T) with
    one measurement.

    Raises:
        ValueError: the model is nonlinear.
    """

    name = "discrete_luenberger"
    description = "Discrete Luenberger observer of a linear model, periodic measurements"
    source = "Bouchama 2024, (1.29)-(1.32)"
    option_choices = {"model": ("linear_pendulum",)}

    def __init__(self, model: str | ObserverModel = "linear_pendulum") -> None:
        chosen = find_model(model)
        require_linear(chosen, self.name, "extended_luenberger")
        super().__init__(chosen)


def default_gain(model: ObserverModel) -> np.ndarray:
    """Gain L of poles at ``exp(-SPEED T)``, for the centre of the model at its own sampling period, shape (n, q).

    Raises:
        UnobservableError: a mode is not observable, or not at these instants; the message says which.
    """
    centre, T = centre_of(model), model.sample_period
    require_observable(MeasuredSystem(centre, model.C, states=tuple(s.name for s in model.states), name=model.name))
    A = scipy.linalg.expm(centre * T)
    if np.linalg.matrix_rank(observability_matrix(A, model.C)) < model.order:
        raise UnobservableError(
            f"{model.name}: samples every {T:g} s are in step with an oscillation of the model; choose another period."
        )
    spread = 0.0 if len(model.measurements) == 1 else 0.25
    return observer_gain(A, model.C, np.exp(-SPEED * T * (1.0 + spread * np.arange(model.order))))


def _innovations(model: ObserverModel) -> tuple[Signal, ...]:
    return tuple(
        memory(f"innovation_{s.name}", s.unit, 0.0, f"Measured minus estimated at the last sample: {s.description}")
        for s in model.measurements
    )
