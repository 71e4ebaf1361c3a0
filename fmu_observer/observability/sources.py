"""Where the matrices come from: an observer model, or any hybrid system at an operating point by its exact traced
Jacobians.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fmu_observer.models.linear_models import linear_part
from fmu_observer.models.observer_model import ObserverModel
from fmu_observer.models.takagi_sugeno import TakagiSugenoModel
from fmu_observer.observability.measured_system import MeasuredSystem
from fmu_observer.observability.modes import UnobservableError, require_detectable
from plant_models.hybrid import HybridSystem
from plant_models.interop.continuous_part import ContinuousPart, Values, filled, known
from plant_models.interop.to_control import jacobians

_POINTS = 4  # further states at which a nonlinear model is examined


def measured_plant(
    system: HybridSystem,
    x0: Values | None = None,
    u0: Values | None = None,
    *,
    continuous: Sequence[str] = (),
    sampled: Sequence[str] = (),
    preset: str | None = None,
    parameters: Mapping[str, float] | None = None,
    memory: Mapping[str, float] | None = None,
    scales: Mapping[str, float] | None = None,
    t: float = 0.0,
) -> MeasuredSystem:
    """A hybrid system, linearised about a point (`plant_models.interop.operating_point`), its outputs measured.

    Args:
        system: a traceable hybrid system, a plant or an observer; events do not enter.
        x0, u0: states and inputs of the point. continuous, sampled: names of outputs measured at all times, or at
            instants. preset, parameters, memory: of the system. scales: typical sizes of states by name.

    Raises:
        ValueError: a name is unknown, nothing is measured, or nothing in the system is continuous.
        TracingError: the system cannot be traced.
    """
    part = ContinuousPart(system, preset, parameters, memory)
    x = filled(dict(zip(part.states, part.start_state, strict=True)), x0, f"{system.name}: state")
    u = filled(dict(zip(part.inputs, part.start_inputs, strict=True)), u0, f"{system.name}: input")
    A, _, C, _ = jacobians(part, x, u, t)

    def rows(names: Sequence[str]) -> np.ndarray:
        places = [part.outputs.index(known(name, part.outputs, f"{system.name}: output")) for name in names]
        return np.asarray(C[places])

    sizes = filled(dict.fromkeys(part.states, 1.0), scales, f"{system.name}: scale of")
    return MeasuredSystem(A, rows(continuous), rows(sampled), part.states, sizes, system.name)


def measured_model(
    model: ObserverModel,
    sampled: Sequence[str] | None = None,
    x0: Sequence[float] | None = None,
    u0: Sequence[float] | None = None,
    scales: Mapping[str, float] | None = None,
) -> MeasuredSystem:
    """An observer model, linearised about a point.

    Args:
        model: the model. sampled: names of the measurements taken at instants, the others last; None for all of them.
        x0: states of the point, by default the model's starts. u0: inputs, likewise. scales: typical sizes of states by
            name.

    Raises:
        ValueError: a name is unknown, or a number of values is wrong.
    """
    names = [s.name for s in model.states]
    measured = [s.name for s in model.measurements]
    x = filled({s.name: s.start_values[0] for s in model.states}, x0, f"{model.name}: state")
    u = filled({s.name: s.start_values[0] for s in model.inputs}, u0, f"{model.name}: input")
    at_instants = [known(n, measured, f"{model.name}: measurement") for n in (measured if sampled is None else sampled)]
    rows = np.array([name in at_instants for name in measured], dtype=bool)
    sizes = filled(dict.fromkeys(names, 1.0), scales, f"{model.name}: scale of")
    A = np.asarray(model.jacobian(x, u), dtype=float)
    return MeasuredSystem(A, model.C[~rows], model.C[rows], names, sizes, model.name)


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
