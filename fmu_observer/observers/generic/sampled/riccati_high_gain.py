"""O12: continuous-discrete high-gain observer whose gain follows a Riccati-like equation. Periodic measurements."""

from __future__ import annotations

from typing import Any

import numpy as np

from fmu_observer.certificates.aperiodic import certify_sampled_error
from fmu_observer.certificates.finding import Finding, condition_found
from fmu_observer.certificates.riccati_error import RiccatiError
from fmu_observer.design.pole_placement import observability_matrix
from fmu_observer.models.known_models import find_model
from fmu_observer.models.linear_models import linear_part
from fmu_observer.models.observer_model import ObserverModel
from fmu_observer.observability import MeasuredSystem, require_observable
from fmu_observer.observers.evaluated_observer import GapCertified
from fmu_observer.observers.model_observer import ModelObserver
from plant_models.hybrid import Array, parameter, state, vector
from plant_models.hybrid.missing import is_there

THETA = 1.5  # [1/s] [ours]
_OUTPUT_WEIGHT = 0.2  # r [ours]


class RiccatiHighGain(ModelObserver, GapCertified):
    """High-gain observer at periodic samples with an information matrix S: Bouchama 2024, (1.37), theorem 6.

    Between samples ``dxh = f(xh, u)`` and ``dS = -S Q_theta S - F' S - S F`` with F the exact Jacobian of f at xh, and
    ``Q_theta = theta^2 inv(Delta) Q inv(Delta)``, ``Delta = diag(1, 1/theta, ..., 1/theta^(n-1))``; at a sample
    ``S+ = S + T C' C / r``, ``xh+ = xh - T inv(S+) C' (C xh - y) / r`` with T the sampling period.
    S is symmetric and positive definite from its start on. ``inv(S)`` obeys the equations of an extended Kalman filter
    with noise Q_theta.

    For a linear model the error dies at any period, since ``e' S e`` falls; the period must be short where the Jacobian
    at the estimate is not that between estimate and truth. Q is diagonal. Defaults: Q = I, r = 0.2, theta = 1.5 1/s, S
    = I [ours, the thesis prints none].

    Raises:
        UnobservableError: a mode of the model at its start does not show in its measurements; the message says which.
    """

    name = "riccati_high_gain"
    description = "High-gain observer at periodic samples, gain by a Riccati-like equation"
    source = "Bouchama 2024, (1.37), theorem 6"
    timing = "periodic"
    internal_step = 5e-3
    leaves_out = True

    def __init__(self, model: str | ObserverModel = "pendulum") -> None:
        chosen = find_model(model)
        n = chosen.order
        slope = np.asarray(chosen.jacobian(chosen.start, np.zeros(len(chosen.inputs))))
        names = tuple(s.name for s in chosen.states)
        require_observable(MeasuredSystem(slope, chosen.C, states=names, name=f"{self.name} of {chosen.name}"))
        self.gain_parameters = (
            parameter("theta", "1/s", THETA, "High gain", min=1e-6),
            parameter("state_weight", "1", (1.0,) * n, "Diagonal of Q", min=1e-9, size=n),
            parameter("output_weight", "1", _OUTPUT_WEIGHT, "r, the same for every measurement", min=1e-9),
        )
        text = "Upper triangle of S, row by row"
        self.extra_states = (state("information", "1", np.eye(n), text, shape=(n, n), symmetric=True),)
        super().__init__(chosen)

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        estimate, known, S = self.estimates(x), self.known(u), x.information
        F = self.model.jacobian(estimate, known)
        noise = self._noise(p)
        SF = S @ F
        change = -(S * noise) @ S - SF.T - SF
        return self.named_estimates(self.model.flow(estimate, known)) | {"information": change}

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """Correction by the sample, and its information."""
        C, weight = self.model.C, p.sample_period / p.output_weight
        S = x.information + weight * (C.T * is_there(self.measured(u)) @ C)
        step = np.linalg.solve(S, C.T @ self.innovation(x, u))
        return self.named_estimates(self.estimates(x) - weight * step) | {"information": S}

    def condition_of(self, p: Any) -> Finding:
        """Observability of the sampled linear part at the start, and its closed growth from sample to sample, S
        settled.
        """
        F = np.asarray(linear_part(self.model))
        error = self.vertex_error(F, F, p)
        gap = float(p.sample_period)
        matrix = observability_matrix(F, self.model.C)
        rank, radius = int(np.linalg.matrix_rank(matrix)), error.spectral_radius(gap)
        return condition_found(
            holds=rank == self.model.order and radius < 1.0,
            numbers={"rank": rank, "order": self.model.order, "gap [s]": gap, "spectral_radius": radius},
            statement="the model is observable and, with S settled at the gap, its error falls from sample to sample; "
            "theorem 6 asks for a short gap and theta in a bounded range, without numbers",
            source="Bouchama 2024, theorem 6",
        )

    def gap_finding(self, gap: float, p: Any) -> Finding:
        """Certificate over every pair of vertices: the slope at the estimate, which S believes, and the slope of the
        error.
        """
        drifts = self.model.drifts
        vertices = tuple(self.vertex_error(drift, believed, p) for drift in drifts for believed in drifts)
        model = (
            f"error equations of the model {self.model.name!r} with S settled at a constant period, {len(drifts)} "
            f"slope(s) of "
            "its nonlinear part for error and S, constant over a gap; the settling of S, noise and model errors are "
            "left out"
        )
        return certify_sampled_error(vertices, gap, model)

    def vertex_error(self, drift: np.ndarray, believed: np.ndarray, p: Any) -> RiccatiError:
        """Error equations where the flow has the Jacobian `drift` and S gets `believed`, each of shape (n, n)."""
        q = len(self.model.measurements)
        noise = np.diag(np.asarray(self._noise(p), dtype=float))
        levels = tuple(range(self.model.order))
        return RiccatiError.of(drift, believed, self.model.C, noise, float(p.output_weight) * np.eye(q), levels)

    # -- internals --------------------------------------------------------------------------------------------------

    def _noise(self, p: Any) -> Array:
        """Diagonal of Q_theta, shape (n,)."""
        return vector(*(p.theta ** (2 + 2 * i) for i in range(self.model.order))) * p.state_weight
