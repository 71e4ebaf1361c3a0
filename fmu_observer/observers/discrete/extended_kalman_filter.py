"""O11: the extended Kalman filter with exact Jacobians."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from fmu_observer.condition import Condition
from fmu_observer.design.discretisation import process_covariance
from fmu_observer.design.pole_placement import observability_matrix
from fmu_observer.design.riccati import steady_filter
from fmu_observer.filtering.kalman import correct as corrected
from fmu_observer.filtering.kalman import flattened, predicted_covariance
from fmu_observer.models import ObserverModel, find_model
from fmu_observer.models.discretisation import transition, transition_jacobian
from fmu_observer.models.linearisation import linear_part, start_of
from fmu_observer.observability import require_detectable_model
from fmu_observer.observers.discrete.sampling import at_sample, primed_memory
from fmu_observer.observers.model_observer import ModelObserver, as_matrix
from plant_models.hybrid import memory, output_signal, vector
from plant_models.hybrid.system import Array

DENSITY = 1e-2  # of the default process noise in every state [x2/s] [ours]
VARIANCE = 1e-4  # of the default measurement noise [y2] [ours]


class ExtendedKalmanFilter(ModelObserver):
    """First-order extended Kalman filter; Bouchama 2024 names it (section 1.3) and prints no equations.

    At a sample: ``xh(k|k-1)`` is the model over one period from ``xh(k-1|k-1)``, inputs held,
    ``P(k|k-1) = F P F' + QN`` with F the exact Jacobian of that transition; then ``K = P C' inv(C P C' + RN)``,
    ``xh(k|k) = xh(k|k-1) + K (y - C xh(k|k-1))`` and P(k|k) in Joseph form. The first sample corrects the start without
    a prediction. The transition follows `sample_period`; QN belongs to one period and must be given anew with another
    (`design.discretisation.process_covariance`).

    State: xh(k|k), then P(k|k) row by row; the outputs ``<x>_std`` are the roots of its diagonal. Defaults [ours]: QN
    of white noise of density 0.01 in every state, RN = 1e-4, P = I at the start.

    Raises:
        ValueError: the model is unknown, or a mode of it does not decay and is not measured.
    """

    name = "extended_kalman_filter"
    description = "Extended Kalman filter, periodic measurements"
    source = "Bouchama 2024, section 1.3, standard first-order equations"
    timing = "periodic"
    discrete = True
    internal_step = 0.1  # nothing flows between samples
    option_choices: ClassVar[Mapping[str, Sequence[Any]]] = {
        "model": ("pendulum", "linear_pendulum", "freight_train", "cart_pendulum", "cart_double_pendulum")
    }

    def __init__(self, model: str | ObserverModel = "pendulum") -> None:
        chosen = find_model(model)
        require_detectable_model(chosen, self.name)
        n, q = chosen.order, len(chosen.measurements)
        QN = process_covariance(linear_part(chosen), DENSITY * np.eye(n), chosen.sample_period)
        self.gain_parameters = (
            self.gain_parameter(
                "process_covariance", QN, "Covariance QN of the process noise of one period, row by row"
            ),
            self.gain_parameter(
                "measurement_covariance", VARIANCE * np.eye(q), "Covariance RN of the measurements, row by row"
            ),
        )
        start = tuple(map(float, np.eye(n).ravel()))
        self.extra_memory = primed_memory(
            memory("covariance", "1", start, "Covariance P(k|k), row by row, SI units", size=n * n)
        )
        self.extra_outputs = tuple(
            output_signal(f"{s.name}_std", s.unit, f"Standard deviation of the estimate: {s.description}")
            for s in chosen.states
        )
        super().__init__(chosen)
        self._jacobian = transition_jacobian(chosen)

    def jump(self, event: str, t: Array, x: Array, u: Any, p: Any) -> Array:
        """Prediction over the period since the last sample, then correction, shape (n + n^2 + 1,)."""
        n, q, known = self.model.order, len(self.model.measurements), self.known(u)
        QN, RN = as_matrix(p.process_covariance, n, n), as_matrix(p.measurement_covariance, q, q)

        def advance(values: Array) -> Array:
            F = self._jacobian(values[:n], known, p.sample_period)
            moved = transition(self.model, values[:n], known, p.sample_period)
            return vector(
                *(moved[i] for i in range(n)), *flattened(predicted_covariance(as_matrix(values[n:], n, n), F, QN))
            )

        def correct(values: Array) -> Array:
            innovation = self.measured(u) - self.model.measured(values[:n])
            after = corrected(values[:n], as_matrix(values[n:], n, n), innovation, self.model.C, RN)
            return vector(*(after.estimate[i] for i in range(n)), *flattened(after.covariance))

        return at_sample(x, advance, correct)

    def output(self, t: Array, x: Array, u: Any, p: Any) -> dict[str, Array]:
        """The estimates and their standard deviations."""
        n = self.model.order
        spreads = {
            f"{s.name}_std": np.sqrt(np.maximum(x[n + i * (n + 1)], 0.0)) for i, s in enumerate(self.model.states)
        }
        return super().output(t, x, u, p) | spreads

    def condition_of(self, p: Any) -> Condition:
        """Whether the filter linearised at the start of the estimates has a stable steady state."""
        n, q, T = self.model.order, len(self.model.measurements), float(p.sample_period)
        QN, RN = (
            as_matrix(np.asarray(p.process_covariance), n, n),
            as_matrix(np.asarray(p.measurement_covariance), q, q),
        )
        F, C = np.asarray(self._jacobian(start_of(self.model), np.zeros(len(self.model.inputs)), T)), self.model.C
        steady, matrix = steady_filter(F, C, QN, RN), observability_matrix(F, C)
        where = "" if self.model.phi is None else ", linearised at the start of the estimates"
        return Condition(
            holds=steady is not None,
            values={
                "rank": int(np.linalg.matrix_rank(matrix)),
                "order": n,
                "smallest_singular_value": float(np.linalg.svd(matrix)[1][-1]),
                "spectral_radius": np.inf if steady is None else steady.spectral_radius,
            },
            statement=f"the Riccati equation has a stabilising solution (spectral_radius of A (I - K C) < 1){where}",
            source=self.source,
        )
