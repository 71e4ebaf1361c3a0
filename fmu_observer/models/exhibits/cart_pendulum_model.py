"""The cart with an inverted pendulum as its filters see it. Data only."""

from __future__ import annotations

import numpy as np

from fmu_observer.models.observer_model import ObserverModel, zero_states
from plant_models.exhibits.cart_pendulum import TABLE_4_1, CartPendulum, accelerations
from plant_models.hybrid import Array, input_signal, vector

_CHAINS = np.kron(np.eye(2), np.array([[0.0, 1.0], [0.0, 0.0]]))  # position and speed, angle and rate


def cart_pendulum() -> ObserverModel:
    """Position and angle measured, the force known: Allaoui 2024, (4.6) to (4.10), constants of Table 4.1."""
    return ObserverModel(
        name="cart_pendulum",
        description="Cart with an inverted pendulum, position and angle measured",
        source="Allaoui 2024, (4.6) to (4.10), Table 4.1",
        states=zero_states(CartPendulum.plain_outputs[:4]),
        inputs=CartPendulum.inputs,
        measurements=(
            input_signal("position", "m", 0.0, "Measured position of the cart"),
            input_signal("angle", "rad", 0.0, "Measured angle of the pendulum"),
        ),
        A=_CHAINS,
        B=np.zeros((4, 1)),
        C=np.eye(4)[[0, 2]],
        phi=_remainder,
        sample_period=1e-3,
    )


def _remainder(x: Array, u: Array) -> Array:
    _, speed, angle, rate = x
    acceleration, angular = accelerations(speed, angle, rate, u[0], TABLE_4_1)
    return vector(0.0, acceleration, 0.0, angular)
