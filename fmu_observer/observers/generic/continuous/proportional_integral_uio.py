"""The proportional-integral unknown-input observer: it estimates the unknown inputs of its model as states."""

from __future__ import annotations

import re
from functools import reduce
from typing import Any

import numpy as np

from fmu_observer.certificates.finding import Finding, condition_found
from fmu_observer.design.extended_disturbance import check_rho, extended_gain, extended_matrices
from fmu_observer.design.pole_placement import observability_matrix
from fmu_observer.models.known_models import MODELS, find_model
from fmu_observer.models.observer_model import ObserverModel, named_as, stacked_of
from fmu_observer.models.suitability import linear_part, with_unknown_inputs
from fmu_observer.observers.generic.continuous.decay_of_errors import NUMBERS, errors_decay
from fmu_observer.observers.model_observer import ModelObserver, as_matrix
from fmu_observer.observers.residual_outputs import residual_gain, residual_outputs, residuals
from plant_models.hybrid import Array, output_signal, state

SPEED = 2.0  # [1/s] of the default poles, at -SPEED, -1.25 SPEED, -1.5 SPEED, ... [ours]
_PUBLISHED_GAIN = (101.4, 2650.0, 3750.0)  # poles -50, -50 and -1.5 1/s
PUBLISHED_START = {"estimated_speed": 30.0, "estimated_disturbance": -0.91, "estimated_disturbance_rate": 0.13}
LARGEST = 3  # of rho


