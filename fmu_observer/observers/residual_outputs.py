"""Residuals as outputs of an observer of a linear model: ``r = L_r (y - C xh)``, Aguiar Cota 2019, (2.21)-(2.25)."""

from __future__ import annotations

from typing import Any

import numpy as np

from fmu_observer.models.observer_model import ObserverModel, named_as
from plant_models.hybrid import Array, Signal, output_signal, parameter


def residual_gain(model: ObserverModel) -> Signal:
    """The parameter ``residual_gain``, L_r of shape (q, q), row by row; it starts as the identity.

    Args:
        model: whose q measurements.
    """
    q = len(model.measurements)
    text = "Gain L_r of the residuals, row by row"
    return parameter("residual_gain", "1", tuple(map(float, np.eye(q).ravel())), text, size=q * q)


def residual_outputs(model: ObserverModel) -> tuple[Signal, ...]:
    """An output ``residual_<measurement>`` for each measurement, in its unit.

    Args:
        model: whose measurements.
    """
    return tuple(
        output_signal(f"residual_{s.name}", s.unit, f"Residual, measured less estimated: {s.description}")
        for s in model.measurements
    )


def residuals(model: ObserverModel, difference: Array, p: Any) -> dict[str, Array]:
    """``L_r (y - C xh)`` by the names of the outputs.

    Args:
        model: whose measurements. difference: ``y - C xh``, shape (q,). p: parameters with `residual_gain`.
    """
    q = len(model.measurements)
    return named_as(model.measurements, np.reshape(p.residual_gain, (q, q)) @ difference, "residual_")
