"""Sampled linear state feedback that keeps a benchmark plant upright. Knows only the hybrid foundation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from plant_models.hybrid import Array, HybridSystem, PeriodicEvent
from plant_models.hybrid.option import require_chosen
from plant_models.hybrid.signal import Signal, discrete_output, input_signal, memory, parameter


@dataclass(frozen=True)
class _Regulated:
    """What a feedback controls.

    Attributes:
        inputs: state as the feedback gets it. output: the force. gain: K of ``u = -K x``.
    """

    inputs: tuple[Signal, ...]
    output: Signal
    gain: tuple[float, ...]


CART = (
    input_signal("position", "m", 0.0, "Position of the cart"),
    input_signal("speed", "m/s", 0.0, "Speed of the cart", display_unit="km/h"),
)
FORCE = discrete_output("force", "N", "Force on the cart")

REGULATED: dict[str, _Regulated] = {
    "cart_pendulum": _Regulated(
        (
            *CART,
            input_signal("angle", "rad", 0.0, "Angle of the pendulum from upright"),
            input_signal("rate", "rad/s", 0.0, "Angular speed of the pendulum"),
        ),
        FORCE,
        (-3.143738089, -6.577127557, -75.540804628, -16.018255246),
    ),
    "cart_double_pendulum": _Regulated(
        (
            *CART,
            input_signal("first_angle", "rad", 0.0, "Angle of the lower rod from upright"),
            input_signal("first_rate", "rad/s", 0.0, "Angular speed of the lower rod"),
            input_signal("second_angle", "rad", 0.0, "Angle of the upper rod from upright"),
            input_signal("second_rate", "rad/s", 0.0, "Angular speed of the upper rod"),
        ),
        FORCE,
        (9.87856272, 19.159064821, -298.641977972, 1.879282643, 448.986115974, 99.460818843),
    ),
}


class StateFeedback(HybridSystem):
    """Linear-quadratic regulator ``u = -K x`` of a pendulum on a cart, read at samples, held in between.

    Its inputs take true states (LQR) or the estimates of a filter (LQG), which are called alike. The thesis names LQR
    and LQG for the pendulums and prints neither weights nor gains. K is that of the Euler model at 1 ms for the weight
    0.1 on the force and, on the states, diag(1, 1, 10, 1) for the single and diag(10, 1, 100, 1, 100, 1) for the double
    pendulum [ours].

    Args:
        plant: ``cart_pendulum`` or ``cart_double_pendulum``.

    Raises:
        ValueError: another plant.
    """

    name = "state_feedback"
    description = "Linear-quadratic regulator of a pendulum on a cart"
    source = "Allaoui 2024, section IV.2, names it; weights and gains are ours"
    internal_step = 1e-2  # nothing flows between samples
    states = (memory("held_force", "N", 0.0, "Force on the cart, held"),)
    option_choices = {"plant": tuple(REGULATED)}

    def __init__(self, plant: str = "cart_pendulum") -> None:
        require_chosen(self.name, self.option_choices, plant=plant)
        regulated = REGULATED[plant]
        self.inputs, self.outputs = regulated.inputs, (regulated.output,)
        self.parameters = (
            parameter("gain", "1", regulated.gain, "Gain K, one number a state", size=len(regulated.inputs)),
            parameter("force_limit", "N", 0.0, "Largest force; 0 for no limit", min=0.0),
            parameter("sample_period", "s", 1e-3, "Time between two samples", min=1e-6),
        )
        self.events = (PeriodicEvent("sampling", "sample_period", description="The state is read"),)
        super().__init__(plant=plant)

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        states = [getattr(u, s.name) for s in self.inputs]
        wanted = -sum(p.gain[i] * value for i, value in enumerate(states))
        limited = np.minimum(np.maximum(wanted, -p.force_limit), p.force_limit)
        return {"held_force": np.where(p.force_limit > 0.0, limited, wanted)}

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return {"force": x.held_force}
