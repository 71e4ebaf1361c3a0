"""The models that observers know by name: what `model=` may say, of each kind."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from inspect import signature
from math import isfinite
from typing import Any, TypeVar

from fmu_observer.models.exhibits.cart_double_pendulum_model import cart_double_pendulum
from fmu_observer.models.exhibits.cart_pendulum_model import cart_pendulum
from fmu_observer.models.exhibits.flexible_joint_arm_model import flexible_joint_arm, flexible_joint_arm_as_printed
from fmu_observer.models.exhibits.four_state_example import non_triangularisable_example, triangularisable_example
from fmu_observer.models.exhibits.oscillator_models import time_varying_oscillator
from fmu_observer.models.exhibits.pendulum_model import linear_pendulum, pendulum, takagi_sugeno_pendulum
from fmu_observer.models.exhibits.tanh_model import tanh_system
from fmu_observer.models.observer_model import ObserverModel
from fmu_observer.models.state_affine import StateAffineModel
from fmu_observer.models.takagi_sugeno import TakagiSugenoModel
from fmu_observer.models.train.braked_train_model import braked_train
from fmu_observer.models.train.coupled_vehicles_model import coupled_vehicles
from fmu_observer.models.train.freight_train_model import freight_train, networked_train
from fmu_observer.models.train.takagi_sugeno_train_model import takagi_sugeno_train

Model = TypeVar("Model", ObserverModel, StateAffineModel, TakagiSugenoModel)

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
STATE_AFFINE_MODELS: dict[str, Callable[..., StateAffineModel]] = {
    "time_varying_oscillator": time_varying_oscillator,
    "excited_oscillator": partial(time_varying_oscillator, "lasting"),
}
TAKAGI_SUGENO_MODELS: dict[str, Callable[..., TakagiSugenoModel]] = {
    "triangularisable_example": triangularisable_example,
    "non_triangularisable_example": non_triangularisable_example,
    "takagi_sugeno_train": takagi_sugeno_train,
    "pendulum": takagi_sugeno_pendulum,
}


def find_model(model: str | ObserverModel, **numbers: float) -> ObserverModel:
    """The observer model itself, or the one of that name.

    Args:
        model: an ObserverModel, or a name in `MODELS`. numbers: of the plant, by name, for a model that is made of some
            (``mass``), in place of its own ones.

    Raises:
        ValueError: the name is unknown, or a number is not one of the model's or not legal.
    """
    if isinstance(model, ObserverModel) and numbers:
        raise ValueError(
            f"Observer model {model.name!r} is given, with numbers of its own; {', '.join(numbers)} belongs to a "
            f"model by name. Make the ObserverModel with the numbers of your plant."
        )
    return _find(model, ObserverModel, MODELS, "observer model", numbers)


def find_state_affine_model(model: str | StateAffineModel) -> StateAffineModel:
    """The state-affine model itself, or the one of that name in `STATE_AFFINE_MODELS`.

    Raises:
        ValueError: the name is unknown.
    """
    return _find(model, StateAffineModel, STATE_AFFINE_MODELS, "state-affine model", {})


def find_takagi_sugeno_model(model: str | TakagiSugenoModel) -> TakagiSugenoModel:
    """The Takagi-Sugeno model itself, or the one of that name in `TAKAGI_SUGENO_MODELS`.

    Raises:
        ValueError: the name is unknown.
    """
    return _find(model, TakagiSugenoModel, TAKAGI_SUGENO_MODELS, "Takagi-Sugeno model", {})


def _find(
    model: Any, kind: type[Model], known: Mapping[str, Callable[..., Model]], what: str, numbers: Mapping[str, Any]
) -> Model:
    if isinstance(model, kind):
        return model
    if not isinstance(model, str) or model not in known:
        raise ValueError(f"Unknown {what} {model!r}; known are: {', '.join(known)}. Or give {_article(kind)}.")
    _require_numbers(f"{what[0].upper()}{what[1:]} {model!r}", [*signature(known[model]).parameters], numbers)
    return known[model](**numbers)


def _article(kind: type) -> str:
    return f"{'an' if kind is ObserverModel else 'a'} {kind.__name__}"


def _require_numbers(where: str, own: list[str], numbers: Mapping[str, Any]) -> None:
    for name, value in numbers.items():
        if name not in own:
            has = f"it is made of {', '.join(own)}" if own else "its numbers are fixed; give an ObserverModel"
            raise ValueError(f"{where} has no number {name!r}: {has}.")
        if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value) or value < 0.0:
            raise ValueError(f"{where}: {name} = {value!r}, expected a number of at least zero.")
