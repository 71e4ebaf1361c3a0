"""The pendulum at small angles: the linear example on which the linear observers are shown. Data only."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fmu_observer.models.exhibits.pendulum_model import DAMPING, STIFFNESS, pendulum
from fmu_observer.models.observer_model import ObserverModel


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
