"""The decoupling unknown-input observer: an estimate that does not feel the unknown inputs of its model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from fmu_observer.condition import Condition
from fmu_observer.design.decoupling import SOURCE, decoupled_gain, decoupling, decoupling_condition, require_decoupling
from fmu_observer.models import ObserverModel, find_model
from fmu_observer.models.linearisation import start_of
from fmu_observer.observers.model_observer import ModelObserver, as_matrix
from fmu_observer.observers.residual_outputs import residual_gain, residual_outputs, residuals
from plant_models.hybrid import Signal, state
from plant_models.hybrid.system import Array

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

    Args:
        model: a linear model with unknown inputs, or the name of one.

    Raises:
        UnobservableError: an invariant zero does not decay; the message says in which states it lies.
        ValueError: the model is nonlinear, declares no unknown inputs, or rank(C H) < rank(H).
    """

    name = "decoupling_uio"
    description = "Unknown-input observer that decouples the unknown inputs, continuous measurements"
    source = "Aguiar Cota 2019, (2.12)"
    internal_step = 5e-3
    option_choices: ClassVar[Mapping[str, Sequence[Any]]] = {"model": ("coupled_vehicles", "braked_train")}

    def __init__(self, model: str | ObserverModel = "coupled_vehicles") -> None:
        chosen = find_model(model)
        require_decoupling(chosen, self.name)
        self._decoupling = decoupling(chosen.A, np.asarray(chosen.H), chosen.C)
        K = decoupled_gain(chosen, -SPEED * (1.0 + 0.25 * np.arange(chosen.order)))
        text = "Gain K of what is left free, row by row"
        self.gain_parameters = (self.gain_parameter("gain", K, text), residual_gain(chosen))
        self.extra_outputs = residual_outputs(chosen)
        super().__init__(chosen)

    def flow(self, t: Array, x: Array, u: Any, p: Any) -> Array:
        """Filter state z, shape (n,)."""
        K = as_matrix(p.gain, self.model.order, len(self.model.measurements))
        error = self.measured(u) - self.model.measured(self._estimate(x, u))
        return self._decoupling.P @ self.model.flow(self._estimate(x, u), self.known(u)) + K @ error

    def output(self, t: Array, x: Array, u: Any, p: Any) -> dict[str, Array]:
        """The estimates and the residuals."""
        estimate = self._estimate(x, u)
        found = {s.name: estimate[i] for i, s in enumerate(self.model.states)}
        return found | residuals(self.model, self.measured(u) - self.model.measured(estimate), p)

    def condition_of(self, p: Any) -> Condition:
        """Existence by ranks and invariant zeros, and the abscissa of N for the gain in use."""
        existence = decoupling_condition(self.model)
        abscissa = float(np.linalg.eigvals(self.matrices(p)["N"]).real.max())
        return Condition(
            holds=existence.holds and abscissa < 0.0,
            values={**existence.values, "abscissa": abscissa},
            statement=f"{existence.statement}; N = P A - K C is Hurwitz (abscissa < 0)",
            source=SOURCE,
        )

    def matrices(self, p: Any = None) -> dict[str, np.ndarray]:
        """N, G, L and M of (2.12), by name, for the gain in the named tuple `p`; None for the default one."""
        p = self.unpack_parameters(self.start_parameters()) if p is None else p
        K = np.asarray(as_matrix(p.gain, self.model.order, len(self.model.measurements)))
        N = self._decoupling.free - K @ self.model.C
        M = self._decoupling.M
        return {"N": N, "G": self._decoupling.P @ self.model.B, "L": K - N @ M, "M": M}

    def _estimate(self, x: Array, u: Any) -> Array:
        return self.estimates(x) - self._decoupling.M @ self.measured(u)

    def _estimates(self) -> tuple[Signal, ...]:
        starts = self._decoupling.P @ start_of(self.model)
        plain = (state(f"filter_{s.name}", s.unit, 0.0, f"Filter z of: {s.description}") for s in self.model.states)
        return tuple(replace(s, start=float(value)) for s, value in zip(plain, starts, strict=True))
