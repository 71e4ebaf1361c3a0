"""High-gain observers with an output predictor: of constant gain, and of one that settles by itself."""

from __future__ import annotations

from typing import Any

import numpy as np

from fmu_observer.certificates.finding import Finding, as_printed, condition_found, gap_numbers
from fmu_observer.certificates.printed_bounds.sampled_gain_bounds import DynamicThetaBounds, dynamic_theta_bounds
from fmu_observer.models.observer_model import ObserverModel
from fmu_observer.observers.generic.sampled.high_gain_sampled import HighGainSampled
from fmu_observer.observers.generic.sampled.sampled_observer import PERIOD, per_measurement
from fmu_observer.observers.model_observer import as_matrix
from plant_models.hybrid import Array, Signal, output_signal, parameter, state


class OutputPredictor(HighGainSampled):
    """High-gain observer whose output is predicted between samples: Bouchama 2024, figure 1.2.

    ``dxh = A xh + phi(xh, u) - theta inv(Delta) K (C xh - w)``, ``dw = C (A xh + phi(xh, u))``, ``w = y`` at a sample.
    The thesis prints no equations, these are those of its references. Since ``d(C xh - w) = -theta K_1 (C xh - w)``, it
    is the observer `exponential_gain` in other coordinates: same estimates, same certificate, same condition. The model
    must be a chain with its first block measured.
    """

    name = "output_predictor"
    description = "High-gain observer with the output predicted between samples"
    source = "Bouchama 2024, figure 1.2, equations of its references"
    sampled_state = "predicted_output"

    def declare_sampled_part(self, model: ObserverModel) -> None:
        self.extra_states = (per_measurement(model, "predicted_output", "Output predicted since the last sample"),)

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        predicted = self.model.flow(self.estimates(x), self.known(u))
        error = self.model.measured(self.estimates(x)) - self.sampled_part(x)
        follows = self.named_part(self.model.measured(predicted))
        return self.named_estimates(predicted - self.correction(x, error, p)) | follows

    def update(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """The predicted output is set to the measured one."""
        return self.named_part(self.measured(u))


_THETA_LIMIT, _THETA_RATE, _THETA_START = (
    5.0,
    1.0 / 12.0,
    20.0,
)  # [ours]: b = 2, mu = 1, and 4/6 for the printed bracket
PUBLISHED_START, _PUBLISHED_STEP = 2.0, 1e-3  # [ours]; any start above 1 is allowed


class DynamicHighGain(OutputPredictor):
    """High-gain observer with an output predictor and a dynamic gain: Hann 2014, (3.5)-(3.8).

    ``dxh = A xh + psi(xh, u) - theta inv(Delta) K (C xh - w)``, ``dw = C (A xh + psi(xh, u))``, ``w = y`` at a sample,
    ``dtheta = -(theta/b) ((mu/6)(theta - 1) - c)`` with ``c = (2 sqrt(n) lmax(P) L + 1)/lmin(P)``. That law is
    ``dtheta = -rate theta (theta - limit)``, ``rate = mu/(6 b)``, ``limit = 1 + 6 c/mu``, and is written so: theta
    tends to the limit from any positive start. A large start finds the state soon, a small limit lives with long gaps.
    With theta at its limit from the start it is `output_predictor`. The model must be a chain with its first block
    measured.

    `certify` speaks of theta at its limit, which it approaches exponentially: what happens on the way ends, but may be
    large. Presets: `as_published`, the printed law with the Lipschitz constant of the model, left out where none is
    known: the limit is then so large that gaps must be 1e-4 s; `repaired`, ours: limit 5, rate 1/12, start 20 1/s.
    """

    name = "dynamic_high_gain"
    description = "High-gain observer with output predictor and a gain that settles by itself"
    source = "Hann 2014, Theorem 3.1, (3.5)-(3.8)"

    def __init__(self, model: str | ObserverModel = "pendulum") -> None:
        self.extra_outputs = (output_signal("gain", "1/s", "High gain theta in force"),)
        super().__init__(model)
        self.presets = {"repaired": {}}
        self.default_preset = "repaired"
        published = self.bounds(self.unpack_parameters(self.start_parameters("repaired")))
        if np.isfinite(published.theta_limit):
            self.presets["as_published"] = {
                "theta_limit": published.theta_limit,
                "theta_rate": published.theta_rate,
                "theta": PUBLISHED_START,
                "internal_step": _PUBLISHED_STEP,
            }

    def theta_parameters(self) -> tuple[Signal, ...]:
        return (
            parameter("theta_limit", "1/s", _THETA_LIMIT, "High gain that theta tends to", min=0.0),
            parameter("theta_rate", "1", _THETA_RATE, "Rate of theta over its distance from the limit", min=0.0),
        )

    def declare_sampled_part(self, model: ObserverModel) -> None:
        super().declare_sampled_part(model)
        self.extra_states = (*self.extra_states, state("theta", "1/s", _THETA_START, "High gain in force"))

    def theta_in_force(self, x: Any, p: Any) -> Array:
        """High gain now [1/s]."""
        return x.theta

    def settled_theta(self, p: Any) -> float:
        """The limit of theta [1/s]."""
        return float(p.theta_limit)

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return super().flow(t, x, u, p) | {"theta": p.theta_rate * x.theta * (p.theta_limit - x.theta)}

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return super().output(t, x, u, p) | {"gain": x.theta}

    def remark(self) -> str:
        """What holds only after a while, besides what is left out."""
        return f"theta at its limit; {super().remark()}"

    def bounds(self, p: Any) -> DynamicThetaBounds:
        """What Theorem 3.1 prints for the model and this K."""
        model = self.model
        K = as_matrix(np.asarray(p.high_gain, dtype=float), model.order, self.outputs_count)
        return dynamic_theta_bounds(model.A, K, model.C, model.lipschitz, self.settled_theta(p))

    def printed_bounds(self, p: Any) -> tuple[Finding, ...]:
        """(3.8) with theta at its limit, and what it says at the limit that (3.7) prints."""
        bounds, source = self.bounds(p), "Hann 2014, (3.8)"
        model, printed = self.model, bounds.theta_limit
        K = as_matrix(np.asarray(p.high_gain, dtype=float), model.order, self.outputs_count)
        at_limit = f"tau_MASP at theta = {self.settled_theta(p):.3g} 1/s"
        found = [as_printed(PERIOD, bounds.longest_gap, at_limit, source)]
        if np.isfinite(printed):
            settled = dynamic_theta_bounds(model.A, K, model.C, model.lipschitz, printed).longest_gap
            found.append(as_printed(PERIOD, settled, f"tau_MASP at theta_inf = {printed:.4g} 1/s of (3.7)", source))
        return tuple(found)

    def condition_of(self, p: Any) -> Finding:
        """(3.7) and (3.8): the limit of theta, and the longest gap at it, against the model's `sample_period`."""
        bounds, theta, gap = self.bounds(p), self.settled_theta(p), self.model.sample_period
        return condition_found(
            holds=theta >= bounds.theta_limit and gap <= bounds.longest_gap,
            numbers={
                "theta_limit [1/s]": theta,
                "printed_theta_limit [1/s]": bounds.theta_limit,
                **gap_numbers(gap, bounds.longest_gap, self.model.lipschitz),
            },
            statement="theta_limit >= printed_theta_limit [1/s], gap <= longest_gap [s]; sufficient, ten thousand "
            "times too careful; the finding about gaps is exact once theta has settled",
            source="Hann 2014, Theorem 3.1, (3.7)-(3.8), theta_max taken as the limit",
        )
