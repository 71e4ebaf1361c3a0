"""The damped pendulum driven by a torque: the small nonlinear example on which every generic observer is shown. Data
only.
"""

from __future__ import annotations

import numpy as np

from fmu_observer.models.observer_model import ObserverModel, shift_matrix
from plant_models.hybrid import Array, input_signal, state, vector

STIFFNESS = 1.0  # g / l [1/s2]
DAMPING = 0.2  # [1/s]


def pendulum() -> ObserverModel:
    """``d angle = rate``, ``d rate = -a sin(angle) - d rate + torque``, the angle is measured [ours].

    In the normal form of Bouchama 2024, (1.10): A the shift matrix, the rest in phi, triangular and globally Lipschitz
    with the constant ``sqrt(a^2 + d^2)``. The thesis names a pendulum nowhere; it is the smallest system that has all
    the properties its chapter 1 asks for.
    """
    slopes = tuple(np.array([[0.0, 0.0], [a, -DAMPING]]) for a in (-STIFFNESS, STIFFNESS))
    return ObserverModel(
        name="pendulum",
        description="Damped pendulum driven by a torque, its angle measured",
        source="ours, in the normal form of Bouchama 2024, (1.10)",
        states=(state("angle", "rad", 0.0, "Angle from the lower rest"), state("rate", "rad/s", 0.0, "Angular speed")),
        inputs=(input_signal("torque", "rad/s2", 0.0, "Torque over the moment of inertia"),),
        measurements=(input_signal("angle", "rad", 0.0, "Measured angle"),),
        A=shift_matrix(2),
        B=np.array([[0.0], [1.0]]),
        C=np.array([[1.0, 0.0]]),
        phi=_remainder,
        lipschitz=float(np.hypot(STIFFNESS, DAMPING)),
        slopes=slopes,
    )


def _remainder(x: Array, _u: Array) -> Array:
    angle, rate = x
    return vector(0.0, -STIFFNESS * np.sin(angle) - DAMPING * rate)
