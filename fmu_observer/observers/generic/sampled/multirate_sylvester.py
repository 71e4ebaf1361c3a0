"""O14: the multirate observer by a Sylvester equation; every sampled measurement comes at its own instants."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy

from fmu_observer.certificates.aperiodic import certify_sampled_error
from fmu_observer.certificates.finding import Finding, condition_found
from fmu_observer.certificates.impulsive_error import ImpulsiveError
from fmu_observer.certificates.small_gain import independent_gap_limit, with_independent_samples
from fmu_observer.design.pole_placement import observer_gain
from fmu_observer.models.exhibits.inverted_pendulum_on_cart import inverted_pendulum_cart
from fmu_observer.models.observer_model import ObserverModel, named_as, stacked_of
from fmu_observer.observers.evaluated_observer import GapCertified
from fmu_observer.observers.model_observer import as_matrix
from fmu_observer.observers.model_signals import estimate_outputs, matrix_parameter, measured_inputs
from plant_models.hybrid import Array, Signal, TriggeredEvent, state
from plant_models.hybrid.option import require_whole


@dataclass(frozen=True)
class _SylvesterDesign:
    """Matrices of ``dz = A z + B_c y_c + B_d w + T G u`` with z standing for ``T x``.

    Attributes:
        A: Hurwitz, shape (r, r). B: ``[B_c B_d]``, shape (r, n - r). T: ``[T_R T_c T_d]``, shape (r, n), with T_R
        invertible.
    """

    A: np.ndarray
    B: np.ndarray
    T: np.ndarray


_MULTIRATE_MODELS: dict[str, Callable[[], ObserverModel]] = {"inverted_pendulum_cart": inverted_pendulum_cart}

SPEED = 2.0  # [1/s] of the poles of A, at -SPEED, -1.25 SPEED, ... [ours]
RESIDUAL = 1e-9  # relative: above it (1.46) does not hold for the matrices in use


class MultirateSylvester(GapCertified):
    """Observer of ``x = [x_R, x_c, x_d]``: x_c measured always, each component of x_d at its own event.

    Bouchama 2024, (1.42)-(1.46):
    ``dz = A z + B_c y_c + B_d w + T G u``, ``dw = F_31 xh_R + F_32 y_c + F_33 w + G_3 u``, ``w_i = y_i`` at
    ``<y_i>_sample``, ``xh_R = inv(T_R) (z - T_c y_c - T_d w)``. T solves the Sylvester equation
    ``T F = A T + [0 B_c B_d]`` (1.46), so that ``e_z = z - T x`` obeys ``de_z = A e_z + B_d e_w``, and the estimate
    jumps at samples. The matrices A, [B_c B_d] and T are parameters; `condition` says whether those in use still solve
    the equation.

    Args:
        model: linear, its measurements the last states in their order; or the name of one in `_MULTIRATE_MODELS`.
        continuous: how many of the measurements, the first ones, are there always.

    Default A: real poles from -2 1/s on; B such that T_R = I (`_sylvester_design`) [ours, the thesis prints none].

    Raises:
        ValueError: the model is unknown, not linear, not in that order, or its unmeasured part cannot be observed.
    """

    name = "multirate_sylvester"
    description = "Multirate observer by a Sylvester equation, every sampled output at its own instants"
    source = "Bouchama 2024, (1.42)-(1.46)"
    internal_step = 5e-3
    option_choices = {"model": tuple(_MULTIRATE_MODELS), "continuous": (0, 1, 2)}

    def __init__(self, model: str | ObserverModel = "inverted_pendulum_cart", continuous: int = 1) -> None:
        self.model = _find(model)
        self.hidden = self.model.order - len(self.model.measurements)
        self._check(continuous)
        self.always, self.sampled = self.model.measurements[:continuous], self.model.measurements[continuous:]
        poles, names = (
            -SPEED * (1.0 + 0.25 * np.arange(self.hidden)),
            tuple(s.name for s in self.model.states[: self.hidden]),
        )
        design = _sylvester_design(self.model.A, self.hidden, poles, names, f"{self.name} of {self.model.name}")
        self.parameters = (
            matrix_parameter("filter_matrix", design.A, "Matrix A of the filter, Hurwitz, row by row [1/s]"),
            matrix_parameter("filter_gain", design.B, "Gain [B_c B_d] of the filter, row by row"),
            matrix_parameter("transformation", design.T, "T = [T_R T_c T_d] of the Sylvester equation, row by row"),
        )
        starts = self.model.start
        self.states = (
            state("filter", "1", tuple(map(float, design.T @ starts)), "Filter z, stands for T x", size=self.hidden),
            *(
                state(f"predicted_{s.name}", s.unit, s.start, f"Predicted: {s.description}")
                for s in self._slow_states()
            ),
        )
        self.inputs = (*self.model.inputs, *measured_inputs(self.always))
        self.outputs = estimate_outputs(self.model.states)
        self.events = tuple(
            TriggeredEvent(
                f"{s.name}_sample",
                measured_inputs([replace(s, name="value")], f"{s.name}_sample_", "discrete"),
                f"Sample: {s.description}",
                samples=(f"{s.name}_sample_value",),
            )
            for s in self.sampled
        )
        super().__init__(model=self.model.name, continuous=continuous)

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        r, A, B, T = self._matrices(p)
        known, estimate = stacked_of(u, self.model.inputs), self.estimate(x, u, p)
        driven = T @ (self.model.B @ known) if len(self.model.inputs) else 0.0
        whole = self.model.flow(estimate, known)[self.model.order - len(self.sampled) :]
        return {"filter": A @ x.filter + B @ estimate[r:] + driven} | named_as(self._slow_states(), whole, "predicted_")

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """One predicted sample is set to what was measured."""
        pairs = zip(self.sampled, self._slow_states(), strict=True)
        name = next(f"predicted_{slow.name}" for s, slow in pairs if event == f"{s.name}_sample")
        predicted = getattr(x, name)
        return {name: predicted + (getattr(u, f"{event}_value") - predicted)}

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """The estimates; what is measured always is passed on."""
        return named_as(self.model.states, self.estimate(x, u, p))

    def estimate(self, x: Any, u: Any, p: Any) -> Array:
        """``[xh_R, y_c, w]``, shape (n,)."""
        r, _, _, T = self._matrices(p)
        always, sampled = stacked_of(u, self.always, "measured_"), stacked_of(x, self._slow_states(), "predicted_")
        measured = np.hstack([always, sampled]) if self.always else sampled
        return np.hstack([np.linalg.solve(T[:, :r], x.filter - T[:, r:] @ measured), measured])

    def condition_of(self, p: Any) -> Finding:
        """(1.46) by its residual, A Hurwitz by its abscissa, T_R invertible by its condition number."""
        r, A, B, T = self._numbers(p)
        residual = _sylvester_residual(self.model.A, A, B, T)
        abscissa, spread = float(np.linalg.eigvals(A).real.max()), float(np.linalg.cond(T[:, :r]))
        return condition_found(
            holds=residual < RESIDUAL and abscissa < 0.0 and spread < 1.0 / RESIDUAL,
            numbers={"residual": residual, "abscissa [1/s]": abscissa, "condition_number": spread},
            statement="T solves the Sylvester equation (residual = rounding), A is Hurwitz (abscissa < 0), T_R is "
            "invertible",
            source="Bouchama 2024, (1.46)",
            kind="exact",
        )

    def gap_finding(self, gap: float, p: Any) -> Finding:
        """Certificate where all samples come together; where they do not, a small-gain condition in addition."""
        r, A, B, T = self._numbers(p)
        count = len(self.sampled)
        _, B_d, read, own = self.error_matrices(p)
        generator = np.block([[A, B_d], [read, own]])
        reset = np.diag(np.r_[np.ones(r), np.zeros(count)])
        residual = _sylvester_residual(self.model.A, A, B, T)
        left_out = "noise and model errors are left out"
        model = f"error equations of the model {self.model.name!r}, exact if it is linear; {left_out}"
        found = certify_sampled_error((ImpulsiveError.of(generator, reset),), gap, model)
        text, what = (
            f"the Sylvester equation holds with the residual {residual:.1e}",
            "residual of the Sylvester equation",
        )
        found = found.also(Finding(what, residual, "1", "exact", "(1.46)", residual < RESIDUAL, text))
        return found if count == 1 else with_independent_samples(found, independent_gap_limit(A, B_d, read, own))

    def error_matrices(self, p: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Matrices of ``de_z = A e_z + B_d e_w``, ``de_w = C e_z + D e_w``; a sample sets its component of e_w to zero.

        Returns:
            A of shape (r, r), B_d of shape (r, n_d), C of shape (n_d, r), D of shape (n_d, n_d).
        """
        r, A, B, T = self._numbers(p)
        count = len(self.sampled)
        slow = np.s_[self.model.order - count :]
        F = self.model.A[slow]
        read = F[:, :r] @ np.linalg.inv(T[:, :r])
        return A, B[:, B.shape[1] - count :], read, F[:, slow] - read @ T[:, slow]

    # -- internals --------------------------------------------------------------------------------------------------

    def _check(self, continuous: int) -> None:
        model, q = self.model, len(self.model.measurements)
        if model.phi is not None or self.hidden < 1 or not np.array_equal(model.C, np.eye(model.order)[self.hidden :]):
            raise ValueError(
                f"{self.name} does not suit the model {model.name!r}: it must be linear (no phi) with its last states "
                f"measured, in their order, and at least one state before them; got C = {model.C.tolist()}."
            )
        require_whole(f"{self.name}, one of {q} measurement(s) at least being sampled", 0, q - 1, continuous=continuous)

    def _slow_states(self) -> tuple[Signal, ...]:
        return self.model.states[self.model.order - len(self.sampled) :]

    def _matrices(self, p: Any) -> tuple[int, Array, Array, Array]:
        r, n = self.hidden, self.model.order
        return (
            r,
            as_matrix(p.filter_matrix, r, r),
            as_matrix(p.filter_gain, r, n - r),
            as_matrix(p.transformation, r, n),
        )

    def _numbers(self, p: Any) -> tuple[int, np.ndarray, np.ndarray, np.ndarray]:
        r, A, B, T = self._matrices(p)
        return r, np.asarray(A, dtype=float), np.asarray(B, dtype=float), np.asarray(T, dtype=float)


