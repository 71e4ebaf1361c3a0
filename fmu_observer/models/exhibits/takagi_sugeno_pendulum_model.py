"""The damped pendulum as a Takagi-Sugeno model: one premise, ``sin(angle)/angle``. Data only."""

from __future__ import annotations

import numpy as np

from fmu_observer.models.exhibits.pendulum_model import DAMPING, STIFFNESS, pendulum
from fmu_observer.models.sector_vertices import sector_nonlinearity
from fmu_observer.models.takagi_sugeno import Premise, TakagiSugenoModel
from plant_models.hybrid import Array

_LOWEST = -0.21723362821122166  # smallest value of sin(x)/x, at 4.4934 rad
_SMALL = 1e-4  # [rad]; below it the series 1 - x^2/6 is exact to rounding


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
