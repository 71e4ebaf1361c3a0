"""O8: the discrete Luenberger observer of a linear model."""

from __future__ import annotations

from fmu_observer.models.known_models import find_model
from fmu_observer.models.observer_model import ObserverModel
from fmu_observer.models.suitability import require_linear
from fmu_observer.observers.generic.discrete.extended_luenberger import ExtendedLuenberger


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
