"""Detectability of the models that observers are built on: at every vertex, or somewhere of a nonlinear one. Raises in
words.
"""

from __future__ import annotations

import numpy as np

from fmu_observer.models.linear_models import linear_part
from fmu_observer.models.observer_model import ObserverModel
from fmu_observer.models.takagi_sugeno import TakagiSugenoModel
from fmu_observer.observability.measured_system import MeasuredSystem
from fmu_observer.observability.modes import UnobservableError, require_detectable

_POINTS = 4  # further states at which a nonlinear model is examined


def require_detectable_vertices(model: TakagiSugenoModel, asking: str) -> None:
    """At every vertex all measurements together see what does not decay: without that no gain makes all errors vanish.

    Args:
        model: the model. asking: observer or design, for the message.

    Raises:
        UnobservableError: a vertex has a mode that no measurement sees and that does not decay; the message says which.
    """
    names, scales = tuple(s.name for s in model.states), 1.0 / np.asarray(model.scaling)
    for i, A in enumerate(model.A):
        where = f"{asking} of {model.name}, vertex {i + 1}"
        require_detectable(MeasuredSystem(A, model.C, states=names, scales=scales, name=where))


def require_detectable_model(model: ObserverModel, asking: str) -> None:
    """The measurements see what does not decay; of a nonlinear model, at the start or at one of a few more states.

    Args:
        model: the model. asking: observer, for the message.

    Raises:
        UnobservableError: there is a mode that no measurement sees and that does not decay; the message says which.
    """
    names, where = tuple(s.name for s in model.states), f"{asking} of {model.name}"
    try:
        require_detectable(MeasuredSystem(linear_part(model), model.C, states=names, name=where))
    except UnobservableError:
        if not any(_detectable(MeasuredSystem(A, model.C)) for A in _elsewhere(model)):
            raise


def _elsewhere(model: ObserverModel) -> list[np.ndarray]:
    if model.phi is None:
        return []
    at = model.start + np.random.default_rng(0).normal(size=(_POINTS, model.order))
    jacobians = [np.asarray(model.jacobian(x, np.ones(len(model.inputs)))) for x in at]
    return [A for A in jacobians if np.isfinite(A).all()]


def _detectable(system: MeasuredSystem) -> bool:
    try:
        require_detectable(system)
    except UnobservableError:
        return False
    return True
