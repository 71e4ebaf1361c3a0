"""A locomotive that rolls steadily, for what is linearised there."""

from __future__ import annotations

from plant_models import Locomotive
from plant_models.interop import operating_point

RADIUS = 0.575
"""Of the wheels of the locomotive [m]."""


def steady_train(speed: float) -> tuple[dict[str, float], dict[str, float]]:
    """States and inputs at which the locomotive runs at a speed [m/s]."""
    point = operating_point(
        Locomotive(),
        {"train_speed": speed, "wheel_rate": speed / RADIUS},
        {"effort": 1e3},
        hold=("train_position", "train_speed"),
        drift=("train_position",),
        find=("effort",),
    )
    return dict(point.states), dict(point.inputs)
