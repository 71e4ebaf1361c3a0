"""The ensemble Kalman filter as a system."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from fmu_observer.filtering.ensemble import correct_members, inflated, mean_of, variances_of
from fmu_observer.models import ObserverModel
from fmu_observer.observers.discrete.member_filter import DEFAULT, MOST, MemberFilter
from fmu_observer.observers.model_observer import as_matrix
from plant_models.hybrid import parameter
from plant_models.hybrid.system import Array


class EnsembleKalmanFilter(MemberFilter):
    """Ensemble Kalman filter with perturbed measurements; needs no Jacobian.

    Its estimate is the mean of the members, its covariance theirs, so both carry a sampling error of
    ``1 / sqrt(2 members)`` of their size; `inflation` moves members apart before each correction, against the spread
    that small ensembles lose.

    Args:
        model: a model or the name of one in `MODELS`.
        members: how many, 2 to 50.

    Raises:
        ValueError: the model is unknown, a mode of it does not decay and is not measured, or so many members are not
            possible.
    """

    name = "ensemble_kalman_filter"
    description = "Ensemble Kalman filter, periodic measurements"
    source = "Burgers, van Leeuwen, Evensen, Monthly Weather Review 126 (1998) 1719"
    perturbs = True
    option_choices: ClassVar[Mapping[str, Sequence[Any]]] = {
        "model": ("pendulum", "linear_pendulum", "freight_train", "cart_pendulum"),
        "members": range(2, MOST + 1),
    }

    def __init__(self, model: str | ObserverModel = "pendulum", members: int = DEFAULT) -> None:
        self.gain_parameters = (
            parameter("inflation", "1", 1.0, "Factor of the members' distances from their mean", min=1.0),
        )
        super().__init__(model, members)

    def corrected(self, members: Array, more: Sequence[Array], u: Any, p: Any) -> Sequence[Array]:
        """Estimate, NIS, variances and members after the gain of the ensemble."""
        q = len(self.model.measurements)
        spread = inflated(members, p.inflation)
        RN = as_matrix(p.measurement_covariance, q, q)
        draws = np.reshape(u.measurement_normal, (q, self.members))
        after = correct_members(spread, self._seen(spread), self.measured(u), RN, draws)
        return mean_of(after.members), after.nis, variances_of(after.members), after.members
