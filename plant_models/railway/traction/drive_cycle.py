"""What a drive is asked for: speed and load torque as steps in time, turning to and fro where wanted."""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_models.hybrid import Array, HybridSystem, discrete_output, parameter

RPM_1000 = 1000.0 * 2.0 * float(np.pi) / 60.0
RPM_100 = 0.1 * RPM_1000


class DriveCycle(HybridSystem):
    """Speed reference and load torque of a drive, as functions of time.

    The reference is `speed`, turned round every `reversal_period` from that instant on (0: never). The load is
    `load_torque_after` from `load_time` on, and `load_torque_before` until then. It acts against positive rotation, and
    does not turn round with the speed.

    Presets: `load_step` (S1, default): 1000 rpm, 0.05 N.m at 0.5 s; `reversal` (S2): 1000 rpm, turned round at 0.5 s,
    under 0.05 N.m; `low_speed` (S3): 100 rpm, turned round every 0.25 s, under 0.05 N.m.

    Source: Allaoui 2024, section III.3, Figs. 3.10, 4.16-4.18; speeds and the periods of the reversals are ours.
    """

    name = "drive_cycle"
    description = "Speed reference and load torque of a drive, in steps"
    source = "Allaoui 2024, section III.3, Figs. 3.10, 4.16-4.18; speeds are ours"
    internal_step = 1e-2  # nothing flows
    bounded_parameters = "all"
    outputs = (
        discrete_output("speed_reference", "rad/s", "Speed asked for", display_unit="rpm"),
        discrete_output("load_torque", "N.m", "Torque of the load against the rotation"),
    )
    parameters = (
        parameter("speed", "rad/s", RPM_1000, "Speed asked for at first", display_unit="rpm"),
        parameter("reversal_period", "s", 0.0, "Time from one reversal of the speed to the next; 0: none", min=0.0),
        parameter("load_torque_before", "N.m", 0.0, "Torque of the load before `load_time`"),
        parameter("load_torque_after", "N.m", 0.05, "Torque of the load from `load_time` on"),
        parameter("load_time", "s", 0.5, "Instant at which the load changes"),
    )
    presets = {
        "load_step": {},
        "reversal": {"reversal_period": 0.5, "load_torque_before": 0.05},
        "low_speed": {"speed": RPM_100, "reversal_period": 0.25, "load_torque_before": 0.05},
    }
    default_preset = "load_step"

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        turns = p.reversal_period > 0.0
        # An instant that is on the edge but for rounding is on the edge.
        passed = np.floor(t / np.where(turns, p.reversal_period, 1.0) + 1e-9)
        odd = passed - 2.0 * np.floor(0.5 * passed)
        loaded = t >= p.load_time - 1e-9
        return {
            "speed_reference": p.speed * np.where(turns, 1.0 - 2.0 * odd, 1.0),
            "load_torque": np.where(loaded, p.load_torque_after, p.load_torque_before) + 0.0 * t,
        }
