"""The single-mass train as observers see it: position and speed from an effort, measured at balises, or both by nodes
of a network. Data only.
"""

from __future__ import annotations

import numpy as np

from fmu_observer.models.observer_model import ObserverModel, shift_matrix
from plant_models.hybrid import Array, input_signal, state, vector

MASS = 90e3  # [kg]
_DAVIS_A, DAVIS_B, DAVIS_C = 900.0, 32.4, 1.65287  # [N], [N.s/m], [N.s2/m2]
TOP_SPEED = 50.0  # [m/s]
_REST = 0.1  # [m/s]; below it constant resistance and brake fade, so that they cannot push a train that stands


def freight_train() -> ObserverModel:
    """``dp = v``, ``M dv = F - a - b v - c v |v|``, the position comes from balises: Bouchama 2024, (3.1)-(3.3),
    (3.24)-(3.25).

    For a generic observer constant resistance and brake are a smooth function of the speed near rest, and no dry
    friction; the observers of `observers.train` hold a standing train exactly.
    """
    slopes = tuple(np.array([[0.0, 0.0], [0.0, -(DAVIS_B + 2.0 * DAVIS_C * v) / MASS]]) for v in (0.0, TOP_SPEED))
    return ObserverModel(
        name="freight_train",
        description="Single-mass train, its position measured at balises",
        source="Bouchama 2024, (3.24)-(3.25)",
        states=(state("position", "m", 0.0, "Position of the train"), state("speed", "m/s", 1.0, "Speed of the train")),
        inputs=(input_signal("effort", "N", 0.0, "Effort at the wheel rim: traction > 0, brake < 0"),),
        measurements=(input_signal("position", "m", 0.0, "Position of the balise just passed"),),
        A=shift_matrix(2),
        B=np.array([[0.0], [1.0 / MASS]]),
        C=np.array([[1.0, 0.0]]),
        phi=_remainder,
        lipschitz=(DAVIS_B + 2.0 * DAVIS_C * TOP_SPEED) / MASS,
        slopes=slopes,
        event="balise",
        sample_period=0.5,
    )


def _remainder(x: Array, u: Array) -> Array:
    """Resistance, and what a brake near rest is less than the effort that B lets act in full."""
    _, speed = x
    forward = np.clip(speed / _REST, -1.0, 1.0)
    resistance = _DAVIS_A * forward + DAVIS_B * speed + DAVIS_C * speed * np.abs(speed)
    return vector(0.0, -(resistance + (1.0 - forward) * np.minimum(u[0], 0.0)) / MASS)


def networked_train() -> ObserverModel:
    """`freight_train` with an odometer as a second measurement: position and speed, each on a node of its own [ours].

    Both states are measured, so the model is a chain of one block: A is zero, and the equations stand in phi.
    """
    train = freight_train()
    turned = np.array([[0.0, 1.0], [0.0, 0.0]])
    slopes = tuple(turned + slope for slope in train.slopes)

    def remainder(x: Array, u: Array) -> Array:
        (_, speed), (_, acceleration) = x, train.remainder(x, u)
        return vector(speed, acceleration)

    return ObserverModel(
        name="networked_train",
        description="Single-mass train, position and speed measured by two nodes",
        source="Bouchama 2024, (3.24)-(3.25), behind the network of Hann 2014, chapter 2",
        states=train.states,
        inputs=train.inputs,
        measurements=(
            *train.measurements,
            input_signal("speed", "m/s", 0.0, "Speed told by the odometer"),
        ),
        A=np.zeros((2, 2)),
        B=np.array([[0.0], [1.0 / MASS]]),
        C=np.eye(2),
        phi=remainder,
        lipschitz=max(float(np.linalg.norm(slope, 2)) for slope in slopes),
        slopes=slopes,
        event="packet",
        sample_period=0.1,
    )
