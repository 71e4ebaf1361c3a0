"""The linear part of an observer model: where linear designs begin. Plain NumPy."""

from __future__ import annotations

import numpy as np

from fmu_observer.models.observer_model import ObserverModel


def linear_part(model: ObserverModel) -> np.ndarray:
    """Jacobian of the flow at the start of the estimates with zero inputs, shape (n, n); A itself for a linear
    model.
    """
    if model.phi is None:
        return model.A
    return np.asarray(model.jacobian(model.start, np.zeros(len(model.inputs))))
