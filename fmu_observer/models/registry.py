"""The models that observers know by name: what `model=` may say."""

from __future__ import annotations

from collections.abc import Callable
from inspect import signature
from math import isfinite

from fmu_observer.models.braked_train import braked_train
from fmu_observer.models.cart_double_pendulum import cart_double_pendulum
from fmu_observer.models.cart_pendulum import cart_pendulum
from fmu_observer.models.coupled_vehicles import coupled_vehicles
from fmu_observer.models.flexible_joint_arm import flexible_joint_arm, flexible_joint_arm_as_printed
from fmu_observer.models.freight_train import freight_train
from fmu_observer.models.linear_pendulum import linear_pendulum
from fmu_observer.models.model import ObserverModel
from fmu_observer.models.networked_train import networked_train
from fmu_observer.models.pendulum import pendulum
from fmu_observer.models.tanh_system import tanh_system

MODELS: dict[str, Callable[..., ObserverModel]] = {
    "pendulum": pendulum,
    "linear_pendulum": linear_pendulum,
    "freight_train": freight_train,
    "networked_train": networked_train,
    "braked_train": braked_train,
    "coupled_vehicles": coupled_vehicles,
    "flexible_joint_arm": flexible_joint_arm,
    "flexible_joint_arm_as_printed": flexible_joint_arm_as_printed,
    "tanh_system": tanh_system,
    "cart_pendulum": cart_pendulum,
    "cart_double_pendulum": cart_double_pendulum,
}


def find_model(model: str | ObserverModel, **numbers: float) -> ObserverModel:
    """The model itself, or the one of that name.

    Args:
        model: an ObserverModel, or a name in `MODELS`. numbers: of the plant, by name, for a model that is made of some
            (``mass``), in place of its own ones.

    Raises:
        ValueError: the name is unknown, or a number is not one of the model's or not legal.
    """
    if isinstance(model, ObserverModel):
        if numbers:
            raise ValueError(
                f"Observer model {model.name!r} is given, with numbers of its own; {', '.join(numbers)} belongs to a "
                f"model by name. Make the ObserverModel with the numbers of your plant."
            )
        return model
    if not isinstance(model, str) or model not in MODELS:
        raise ValueError(f"Unknown observer model {model!r}; known are: {', '.join(MODELS)}. Or give an ObserverModel.")
    known = [*signature(MODELS[model]).parameters]
    for name, value in numbers.items():
        if name not in known:
            has = f"it is made of {', '.join(known)}" if known else "its numbers are fixed; give an ObserverModel"
            raise ValueError(f"Observer model {model!r} has no number {name!r}: {has}.")
        if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value) or value < 0.0:
            raise ValueError(f"Observer model {model!r}: {name} = {value!r}, expected a number of at least zero.")
    return MODELS[model](**numbers)
