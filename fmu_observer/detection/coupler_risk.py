"""The coupler-break risk indicator: levels from the tension in a coupler and how fast it rises. Knows no train."""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_models.hybrid import Array, HybridSystem, PeriodicEvent
from plant_models.hybrid.signal import discrete_output, input_signal, memory, output_signal, parameter, state

_LEVELS = (("warning", "warns", 0.4, 350e3), ("alarm", "alarms", 0.6, 700e3))
"""Of each level its name, what it does, share of the breaking load [1] and rate of the tension [N/s]."""


class CouplerRisk(HybridSystem):
    """Risk of a coupler to break, 0, 1 or 2, from its force, estimated or measured: Bouchama 2024, section 4.2 and
    figure 4.16.

    The thesis names the indicator as a block of its control and prints nothing of it; all of this is ours.

    A screw coupling breaks in tension; buffers take compression, which counts as zero. Level 1 (warning) where the
    tension is above `warning_share` of the breaking load, or rises faster than `warning_rate`; level 2 (alarm) with
    `alarm_share` and `alarm_rate`. The level goes up at once, and down only when tension and rate are below
    `release_ratio` times its limits. The rate is that of the tension behind a first-order filter of `rate_filter_time`,
    which also bounds what noise does to it. `peak_tension` is the largest tension of the last `peak_hold_time`, at
    checks every `check_period`.

    **Limits.** EN 15566 (which follows UIC 520) has three categories of draw gear and screw coupling, 1, 1.2 and 1.5
    MN; the breaking load of the coupling is 850 kN in the first category and 1350 kN in the last. Shares: 40 % as a
    warning and 60 % as an alarm, for couplings are rarely new and a force applied suddenly shows up to double. Rates:
    the full effort of 350 kN applied in one second is a warning, twice that an alarm.

    Presets: `category_1_mn` (default, breaking load 850 kN), `category_1_5_mn` (1350 kN).
    """

    name = "coupler_risk"
    description = "Risk that a coupler breaks, from its force and the rate of it, with hysteresis and peak hold"
    source = "Named in Bouchama 2024, section 4.2; breaking loads of EN 15566; levels ours"
    internal_step = 1e-2
    states = (
        state("filtered_tension", "N", 0.0, "Tension behind the filter"),
        memory("held_level", "1", 0.0, "Level in force"),
        memory("held_peak", "N", 0.0, "Largest tension of late"),
        memory("peak_instant", "s", 0.0, "When it was"),
        memory("checked", "1", 0.0, "1 after the first check"),
    )
    inputs = (input_signal("coupler_force", "N", 0.0, "Coupler force, pull positive"),)
    outputs = (
        discrete_output("risk", "1", "0 none, 1 warning, 2 alarm"),
        output_signal("utilisation", "1", "Tension over breaking load"),
        output_signal("tension_rate", "N/s", "Filtered rate of the tension"),
        discrete_output("peak_tension", "N", "Largest tension of the hold time"),
    )
    parameters = (
        parameter("break_force", "N", 850e3, "Breaking load of the coupling", min=1.0),
        *(
            parameter(f"{level}_share", "1", share, f"Share of the breaking load that {acts}", min=0.0, max=1.0)
            for level, acts, share, _ in _LEVELS
        ),
        *(
            parameter(f"{level}_rate", "N/s", rate, f"Rate of the tension that {acts}", min=0.0)
            for level, acts, _, rate in _LEVELS
        ),
        parameter("release_ratio", "1", 0.8, "Share of a limit below which its level is left", min=0.0, max=1.0),
        parameter("rate_filter_time", "s", 0.1, "Time constant of the filter of the rate", min=0.01),
        parameter("peak_hold_time", "s", 5.0, "Time for which a peak is held", min=0.0),
        parameter("check_period", "s", 0.02, "Time between two checks", min=1e-4),
    )
    events = (PeriodicEvent("check", "check_period", description="The tension is judged"),)
    presets = {
        "category_1_mn": {"break_force": 850e3},
        "category_1_5_mn": {"break_force": 1350e3},
    }
    default_preset = "category_1_mn"

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return {"filtered_tension": self._rate(x, u, p)}

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """A check: the level rises at once and falls with hysteresis; the peak is renewed or forgotten."""
        tension = _tension(u)
        filtered = np.where(x.checked > 0.0, x.filtered_tension, tension)  # one from the start has not risen
        rate = (tension - filtered) / p.rate_filter_time
        level = np.maximum(
            _level(tension, rate, 1.0, p), np.minimum(x.held_level, _level(tension, rate, p.release_ratio, p))
        )
        forgotten = np.where(t - x.peak_instant > p.peak_hold_time + 1e-9, 1.0, 0.0)
        renewed = np.where(tension >= x.held_peak, 1.0, forgotten)
        return {
            "filtered_tension": filtered,
            "held_level": level,
            "held_peak": np.where(renewed > 0.0, tension, x.held_peak),
            "peak_instant": np.where(renewed > 0.0, t, x.peak_instant),
            "checked": 1.0,
        }

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return {
            "risk": x.held_level,
            "utilisation": _tension(u) / p.break_force,
            "tension_rate": self._rate(x, u, p),
            "peak_tension": x.held_peak,
        }

    @staticmethod
    def _rate(x: Any, u: Any, p: Any) -> Array:
        return (_tension(u) - x.filtered_tension) / p.rate_filter_time


def _tension(u: Any) -> Array:
    return np.maximum(u.coupler_force, 0.0)


def _level(tension: Array, rate: Array, share_of_limits: Array, p: Any) -> Array:
    """Level of the limits, all of them times `share_of_limits`."""
    utilisation = tension / p.break_force
    warning = _over(utilisation, rate, share_of_limits * p.warning_share, share_of_limits * p.warning_rate)
    alarm = _over(utilisation, rate, share_of_limits * p.alarm_share, share_of_limits * p.alarm_rate)
    return np.where(alarm > 0.0, 2.0, warning)


def _over(utilisation: Array, rate: Array, share: Array, rate_limit: Array) -> Array:
    return np.where(utilisation > share, 1.0, np.where(rate > rate_limit, 1.0, 0.0))
