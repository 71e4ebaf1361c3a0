"""O9: the Kalman filter of a linear model."""

from __future__ import annotations

from typing import Any

from fmu_observer.models.traced_system_model import Source
from fmu_observer.observers.generic.discrete.extended_kalman_filter import ExtendedKalmanFilter


class KalmanFilter(ExtendedKalmanFilter):
    """Kalman filter: Allaoui 2024, (2.1)-(2.24); Bouchama 2024, (1.33) and figure 1.1.

    Prediction ``xh(k|k-1) = A_d xh + B_d u``, ``P(k|k-1) = A_d P A_d' + QN``; correction with P(k|k) in the chosen
    form. Of an observer model A_d and B_d are the exact zero-order-hold discretisation at `sample_period`. The signals
    are those of the extended filter, whose Jacobian is A_d here. Its condition is exact: with a stabilising solution of
    the Riccati equation P converges to it from any start.

    Args:
        model: name of an observer model or of a plant, or one itself. options: those of `GaussianFilter`.

    Raises:
        ValueError: the model is nonlinear, or a mode of it does not decay and is not measured.
    """

    name = "kalman_filter"
    description = "Kalman filter of a linear model"
    source = "Allaoui 2024, (2.1)-(2.24); Bouchama 2024, (1.33)"

    def __init__(self, model: Source = "linear_pendulum", **options: Any) -> None:
        super().__init__(model, **options)
        if not self.model.linear:
            raise ValueError(
                f"{self.name}: model {self.model.name!r} is nonlinear: its transition or its measurements are not "
                "affine in the state. Use 'extended_kalman_filter', or linearise it."
            )
