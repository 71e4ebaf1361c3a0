"""High-gain train observer at balises whose gain starts sharp and settles by itself."""

from __future__ import annotations

from typing import Any

from fmu_observer.observers.train.high_gain_observer import HighGainTrainObserver
from plant_models.hybrid import Array, Signal, output_signal, parameter, state

START, LIMIT, RATE = 20.0, 8.0, 1.0 / 12.0  # [1/s], [1/s], [1] [ours], as `dynamic_high_gain`


class DynamicGainCdo(HighGainTrainObserver):
    """The `dynamic_high_gain` observer of Hann 2014, (3.5)-(3.8), on a train that is notified of balises.

    ``dp = v - theta K1 eta``, ``dv = (F - a sgn(v) - b v - c v|v|)/M - theta^2 K2 eta``, ``d eta = -theta K1 eta``,
    ``eta = p - balise_position`` at a balise: the output predictor, with ``eta = C xh - w``. The gain follows
    ``dtheta = -theta_rate theta (theta - theta_limit)``, the law (3.7): about ``1 / (theta_rate t)`` until it is near
    its limit. So whatever balises a start offers, the first of them correct a wrong speed sharply, and later ones live
    with the longest hole. The applied effort stands for the adhesion force.

    With a `theta_rate` of 0.25 or more, a gap as long as the time since the start is one that the gain of then
    survives. `certify` speaks of theta at its limit. All gains are ours: the thesis has no train. Preset `balise_holes`
    is for holes up to 32 s.
    """

    name = "dynamic_gain_cdo"
    description = "High-gain continuous-discrete observer whose gain starts sharp and settles by itself"
    source = "Hann 2014, Theorem 3.1, (3.5)-(3.8), on the train of Bouchama 2024, (3.1)-(3.3)"
    theta_name = "theta_limit"
    outputs = (*HighGainTrainObserver.outputs, output_signal("gain", "1/s", "High gain theta in force"))
    gain_states = (state("theta", "1/s", START, "High gain in force"),)
    stability_parameters = ("theta_limit", "high_gain")
    presets = {
        "dense_balises": {},
        "balise_holes": {"theta_limit": 0.12, "theta_rate": 0.25, "theta": 2.0},
    }
    default_preset = "dense_balises"

    def gain_parameters(self) -> tuple[Signal, ...]:
        _, shape = super().gain_parameters()
        return (
            parameter("theta_limit", "1/s", LIMIT, "High gain that theta tends to, at most 4 / longest gap", min=0.0),
            shape,
            parameter("theta_rate", "1", RATE, "Rate of theta over its distance from the limit", min=0.0),
        )

    def theta_in_force(self, x: Any, p: Any) -> Array:
        """High gain now [1/s]."""
        return x.theta

    def estimator_flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        settles = p.theta_rate * x.theta * (p.theta_limit - x.theta)
        return super().estimator_flow(t, x, u, p) | {"theta": settles}

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return super().output(t, x, u, p) | {"gain": self.theta_in_force(x, p)}
