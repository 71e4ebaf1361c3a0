"""What an observer asks of its model: linear, one measurement, a chain of integrators. Raises in words where it is not
so.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fmu_observer.models.observer_model import ObserverModel, shift_matrix
from plant_models.hybrid import input_signal

_POINTS = 5  # states at which the structure of the Jacobian is looked at


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


def require_unknown_inputs(model: ObserverModel, observer: str) -> None:
    """The model is linear and declares unknown inputs.

    Args:
        model: the plant as the observer knows it. observer: name of the observer, for the message.

    Raises:
        ValueError: one of them is not so; the message says which, and what to do.
    """
    require_linear(model, observer, "thau")
    if not model.unknown_inputs:
        raise ValueError(
            f"{observer}: model {model.name!r} declares no unknown inputs. Use 'luenberger', or give an ObserverModel "
            f"with unknown_inputs and the matrix H by which they act."
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


def _require_one_output(model: ObserverModel, observer: str) -> None:
    """The model has one measurement.

    Args:
        observer: name of the observer, for the message.

    Raises:
        ValueError: it has several or none.
    """
    if len(model.measurements) != 1:
        raise ValueError(
            f"{observer}: model {model.name!r} has {len(model.measurements)} measurements, expected one. Use "
            f"'luenberger' or "
            "'thau', whose gains are of shape (n, q)."
        )


def require_triangular_chain(model: ObserverModel, observer: str) -> None:
    """A is the shift matrix, the first state is measured, and phi_i depends on x_1 ... x_i only: Bouchama 2024, (1.10).

    The last is read off the exact Jacobian of phi at a few states.

    Args:
        model: the plant as the observer knows it. observer: name of the observer, for the message.

    Raises:
        ValueError: one of them is not so; the message says which.
    """
    _require_one_output(model, observer)
    n = model.order
    where = f"{observer}: model {model.name!r} is not in the normal form (1.10): "
    if not np.array_equal(model.A, shift_matrix(n)):
        raise ValueError(
            f"{where}A must be the upper shift matrix with everything else in phi, got {model.A.tolist()}."
        )
    if not np.array_equal(model.C, np.eye(n)[:1]):
        raise ValueError(
            f"{where}the first state must be measured, C = {np.eye(n)[:1].tolist()}, got {model.C.tolist()}."
        )
    generator = np.random.default_rng(0)
    at = generator.normal(size=(_POINTS, n))
    remainders = [np.asarray(model.jacobian(x, np.ones(len(model.inputs)))) - model.A for x in at]
    above = np.abs(np.triu(np.stack(remainders), 1)).max(axis=0)
    if above.max() > 0.0:
        row, column = map(int, np.argwhere(above > 0.0)[0])
        names = [s.name for s in model.states]
        raise ValueError(
            f"{where}phi of {names[row]!r} must not depend on {names[column]!r}, which stands behind it in the chain."
        )
