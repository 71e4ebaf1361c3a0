"""O9: the Kalman filter of a linear model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

from fmu_observer.models import ObserverModel, find_model
from fmu_observer.models.suitability import require_linear
from fmu_observer.observers.discrete.extended_kalman_filter import ExtendedKalmanFilter


class KalmanFilter(ExtendedKalmanFilter):
    """Kalman filter: Bouchama 2024, (1.33) and figure 1.1, which name x(k|k), x(k|k-1), P(k|k), P(k|k-1) but no
    equations.

    Prediction ``xh(k|k-1) = A_d xh + B_d u``, ``P(k|k-1) = A_d P A_d' + QN`` with the exact zero-order-hold
    discretisation at `sample_period`; correction with P(k|k) in Joseph form. The signals are those of the extended
    filter, whose Jacobian is A_d here. Its condition is exact: with a stabilising solution of the Riccati equation P
    converges to it from any start.

    Raises:
        ValueError: the model is nonlinear, or a mode of it does not decay and is not measured.
    """

    name = "kalman_filter"
    description = "Kalman filter of a linear model, periodic measurements"
    source = "Bouchama 2024, (1.33), standard equations"
    option_choices: ClassVar[Mapping[str, Sequence[Any]]] = {"model": ("linear_pendulum",)}

    def __init__(self, model: str | ObserverModel = "linear_pendulum") -> None:
        chosen = find_model(model)
        require_linear(chosen, self.name, "extended_kalman_filter")
        super().__init__(chosen)
