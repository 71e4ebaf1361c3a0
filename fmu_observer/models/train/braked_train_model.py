"""The speed of a train under an effort and an unknown disturbance: the model of unknown-input observers. Data only."""

from __future__ import annotations

import numpy as np

from fmu_observer.models.observer_model import ObserverModel
from fmu_observer.models.suitability import require_mass
from plant_models.hybrid import input_signal, state

DRAG = 0.1  # w1 of set A [1/s]
_EFFORT = 0.1  # b of set A [1]
_START = 30.0  # [m/s]


def braked_train(mass: float = 1.0, drag: float = DRAG, effort: float = _EFFORT) -> ObserverModel:
    """``dv = -w1 v + b u / m + d``, the speed is measured: Aguiar Cota 2019, (3.1)-(3.3) and (3.15), set A.

    The disturbance d holds what the model leaves out, ``-w0 - w2 v^2`` and the slope. The position is no state: no
    odometer shows it, whatever the observer.

    Args:
        mass: m [kg]; 1 for efforts per unit mass. drag: w1, slope of the resistance per mass [1/s]. effort: force per
            effort, b [1].
    """
    require_mass("braked_train", mass=mass)
    return ObserverModel(
        name="braked_train",
        description="Speed of a train under an effort and an unknown disturbance, its speed measured",
        source="Aguiar Cota 2019, (3.1)-(3.3), set A",
        states=(state("speed", "m/s", _START, "Speed of the train"),),
        inputs=(input_signal("effort", "N", 0.0, "Effort: traction > 0, brake < 0"),),
        measurements=(input_signal("speed", "m/s", _START, "Speed by the odometer"),),
        A=np.array([[-drag]]),
        B=np.array([[effort / mass]]),
        C=np.eye(1),
        sample_period=0.2,
        unknown_inputs=(
            input_signal("disturbance", "m/s2", 0.0, "Acceleration that the model leaves out: resistance, slope"),
        ),
        H=np.eye(1),
    )
