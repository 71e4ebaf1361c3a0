"""An inverted pendulum on a driven cart: the unstable linear plant on which the multirate observer is shown. Data
only.
"""

from __future__ import annotations

import numpy as np

from fmu_observer.models.observer_model import ObserverModel
from plant_models.hybrid import input_signal, state

_CART, _BOB, _LENGTH, _GRAVITY = 4.0, 0.4, 5.0, 9.81  # [kg], [kg], [m], [m/s2]
_RESISTANCE, _INDUCTANCE, _MOTOR, _ROLLER = 1.0, 0.5, 0.5, 0.1  # [Ohm], [H], [N.m/A], [m]


def inverted_pendulum_cart() -> ObserverModel:
    """Cart with an upright pendulum, driven by a direct-current motor, linear about the upright rest [ours].

    The state is ordered as Bouchama 2024, (1.42) asks: ``x_R`` = speed v of the cart and angular rate q of the
    pendulum, not measured; ``x_c`` = motor current i, measured always; ``x_d`` = position p of the cart, measured at
    marks on the track, and angle a of the pendulum, measured by a camera, each at its own instants. With the motor
    force ``f = k i / r``:

    ``dv = -(m g / M) a + f / M``, ``dq = ((M + m) g / (M l)) a - f / (M l)``, ``di = (u - R i - (k / r) v) / L``,
    ``dp = v``, ``da = q``. The pendulum falls with the time constant ``sqrt(M l / ((M + m) g))`` = 0.68 s.
    """
    A, B = _matrices()
    return ObserverModel(
        name="inverted_pendulum_cart",
        description="Inverted pendulum on a cart: current measured always, position and angle at samples",
        source="ours, in the order of Bouchama 2024, (1.42)",
        states=(
            state("speed", "m/s", 0.0, "Speed of the cart"),
            state("rate", "rad/s", 0.0, "Angular speed of the pendulum"),
            state("current", "A", 0.0, "Motor current"),
            state("position", "m", 0.0, "Position of the cart"),
            state("angle", "rad", 0.0, "Angle of the pendulum from upright"),
        ),
        inputs=(input_signal("voltage", "V", 0.0, "Voltage of the motor"),),
        measurements=(
            input_signal("current", "A", 0.0, "Motor current"),
            input_signal("position", "m", 0.0, "Position of the cart at a mark"),
            input_signal("angle", "rad", 0.0, "Angle of the pendulum in a picture"),
        ),
        A=A,
        B=B,
        C=np.eye(5)[2:],
        event="sample",
        sample_period=0.1,
    )


def _matrices() -> tuple[np.ndarray, np.ndarray]:
    """A and B about the upright rest."""
    force = _MOTOR / _ROLLER
    fall = (_CART + _BOB) * _GRAVITY / (_CART * _LENGTH)
    A = np.zeros((5, 5))
    A[0, 2], A[0, 4] = force / _CART, -_BOB * _GRAVITY / _CART
    A[1, 2], A[1, 4] = -force / (_CART * _LENGTH), fall
    A[2, 0], A[2, 2] = -force / _INDUCTANCE, -_RESISTANCE / _INDUCTANCE
    A[3, 0], A[4, 1] = 1.0, 1.0
    B = np.zeros((5, 1))
    B[2, 0] = 1.0 / _INDUCTANCE
    return A, B
