"""The Takagi-Sugeno models that observers know by name: what `model=` of a Takagi-Sugeno observer may say."""

from __future__ import annotations

from collections.abc import Callable

from fmu_observer.models.non_triangularisable_example import non_triangularisable_example
from fmu_observer.models.takagi_sugeno import TakagiSugenoModel
from fmu_observer.models.takagi_sugeno_pendulum import takagi_sugeno_pendulum
from fmu_observer.models.takagi_sugeno_train import takagi_sugeno_train
from fmu_observer.models.triangularisable_example import triangularisable_example

TAKAGI_SUGENO_MODELS: dict[str, Callable[[], TakagiSugenoModel]] = {
    "triangularisable_example": triangularisable_example,
    "non_triangularisable_example": non_triangularisable_example,
    "takagi_sugeno_train": takagi_sugeno_train,
    "pendulum": takagi_sugeno_pendulum,
}


def find_takagi_sugeno_model(model: str | TakagiSugenoModel) -> TakagiSugenoModel:
    """The model itself, or the one of that name.

    Raises:
        ValueError: the name is unknown.
    """
    if isinstance(model, TakagiSugenoModel):
        return model
    if not isinstance(model, str) or model not in TAKAGI_SUGENO_MODELS:
        known = ", ".join(TAKAGI_SUGENO_MODELS)
        raise ValueError(f"Unknown Takagi-Sugeno model {model!r}; known are: {known}. Or give a TakagiSugenoModel.")
    return TAKAGI_SUGENO_MODELS[model]()
