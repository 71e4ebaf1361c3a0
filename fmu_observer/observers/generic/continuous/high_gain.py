"""O3: the high-gain observer of a chain of integrators with a triangular nonlinearity."""

from __future__ import annotations

from typing import Any

import numpy as np

from fmu_observer.certificates.finding import Finding, condition_found
from fmu_observer.certificates.printed_bounds.high_gain_theta import (
    binomial_gain,
    chain_error,
    lyapunov_size,
    theta_from_lipschitz,
    theta_from_slopes,
)
from fmu_observer.models.known_models import find_model
from fmu_observer.models.observer_model import ObserverModel, shift_matrix
from fmu_observer.observers.model_observer import ModelObserver
from plant_models.hybrid import Array, parameter

_POINTS = 5  # states at which the structure of the Jacobian is examined


class HighGain(ModelObserver):
    """High-gain observer ``dzh = A zh + phi(zh, u) - theta inv(Delta) K (C zh - y)``: Bouchama 2024, (1.10)-(1.13).

    With Delta = diag(1, 1/theta, ...). The i-th correction gain is ``theta^i K_i``. The model must be in normal form: A
    the shift matrix, the first state measured, phi triangular (Theorem 2). `condition` gives the smallest theta that a
    Lyapunov function proves, from the Lipschitz constant and, sharper, from the slopes of phi. Defaults [ours]: K
    binomial, all poles of ``A - K C`` at -1; theta = 5 1/s, above the proven smallest one of the pendulum, 4.92.
    """

    name = "high_gain"
    description = "High-gain observer, continuous measurements"
    source = "Bouchama 2024, (1.10)-(1.13), Theorem 2"
    internal_step = 5e-3
    option_choices = {"model": ("pendulum", "freight_train")}

    def __init__(self, model: str | ObserverModel = "pendulum") -> None:
        chosen = find_model(model)
        _require_triangular_chain(chosen, self.name)
        self.gain_parameters = (
            parameter("theta", "1/s", 5.0, "High gain", min=0.0),
            self.gain_parameter("high_gain", binomial_gain(chosen.order), "Shape K of the gain"),
        )
        super().__init__(chosen)

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        predicted, error = self.model.flow(self.estimates(x), self.known(u)), self.innovation(x, u)[0]
        corrections = (p.theta ** (i + 1) * p.high_gain[i] * error for i in range(self.model.order))
        return self.named_estimates(rate - less for rate, less in zip(predicted, corrections, strict=True))

    def condition_of(self, p: Any) -> Finding:
        """K makes the chain Hurwitz, and theta lies above the smallest one proven."""
        K = np.asarray(p.high_gain)
        bounds = theta_from_lipschitz(self.model, K), theta_from_slopes(self.model, K)
        smallest = min(bounds)
        return condition_found(
            holds=bool(np.isfinite(smallest) and p.theta >= smallest),
            numbers={
                "theta [1/s]": float(p.theta),
                "smallest_theta [1/s]": smallest,
                "smallest_theta_lipschitz [1/s]": bounds[0],
                "smallest_theta_slopes [1/s]": bounds[1],
                "abscissa [1/s]": float(np.linalg.eigvals(chain_error(K)).real.max()),
                "lyapunov_size": lyapunov_size(K),
            },
            statement="A - K C is Hurwitz (abscissa < 0) and theta >= smallest_theta, enough by e' P e with Q = I; "
            "less may do",
            source="Bouchama 2024, (1.13), Theorem 2, bound ours",
        )


def _require_one_output(model: ObserverModel, observer: str) -> None:
    """The model has one measurement."""
    if len(model.measurements) != 1:
        raise ValueError(
            f"{observer}: model {model.name!r} has {len(model.measurements)} measurements, expected one. Use "
            f"'luenberger' or "
            "'thau', whose gains are of shape (n, q)."
        )


def _require_triangular_chain(model: ObserverModel, observer: str) -> None:
    """A is the shift matrix, the first state is measured, and phi_i depends on x_1 ... x_i only: Bouchama 2024, (1.10).

    The last is read off the exact Jacobian of phi at a few states.
    """
    _require_one_output(model, observer)
    n = model.order
    where = f"{observer}: model {model.name!r} is not in the normal form (1.10): "
    if not np.array_equal(model.A, shift_matrix(n)):
        raise ValueError(
            f"{where}A must be the upper shift matrix with everything else in phi, got {model.A.tolist()}."
        )
    if not np.array_equal(model.C, np.eye(n)[:1]):
        raise ValueError(
            f"{where}the first state must be measured, C = {np.eye(n)[:1].tolist()}, got {model.C.tolist()}."
        )
    generator = np.random.default_rng(0)
    at = generator.normal(size=(_POINTS, n))
    remainders = [np.asarray(model.jacobian(x, np.ones(len(model.inputs)))) - model.A for x in at]
    above = np.abs(np.triu(np.stack(remainders), 1)).max(axis=0)
    if above.max() > 0.0:
        row, column = map(int, np.argwhere(above > 0.0)[0])
        names = [s.name for s in model.states]
        raise ValueError(
            f"{where}phi of {names[row]!r} must not depend on {names[column]!r}, which stands behind it in the chain."
        )