def _find(model: str | ObserverModel) -> ObserverModel:
    if isinstance(model, ObserverModel):
        return model
    if not isinstance(model, str) or model not in _MULTIRATE_MODELS:
        known = ", ".join(_MULTIRATE_MODELS)
        raise ValueError(f"Unknown multirate model {model!r}; known are: {known}. Or give an ObserverModel.")
    return _MULTIRATE_MODELS[model]()


def _sylvester_transformation(F: np.ndarray, A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """T of ``T F = A T + [0 B]``: Bouchama 2024, (1.46)."""
    r, n = len(A), len(F)
    if np.shape(A) != (r, r) or np.shape(F) != (n, n) or np.shape(B) != (r, n - r):
        raise ValueError(
            f"Sylvester equation: A {np.shape(A)}, F {np.shape(F)} and B {np.shape(B)} do not fit; expected (r, r), "
            f"(n, n) and "
            f"(r, n - r), here {(r, n - r)}."
        )
    distance = np.abs(np.linalg.eigvals(A)[:, None] - np.linalg.eigvals(F)[None, :]).min()
    if distance < 1e-9 * max(1.0, float(np.abs(F).max())):
        raise ValueError(
            "Sylvester equation: A shares an eigenvalue with the plant, there is no unique T; move the poles of A."
        )
    return np.asarray(scipy.linalg.solve_sylvester(-A, F, np.hstack([np.zeros((r, r)), B])))


def _sylvester_residual(F: np.ndarray, A: np.ndarray, B: np.ndarray, T: np.ndarray) -> float:
    """Largest entry of ``T F - A T - [0 B]``, relative to the largest of ``T F``."""
    r = len(A)
    left = T @ F
    error = left - A @ T - np.hstack([np.zeros((r, r)), B])
    return float(np.abs(error).max() / max(float(np.abs(left).max()), 1e-300))


def _sylvester_design(
    F: np.ndarray, unmeasured: int, poles: Sequence[float] | np.ndarray, states: Sequence[str] = (), name: str = ""
) -> _SylvesterDesign:
    """A and B for given poles by the reduced-order observer, and T from the Sylvester equation [ours].

    With L placing the poles of ``A = F_11 - L F_21`` the unmeasured part less L times the measured one is such a
    filter, with ``B = F_12 - L F_22 + A L``; the equation then gives ``T = [I, -L]``, so that T_R is as well
    conditioned as can be.
    """
    r = unmeasured
    F11, F12, F21, F22 = F[:r, :r], F[:r, r:], F[r:, :r], F[r:, r:]
    names = tuple(states) or tuple(f"x{i + 1}" for i in range(r))
    L = observer_gain(F11, F21, poles, names, name or "Sylvester design")
    A = F11 - L @ F21
    B = F12 - L @ F22 + A @ L
    return _SylvesterDesign(A, B, _sylvester_transformation(F, A, B))
