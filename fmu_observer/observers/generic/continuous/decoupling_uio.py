"""The decoupling unknown-input observer: an estimate that does not feel the unknown inputs of its model."""

from __future__ import annotations

from typing import Any

import numpy as np

from fmu_observer.certificates.finding import Finding, condition_found
from fmu_observer.design.decoupling import SOURCE, decoupled_gain, decoupling, decoupling_condition, require_decoupling
from fmu_observer.models.known_models import MODELS, find_model
from fmu_observer.models.observer_model import ObserverModel, named_as
from fmu_observer.models.suitability import linear_part, with_unknown_inputs
from fmu_observer.observers.generic.continuous.decay_of_errors import NUMBERS, errors_decay
from fmu_observer.observers.model_observer import ModelObserver, as_matrix
from fmu_observer.observers.residual_outputs import residual_gain, residual_outputs, residuals
from plant_models.hybrid import Array, Signal, state

SPEED = 2.0  # [1/s] of the default poles, at -SPEED, -1.25 SPEED, -1.5 SPEED, ... [ours]


class DecouplingUio(ModelObserver):
    """Decoupling unknown-input observer ``dz = N z + G u + L y``, ``xh = z - M y``: Aguiar Cota 2019, (2.12).

    With ``M = -H (C H)^+`` and ``P = I + M C`` the filter state z follows ``P x``, which no unknown input moves. For a
    gain K, ``N = P A - K C``, ``G = P B`` and ``L = K - N M`` (the thesis leaves them open), so that the error obeys
    ``de = N e`` whatever the unknown inputs do. Written with the estimate, the same is ``dz = P (A xh + B u) - K (C xh
    - y)``. It exists where rank(C H) = rank(H) and the invariant zeros of (A, H, C) decay; these stay poles of the
    error.

    The estimate follows the measurements at once, noise included: what is decoupled cannot be filtered. The residuals
    ``r = L_r (y - C xh)`` of (2.21)-(2.25) are outputs; a fault that acts like an unknown input does not show in them.

    Defaults [ours]: poles from -2 1/s on; L_r the identity.

    Of a nonlinear model the estimate keeps phi; gains are those of the mean drift, and the condition asks for one
    Lyapunov function over all slopes. A model that declares no unknown inputs has errors of its known ones, H = B.

    Args:
        model: any model, or the name of one. numbers: of a model by name, for any train: `mass` [kg], `drag` [1/s],
            `effort` [1], and those that it is made of besides; gains and conditions follow.

    Raises:
        UnobservableError: an invariant zero does not decay; the message says in which states it lies.
        ValueError: nothing unknown acts on the model, rank(C H) < rank(H), or a number is not one of the model's.
    """

    name = "decoupling_uio"
    description = "Unknown-input observer that decouples the unknown inputs, continuous measurements"
    source = "Aguiar Cota 2019, (2.12)"
    internal_step = 5e-3
    estimate_prefix = "filter_"
    option_choices = {"model": tuple(MODELS), **NUMBERS}

    def __init__(self, model: str | ObserverModel = "coupled_vehicles", **numbers: float) -> None:
        chosen = with_unknown_inputs(find_model(model, **numbers), self.name)
        self._linear = linear_part(chosen)
        require_decoupling(self._linear, self.name)
        self._decoupling = decoupling(self._linear.A, np.asarray(chosen.H), chosen.C)
        K = decoupled_gain(self._linear, -SPEED * (1.0 + 0.25 * np.arange(chosen.order)))
        text = "Gain K of what is left free, row by row"
        self.gain_parameters = (self.gain_parameter("gain", K, text), residual_gain(chosen))
        self.extra_outputs = residual_outputs(chosen)
        super().__init__(chosen, **numbers)

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        K = as_matrix(p.gain, self.model.order, len(self.model.measurements))
        estimate = self._estimate(x, u)
        error = self.measured(u) - self.model.measured(estimate)
        return self.named_estimates(self._decoupling.P @ self.model.flow(estimate, self.known(u)) + K @ error)

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        estimate = self._estimate(x, u)
        error = self.measured(u) - self.model.measured(estimate)
        return named_as(self.model.states, estimate) | residuals(self.model, error, p)

    def condition_of(self, p: Any) -> Finding:
        """Existence by ranks and invariant zeros, and the abscissa of N for the gain in use."""
        existence = decoupling_condition(self._linear)
        K = np.asarray(as_matrix(p.gain, self.model.order, len(self.model.measurements)))
        found = errors_decay([self._decoupling.P @ A - K @ self.model.C for A in self.model.drifts])
        return condition_found(
            holds=bool(existence.holds) and found.holds,
            numbers={**existence.numbers, **found.values},
            statement=f"{existence.statement}; N = P A - K C {found.statement}",
            source=SOURCE,
        )

    def matrices(self, p: Any = None) -> dict[str, np.ndarray]:
        """N, G, L and M of (2.12), by name, for the gain in the named tuple `p`; None for the default one."""
        p = self.unpack_parameters(self.start_parameters()) if p is None else p
        K = np.asarray(as_matrix(p.gain, self.model.order, len(self.model.measurements)))
        N = self._decoupling.free - K @ self.model.C
        M = self._decoupling.M
        return {"N": N, "G": self._decoupling.P @ self.model.B, "L": K - N @ M, "M": M}

    def _estimate(self, x: Any, u: Any) -> Array:
        return self.estimates(x) - self._decoupling.M @ self.measured(u)

    def _estimates(self) -> tuple[Signal, ...]:
        starts = self._decoupling.P @ self.model.start
        return tuple(
            state(f"filter_{s.name}", s.unit, float(start), f"Filter z of: {s.description}")
            for s, start in zip(self.model.states, starts, strict=True)
        )