class ProportionalIntegralUio(ModelObserver):
    """Proportional-integral observer ``dxh_e = A_e xh_e + B_e u + L (y - C_e xh_e)``: Aguiar Cota 2019, (2.13)-(2.17).

    The unknown inputs d and their derivatives up to the (rho - 1)-th are states, ``d^(rho) = 0``: rho = 1 believes in a
    constant disturbance, rho = 2 in a ramp. The error obeys ``de = (A_e - L C_e) e`` but for ``d^(rho)``, which moves
    it. It needs an observable extended pair: (A, C) observable, and no invariant zero of (A, H, C) at the origin; of
    rank(C H) nothing is asked. The residuals ``r = L_r (y - C xh)`` of (2.21)-(2.25) are outputs; a fault that persists
    is taken for a disturbance, so they show how it begins.

    Defaults [ours]: poles from -2 1/s on; L_r the identity. The preset ``as_published``, of the model ``braked_train``
    with rho = 2, has gain and starts of 3.2.3: poles -50, -50 and -1.5 1/s, so it asks for internal steps of 1 to 2 ms
    and for a speed that comes as often.

    Of a nonlinear model the estimate keeps phi; gains are those of the mean drift, and the condition asks for one
    Lyapunov function over all slopes. A model that declares no unknown inputs has errors of its known ones, H = B.

    Args:
        model: any model, or the name of one. rho: how many of d, d' and so on are states. numbers: of a model by name,
            for any train: `mass` [kg], `drag` [1/s], `effort` [1], and those that it is made of besides; gains and
            conditions follow. The preset is that of the train of the thesis.

    Raises:
        UnobservableError: a mode of the extended pair is not observable; the message says which.
        ValueError: nothing unknown acts on the model, rho is no whole number from 1 to 3, or a number is not one of the
            model's.
    """

    name = "proportional_integral_uio"
    description = "Unknown-input observer that estimates the unknown inputs, continuous measurements"
    source = "Aguiar Cota 2019, (2.13)-(2.17)"
    option_choices = {
        "model": tuple(MODELS),
        "rho": tuple(range(1, LARGEST + 1)),
        **NUMBERS,
    }

    def __init__(self, model: str | ObserverModel = "braked_train", rho: int = 2, **numbers: float) -> None:
        self.model = chosen = with_unknown_inputs(find_model(model, **numbers), self.name)
        check_rho(rho, self.name)
        if rho > LARGEST:
            raise ValueError(f"{self.name}: rho must be at most {LARGEST}, got {rho}: higher derivatives are noise.")
        self.rho = int(rho)
        ways = [(s, f"{s.name}{_suffix(k)}", k) for k in range(self.rho) for s in chosen.unknown_inputs]
        text = [f"{'Derivative of: ' * k}{s.description}" for s, _, k in ways]
        units = [reduce(lambda unit, _: _per_second(unit), range(k), s.unit) for s, _, k in ways]
        self._disturbances = tuple(name for _, name, _ in ways)
        self.extra_states = tuple(
            state(f"estimated_{name}", unit, s.start if k == 0 else 0.0, f"Estimate: {words}")
            for (s, name, k), unit, words in zip(ways, units, text, strict=True)
        )
        self.extra_outputs = (
            *(
                output_signal(name, unit, f"Estimate: {words}")
                for (_, name, _), unit, words in zip(ways, units, text, strict=True)
            ),
            *residual_outputs(chosen),
        )
        self.A_e, self.C_e = extended_matrices(chosen.A, np.asarray(chosen.H), chosen.C, self.rho)
        self.gain_parameters = (
            self.gain_parameter("gain", self.default_gain(chosen, self.rho), "Gain L, row by row"),
            residual_gain(chosen),
        )
        if (chosen.name, self.rho, numbers) == ("braked_train", 2, {}):
            self.presets = {"as_published": {"gain": _PUBLISHED_GAIN, **PUBLISHED_START}}
        super().__init__(chosen, rho=self.rho, **numbers)

    @staticmethod
    def default_gain(model: ObserverModel, rho: int) -> np.ndarray:
        """Gain L of the default poles, shape (n + rho nd, q).

        Args:
            model: a model with nd unknown inputs. rho: how many of d, d' and so on are states.

        Raises:
            UnobservableError: a mode of the extended pair is not observable; the message says which.
        """
        disturbances = [f"{s.name}{_suffix(k)}" for k in range(rho) for s in model.unknown_inputs]
        states = (*(s.name for s in model.states), *disturbances)
        poles = -SPEED * (1.0 + 0.25 * np.arange(len(states)))
        return extended_gain(linear_part(model).A, np.asarray(model.H), model.C, rho, poles, states, model.name)

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        extended, n = stacked_of(x, self.states), self.model.order
        moved = self.A_e @ extended + self._gain(p) @ (self.measured(u) - self.C_e @ extended)
        driven = self.model.B @ self.known(u) if self.model.inputs else np.zeros(self.model.order)
        if self.model.phi is not None:
            driven = driven + self.model.remainder(self.estimates(x), self.known(u))
        return named_as(self.states, [*(a + b for a, b in zip(moved[:n], driven, strict=True)), *moved[n:]])

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        found = super().output(t, x, u, p) | {name: getattr(x, f"estimated_{name}") for name in self._disturbances}
        return found | residuals(self.model, self.measured(u) - self.C_e @ stacked_of(x, self.states), p)

    def condition_of(self, p: Any) -> Finding:
        """Observability of the extended pair by rank and smallest singular value, and the abscissa of A_e - L C_e."""
        linear = linear_part(self.model)
        H, C, L = np.asarray(linear.H), linear.C, np.asarray(self._gain(p))
        matrix = observability_matrix(extended_matrices(linear.A, H, C, self.rho)[0], self.C_e)
        vertices = [extended_matrices(A, H, C, self.rho)[0] - L @ self.C_e for A in self.model.drifts]
        sizes = np.tile(np.linalg.norm(H, axis=0), self.rho)  # a force counts by the acceleration that it makes
        found = errors_decay(vertices, [*np.ones(linear.order), *sizes])
        return condition_found(
            holds=found.holds,
            numbers={
                "rank": int(np.linalg.matrix_rank(matrix)),
                "order": len(self.A_e),
                "smallest_singular_value": float(np.linalg.svd(matrix)[1][-1]),
                **found.values,
            },
            statement=f"A_e - L C_e {found.statement}; poles can be placed at will where rank = order",
            source="Aguiar Cota 2019, (2.16)-(2.17)",
        )

    def _gain(self, p: Any) -> Array:
        return as_matrix(p.gain, len(self.A_e), len(self.model.measurements))


def _per_second(unit: str) -> str:
    """Unit of the derivative: ``m/s3`` of ``m/s2``."""
    found = re.fullmatch(r"(.+)/s(\d*)", unit)
    return f"{unit}/s" if found is None else f"{found[1]}/s{int(found[2] or 1) + 1}"


def _suffix(derivative: int) -> str:
    return ("", "_rate", "_second_rate")[derivative]
