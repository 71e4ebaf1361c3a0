"""The state-affine models that adaptive observers know by name: what their `model=` may say."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from fmu_observer.models.state_affine import StateAffineModel
from fmu_observer.models.time_varying_oscillator import time_varying_oscillator

STATE_AFFINE_MODELS: dict[str, Callable[[], StateAffineModel]] = {
    "time_varying_oscillator": time_varying_oscillator,
    "excited_oscillator": partial(time_varying_oscillator, "lasting"),
}


def find_state_affine_model(model: str | StateAffineModel) -> StateAffineModel:
    """The model itself, or the one of that name.

    Raises:
        ValueError: the name is unknown.
    """
    if isinstance(model, StateAffineModel):
        return model
    if not isinstance(model, str) or model not in STATE_AFFINE_MODELS:
        known = ", ".join(STATE_AFFINE_MODELS)
        raise ValueError(f"Unknown state-affine model {model!r}; known are: {known}. Or give a StateAffineModel.")
    return STATE_AFFINE_MODELS[model]()
