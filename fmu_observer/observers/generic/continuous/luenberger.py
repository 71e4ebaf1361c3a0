"""O1: the Luenberger observer. Uses the base of the generic observers and pole placement."""

from __future__ import annotations

from typing import Any

import numpy as np

from fmu_observer.certificates.finding import Finding, condition_found
from fmu_observer.design.pole_placement import observability_matrix, observer_gain
from fmu_observer.models.known_models import find_model
from fmu_observer.models.linear_models import linear_part
from fmu_observer.models.observer_model import ObserverModel
from fmu_observer.observers.model_observer import ModelObserver, as_matrix
from plant_models.hybrid import Array

SPEED = 2.0  # [1/s] of the default poles, at -SPEED, -1.25 SPEED, -1.5 SPEED, ... [ours]


class Luenberger(ModelObserver):
    """Luenberger observer ``dxh = A xh + B u + phi(xh, u) - L (C xh - y)``: Bouchama 2024, (1.1)-(1.5).

    For a linear model phi is zero and the error obeys ``de = (A - L C) e`` exactly. For a nonlinear one the linear part
    is that at the start of the estimates with zero inputs, and the condition holds near it only; `Thau` has the one
    that holds everywhere. Default L: real poles from -2 1/s on [ours, the thesis prints none].
    """

    name = "luenberger"
    description = "Luenberger observer, continuous measurements"
    source = "Bouchama 2024, (1.1)-(1.5)"
    internal_step = 5e-3

    def __init__(self, model: str | ObserverModel = "pendulum") -> None:
        chosen = find_model(model)
        self.gain_parameters = (self.gain_parameter("gain", self.default_gain(chosen), "Gain L, row by row"),)
        super().__init__(chosen)

    @staticmethod
    def default_gain(model: ObserverModel) -> np.ndarray:
        """Gain L of the default poles, shape (n, q).

        Raises:
            UnobservableError: a mode of the linear part is not observable; the message says which.
        """
        poles = -SPEED * (1.0 + 0.25 * np.arange(model.order))
        return observer_gain(linear_part(model), model.C, poles, tuple(s.name for s in model.states), model.name)

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        predicted = self.model.flow(self.estimates(x), self.known(u))
        return self.named_estimates(predicted - self.gain_matrix(p) @ self.innovation(x, u))

    def gain_matrix(self, p: Any) -> Array:
        """Gain L in use, shape (n, q)."""
        return as_matrix(p.gain, self.model.order, len(self.model.measurements))

    def condition_of(self, p: Any) -> Finding:
        """Observability of (A, C) by rank and smallest singular value of (1.2), and the abscissa of ``A - L C``."""
        A, C = linear_part(self.model), self.model.C
        matrix = observability_matrix(A, C)
        abscissa = float(np.linalg.eigvals(A - self.gain_matrix(p) @ C).real.max())
        return condition_found(
            holds=abscissa < 0.0,
            numbers={
                "rank": int(np.linalg.matrix_rank(matrix)),
                "order": self.model.order,
                "smallest_singular_value": float(np.linalg.svd(matrix)[1][-1]),
                "abscissa [1/s]": abscissa,
            },
            statement="A - L C is Hurwitz (abscissa < 0); poles can be placed at will where rank = order",
            source="Bouchama 2024, (1.2)-(1.5)",
            kind="exact",
        )
