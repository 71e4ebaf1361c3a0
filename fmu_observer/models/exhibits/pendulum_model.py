"""The damped pendulum driven by a torque, the small example on which every generic observer is shown: nonlinear, at
small angles, and as a Takagi-Sugeno model. Data only.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fmu_observer.models.observer_model import ObserverModel, shift_matrix
from fmu_observer.models.sector_vertices import sector_nonlinearity
from fmu_observer.models.takagi_sugeno import Premise, TakagiSugenoModel
from plant_models.hybrid import Array, input_signal, state, vector

_LOWEST = -0.21723362821122166  # smallest value of sin(x)/x, at 4.4934 rad
_SMALL = 1e-4  # [rad]; below it the series 1 - x^2/6 is exact to rounding

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


def linear_pendulum() -> ObserverModel:
    """``d angle = rate``, ``d rate = -a angle - d rate + torque``, the angle is measured [ours].

    The linearisation of `pendulum` at its lower rest, with the same signals.
    """
    return replace(
        pendulum(),
        name="linear_pendulum",
        description="Damped pendulum at small angles, its angle measured",
        source="ours, for Bouchama 2024, (1.1)",
        A=np.array([[0.0, 1.0], [-STIFFNESS, -DAMPING]]),
        phi=None,
        lipschitz=0.0,
        slopes=(),
    )


def takagi_sugeno_pendulum() -> TakagiSugenoModel:
    """``d angle = rate``, ``d rate = -a s angle - d rate + torque`` with the premise ``s = sin(angle)/angle`` [ours].

    Exact at every angle, since s stays in [-0.2173, 1]. The angle is measured at samples; nothing is measured
    continuously.
    """
    plain = pendulum()
    return sector_nonlinearity(
        premises=(Premise("restoring", "1", _LOWEST, 1.0, _sine_ratio, "sin(angle) / angle"),),
        A=lambda f: [[0.0, 1.0], [-STIFFNESS * f[0], -DAMPING]],
        B=lambda _f: [[0.0], [1.0]],
        name="pendulum",
        description=plain.description,
        source="ours, by sector nonlinearity",
        states=plain.states,
        inputs=plain.inputs,
        sampled=plain.measurements,
        continuous=(),
        C_sampled=plain.C,
        C_continuous=np.zeros((0, 2)),
    )


def _sine_ratio(x: Array, _u: Array) -> Array:
    angle, _ = x
    safe = np.where(np.abs(angle) < _SMALL, 1.0, angle)
    return np.where(np.abs(angle) < _SMALL, 1.0 - angle * angle / 6.0, np.sin(safe) / safe)
