"""The cart with an inverted double pendulum as its filters see it. Data only."""

from __future__ import annotations

import numpy as np

from fmu_observer.models.observer_model import ObserverModel, zero_states
from plant_models.exhibits.cart_double_pendulum import SECTION_IV_2_2_3, CartDoublePendulum, accelerations
from plant_models.hybrid import Array, input_signal, vector

_CHAINS = np.kron(np.eye(3), np.array([[0.0, 1.0], [0.0, 0.0]]))  # position and speed, each angle and its rate


def cart_double_pendulum() -> ObserverModel:
    """Position and both angles measured, the force known: Allaoui 2024, (4.12) to (4.18), signs repaired."""
    return ObserverModel(
        name="cart_double_pendulum",
        description="Cart with an inverted double pendulum, position and both angles measured",
        source="Allaoui 2024, (4.12) to (4.18), section IV.2.2.3, signs repaired",
        states=zero_states(CartDoublePendulum.plain_outputs[:6]),
        inputs=CartDoublePendulum.inputs,
        measurements=(
            input_signal("position", "m", 0.0, "Measured position of the cart"),
            input_signal("first_angle", "rad", 0.0, "Measured angle of the lower rod"),
            input_signal("second_angle", "rad", 0.0, "Measured angle of the upper rod"),
        ),
        A=_CHAINS,
        B=np.zeros((6, 1)),
        C=np.eye(6)[[0, 2, 4]],
        phi=_remainder,
        sample_period=1e-3,
    )


def _remainder(x: Array, u: Array) -> Array:
    _, _, first, first_rate, second, second_rate = x
    found = accelerations((first, second), (first_rate, second_rate), u[0], SECTION_IV_2_2_3)
    acceleration, first_angular, second_angular = found
    return vector(0.0, acceleration, 0.0, first_angular, 0.0, second_angular)
