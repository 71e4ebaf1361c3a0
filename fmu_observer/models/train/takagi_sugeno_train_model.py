"""The single-mass train as a Takagi-Sugeno model: balises sampled, odometer continuous, drag blended by the speed. Data
only.
"""

from __future__ import annotations

import numpy as np

from fmu_observer.models.sector_vertices import sector_nonlinearity
from fmu_observer.models.takagi_sugeno import Premise, TakagiSugenoModel
from fmu_observer.models.train.freight_train_model import DAVIS_B, DAVIS_C, MASS, TOP_SPEED, freight_train
from plant_models.hybrid import Array, input_signal

_SLOWEST = 5.0  # [m/s] of the first vertex, printed


def takagi_sugeno_train(
    mass: float = MASS, b: float = DAVIS_B, c: float = DAVIS_C, slowest: float = _SLOWEST, fastest: float = TOP_SPEED
) -> TakagiSugenoModel:
    """``dp = v``, ``M dv = F - b v - c v^2`` with the speed as premise: Bouchama 2024, (3.44)-(3.46).

    The input is the effort less the constant resistance a. The wiring is that of section 3.4: the sampled output is the
    balise position, the continuous one the odometer, and the disturbance enters the acceleration.

    Args:
        mass: M [kg]. b: [N.s/m]. c: [N.s2/m2]. slowest, fastest: speeds of the vertices [m/s].
    """
    plain = freight_train()
    return sector_nonlinearity(
        premises=(Premise("train_speed", "m/s", slowest, fastest, _speed, "Speed of the train"),),
        A=lambda f: [[0.0, 1.0], [0.0, -(b + c * f[0]) / mass]],
        B=lambda _f: [[0.0], [1.0 / mass]],
        name="takagi_sugeno_train",
        description="Single-mass train, its position sampled at balises, its speed from the odometer",
        source="Bouchama 2024, (3.44)-(3.46)",
        states=plain.states,
        inputs=(input_signal("net_effort", "N", 0.0, "Effort at the wheel rim less the constant running resistance"),),
        sampled=plain.measurements,
        continuous=(input_signal("odometer", "m/s", 0.0, "Odometer speed"),),
        C_sampled=np.array([[1.0, 0.0]]),
        C_continuous=np.array([[0.0, 1.0]]),
        G=np.array([[0.0], [1.0]]),
        event="balise",
        max_gap=0.5,
    )


def _speed(x: Array, _u: Array) -> Array:
    _, speed = x
    return speed
