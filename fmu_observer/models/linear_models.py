"""The linear part of an observer model: where linear designs begin. Plain NumPy."""

from __future__ import annotations

import numpy as np

from fmu_observer.models.observer_model import ObserverModel


def start_of(model: ObserverModel) -> np.ndarray:
    """Start of the estimates, shape (n,).

    Args:
        model: the plant as the observer knows it.
    """
    return np.array([float(s.start_values[0]) for s in model.states])


def linear_part(model: ObserverModel) -> np.ndarray:
    """Jacobian of the flow at the start of the estimates with zero inputs, shape (n, n); A itself for a linear
    model.
    """
    if model.phi is None:
        return model.A
    return np.asarray(model.jacobian(start_of(model), np.zeros(len(model.inputs))))
