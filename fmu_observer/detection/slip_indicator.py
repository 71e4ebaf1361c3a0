"""Slip ratios, the indicator of degraded adhesion from the filtered ratio, and that of excessive slip, confirmed and
held.

The raw ratio chatters about the threshold when the odometer is noisy, so a first-order filter stands before it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_models.hybrid import Array, HybridSystem, PeriodicEvent
from plant_models.hybrid.signal import Signal, discrete_output, input_signal, memory, output_signal, parameter, state

NOMINAL, DEGRADED = 1.0, 2.0

FILTERED_SLIP = state("filtered_slip", "1", description="Slip ratio (3.49) behind the first-order filter")


SLIP_OUTPUTS: tuple[Signal, ...] = (
    output_signal("slip", "1", "Slip ratio relative to the odometer, (3.49), guarded by slip_floor"),
    output_signal("slip_indicator", "1", "1 nominal, 2 degraded adhesion"),
)
SLIP_PARAMETERS: tuple[Signal, ...] = (
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
    states: tuple[Signal, ...] = (FILTERED_SLIP,)
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
        return {"slip": odometer_slip(u.odometer, u.speed, p.slip_floor), "slip_indicator": self._level(x, u, p)}

    @staticmethod
    def _level(x: Any, u: Any, p: Any) -> Array:
        return indicator_level(x.filtered_slip, u.odometer, u.speed, p.slip_threshold, p.slip_min_speed)


class ExcessiveSlip(SlipIndicator):
    """Slip beyond the threshold for a while, and the indicator held on afterwards: Bouchama 2024, sections 4.4 and
    Remark 16.

    The filtered slip of (3.49) is checked every `check_period`. Where it has been beyond `slip_threshold` at all checks
    over `confirm_time`, the indicator goes to 2, and stays there until `hold_time` has passed without an excess:
    spinning axles catch for a moment again and again, and a controller that follows each catch would hunt.

    `exceedance` is how far the filtered slip is beyond the threshold now, in the thesis's words "exceeded by 25
    points", and `peak_exceedance` the largest of the episode, kept until the indicator goes off.

    The threshold of 15 % is printed. Confirmation, hold and filter times are not: ours, the last that of
    `SlipIndicator`.

    Presets: `experiment` (15 %), `simulation` (2 %).
    """

    name = "excessive_slip"
    description = "Excessive slip from odometer and train speed: confirmed, held, and by how much"
    source = "Bouchama 2024, (4.14)-(4.15), Remark 16; times ours"
    internal_step = 1e-2
    states = (
        FILTERED_SLIP,
        memory("exceeding_time", "s", 0.0, "Time beyond the threshold without a break"),
        memory("quiet_time", "s", 0.0, "Time since the last excess that counted"),
        memory("held_level", "1", NOMINAL, "Indicator in force"),
        memory("held_exceedance", "1", 0.0, "Largest exceedance of the episode"),
    )
    outputs = (
        SLIP_OUTPUTS[0],
        discrete_output("slip_indicator", "1", "1 nominal, 2 excessive slip, confirmed and held"),
        output_signal("exceedance", "1", "Filtered slip beyond the threshold, 0 within"),
        discrete_output("peak_exceedance", "1", "Largest exceedance of the episode"),
    )
    parameters = (
        *SLIP_PARAMETERS[:2],
        parameter("slip_threshold", "1", 0.15, "Filtered slip beyond which it counts as excessive", min=0.0),
        *SLIP_PARAMETERS[3:],
        parameter("confirm_time", "s", 0.2, "Time beyond the threshold before the indicator goes on", min=0.0),
        parameter("hold_time", "s", 3.0, "Time the indicator stays on after the last excess", min=0.0),
        parameter("check_period", "s", 0.05, "Time between two checks", min=1e-4),
    )
    events = (PeriodicEvent("check", "check_period", description="The filtered slip is judged"),)
    presets = {
        "experiment": {"slip_threshold": 0.15},
        "simulation": {"slip_threshold": 0.02},
    }
    default_preset = "experiment"

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """A check: count the times beyond the threshold and since, judge, keep the largest exceedance."""
        over = self._level(x, u, p) == DEGRADED
        time = np.where(over, x.exceeding_time + p.check_period, 0.0)
        confirmed = time - p.check_period >= p.confirm_time - 1e-9  # at its first check an excess has lasted no time
        on_before = x.held_level == DEGRADED
        counts = np.where(over, np.where(on_before, 1.0, np.where(confirmed, 1.0, 0.0)), 0.0)
        quiet = np.where(counts > 0.0, 0.0, x.quiet_time + p.check_period)
        held = np.where(on_before, np.where(quiet <= p.hold_time + 1e-9, DEGRADED, NOMINAL), NOMINAL)
        level = np.where(counts > 0.0, DEGRADED, held)
        episode = np.where(over, 1.0, np.where(level == DEGRADED, 1.0, 0.0))
        peak = np.where(episode > 0.0, np.maximum(x.held_exceedance, self._exceedance(x, u, p)), 0.0)
        return {"exceeding_time": time, "quiet_time": quiet, "held_level": level, "held_exceedance": peak}

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        exceeding = {"exceedance": self._exceedance(x, u, p), "peak_exceedance": x.held_exceedance}
        return super().output(t, x, u, p) | {"slip_indicator": x.held_level} | exceeding

    def _exceedance(self, x: Any, u: Any, p: Any) -> Array:
        return np.where(self._level(x, u, p) == DEGRADED, np.abs(x.filtered_slip) - p.slip_threshold, 0.0)


def odometer_slip(odometer: Array, speed: Array, floor: Array) -> Array:
    """Slip relative to the odometer speed, ``(y - v) / max(|y|, floor)``: Bouchama 2024, (3.49) and (4.14), guarded.

    Without the guard it diverges at wheel lock (y = 0). A slip of 35 % here is 54 % by (3.13).

    Args:
        odometer: odometer speed y = r w [m/s]. speed: train speed, true or estimated [m/s].
        floor: smallest denominator [m/s], > 0.

    Returns:
        Slip ratio [1]; at wheel lock ``-v / floor``.
    """
    return (odometer - speed) / np.maximum(np.abs(odometer), floor)


def speed_slip_from_odometer_slip(odometer_slip_ratio: Array) -> Array:
    """(3.13) from (3.49): ``l / (1 - l)`` [1], for a moving train (l < 1) and speeds above the guards.

    Args:
        odometer_slip_ratio: ``(r w - v) / (r w)`` [1].
    """
    return odometer_slip_ratio / (1.0 - odometer_slip_ratio)
