"""The single-mass train whose position and speed are measured by two nodes of a network. Data only."""

from __future__ import annotations

import numpy as np

from fmu_observer.models.observer_model import ObserverModel
from fmu_observer.models.train.freight_train_model import MASS, freight_train
from plant_models.hybrid import Array, input_signal, vector


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
