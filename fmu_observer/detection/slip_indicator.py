"""The slip indicator: nominal or degraded adhesion from the filtered slip ratio. Uses the slip ratios and nothing else.

The raw ratio chatters about the threshold when the odometer is noisy, so a first-order filter stands before it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fmu_observer.detection.slip_ratio import odometer_slip
from plant_models.hybrid import Array, HybridSystem, input_signal, output_signal, parameter, state

NOMINAL, DEGRADED = 1.0, 2.0

FILTERED_SLIP = state("filtered_slip", "1", description="Slip ratio (3.49) behind the first-order filter")
SLIP_OUTPUTS = (
    output_signal("slip", "1", "Slip ratio relative to the odometer, (3.49), guarded by slip_floor"),
    output_signal("slip_indicator", "1", "1 nominal, 2 degraded adhesion"),
)
SLIP_PARAMETERS = (
    parameter("slip_floor", "m/s", 0.5, "Smallest denominator of the slip ratio", min=1e-6),
    parameter("slip_filter_time", "s", 0.2, "Time constant of the slip filter", min=0.01),
    parameter("slip_threshold", "1", 0.02, "Filtered slip above which adhesion counts as degraded", min=0.0),
    parameter("slip_min_speed", "m/s", 0.5, "Slip is judged only when odometer or train speed exceed this", min=0.0),
)


def slip_filter_derivative(filtered: Array, slip: Array, time_constant: Array) -> Array:
    """Derivative of the filtered slip [1/s]: first order, driven by the slip limited to [-1, 1].

    The limit [ours] bounds the memory of a wheel lock, where the guarded ratio reaches ``-v / floor``.

    Args:
        time_constant: of the filter [s].
    """
    return (np.clip(slip, -1.0, 1.0) - filtered) / time_constant


def indicator_level(filtered: Array, odometer: Array, speed: Array, threshold: Array, min_speed: Array) -> Array:
    """Indicator: 2 (degraded) where ``|filtered| > threshold``, else 1: Bouchama 2024, (3.49).

    Judged only when the wheel or the train moves faster than `min_speed` [m/s]. Either suffices, else a locked wheel
    (odometer zero) under a moving train would count as nominal.

    Args:
        speed: of the train [m/s].
    """
    moving = np.maximum(np.abs(odometer), np.abs(speed)) > min_speed
    return np.where(moving, np.where(np.abs(filtered) > threshold, DEGRADED, NOMINAL), NOMINAL)


class SlipIndicator(HybridSystem):
    """Slip and its indicator from an odometer and any train speed, estimated or measured: Bouchama 2024, (3.49).

    ``slip = (y - v) / max(|y|, floor)``, ``T d(filtered)/dt = slip - filtered``,
    ``indicator = 2 if |filtered| > threshold``.
    Presets: `simulation` (threshold 2 %) and `experiment` (15 %, Remark 16).
    """

    name = "slip_indicator"
    description = "Slip ratio and indicator of degraded adhesion from odometer and train speed"
    source = "Bouchama 2024, (3.49), (4.14)"
    states = (FILTERED_SLIP,)
    inputs = (
        input_signal("odometer", "m/s", 0.0, "Odometer speed r w"),
        input_signal("speed", "m/s", 0.0, "Train speed, estimated or measured"),
    )
    outputs = SLIP_OUTPUTS
    parameters = SLIP_PARAMETERS
    presets = {
        "simulation": {"slip_threshold": 0.02},
        "experiment": {"slip_threshold": 0.15},
    }
    default_preset = "simulation"

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        slip = odometer_slip(u.odometer, u.speed, p.slip_floor)
        return {"filtered_slip": slip_filter_derivative(x.filtered_slip, slip, p.slip_filter_time)}

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return {
            "slip": odometer_slip(u.odometer, u.speed, p.slip_floor),
            "slip_indicator": indicator_level(x.filtered_slip, u.odometer, u.speed, p.slip_threshold, p.slip_min_speed),
        }
