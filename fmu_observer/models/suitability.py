"""What an observer asks of its model: linear, one measurement, a chain of integrators. Raises in words where it is not
so.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fmu_observer.models.observer_model import ObserverModel
from plant_models.hybrid import input_signal


def require_linear(model: ObserverModel, observer: str, instead: str) -> None:
    """The model has no nonlinear remainder.

    Raises:
        ValueError: it has one; the message names the observer to take instead.
    """
    if model.phi is not None:
        raise ValueError(
            f"{observer}: model {model.name!r} is nonlinear (it has a remainder phi), not dx = A x + B u. Use "
            f"{instead!r}, or "
            f"give a linearised ObserverModel."
        )


def with_unknown_inputs(model: ObserverModel, observer: str) -> ObserverModel:
    """The model with its unknown inputs; where it declares none, they act where its known inputs act, ``H = B``.

    Args:
        model: the plant as the observer knows it. observer: name of the observer, for the message.

    Raises:
        ValueError: it declares none, and no known input acts on it linearly.
    """
    if model.unknown_inputs:
        return model
    acting = [i for i in range(len(model.inputs)) if np.any(model.B[:, i])]
    if not acting:
        raise ValueError(
            f"{observer}: model {model.name!r} declares no unknown inputs, and has no matrix B by which the error of a "
            f"known one could act. Give an ObserverModel with unknown_inputs and the matrix H by which they act."
        )
    known = [model.inputs[i] for i in acting]
    errors = (input_signal(f"{s.name}_error", s.unit, 0.0, f"What acts beyond: {s.description}") for s in known)
    return replace(model, unknown_inputs=tuple(errors), H=model.B[:, acting])


def linear_part(model: ObserverModel) -> ObserverModel:
    """A linear model with the mean of the drifts of `model` for A; itself where it is linear.

    Args:
        model: with or without phi; without slopes what is linear of it is A.
    """
    if model.phi is None:
        return model
    A = np.mean(model.drifts, axis=0) if model.slopes else model.A
    return replace(model, A=A, phi=None, lipschitz=0.0, slopes=())


def require_mass(model: str, **masses: float) -> None:
    """Masses of a model that is made of numbers are above zero.

    Args:
        model: name of the model, for the message. masses: by name [kg].

    Raises:
        ValueError: one is not.
    """
    for name, value in masses.items():
        if not value > 0.0:
            raise ValueError(f"Observer model {model!r}: {name} = {value!r} kg, expected a mass above zero.")
