"""The models that observers know by name: what `model=` may say."""

from __future__ import annotations

from collections.abc import Callable

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

MODELS: dict[str, Callable[[], ObserverModel]] = {
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


def find_model(model: str | ObserverModel) -> ObserverModel:
    """The model itself, or the one of that name.

    Raises:
        ValueError: the name is unknown.
    """
    if isinstance(model, ObserverModel):
        return model
    if not isinstance(model, str) or model not in MODELS:
        raise ValueError(f"Unknown observer model {model!r}; known are: {', '.join(MODELS)}. Or give an ObserverModel.")
    return MODELS[model]()
