"""The driver: a speed profile and the controller that follows it on the odometer.

A controller as a hybrid system of its own; knows the hybrid foundation and the tables.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from plant_models.hybrid import Array, HybridSystem, Signal, input_signal, output_signal, parameter, state
from plant_models.hybrid.option import require_whole
from plant_models.railway.track.track import piecewise_linear

PROFILE_POINTS = 8
FEWEST_POINTS, MOST_POINTS = 4, 64  # the shipped profiles have four
_KMH_50 = 50.0 / 3.6
_PROFILE_D = ((0.0, 20.0, 65.0, 85.0), (0.0, _KMH_50, _KMH_50, 0.0))
_PROFILE_B = ((0.0, 30.0, 60.0, 90.0), (0.0, 50.0, 50.0, 0.0))


def _padded(points: Sequence[float], count: int) -> tuple[float, ...]:
    return (*points, *[points[-1]] * (count - len(points)))


def _presets(count: int) -> dict[str, dict[str, Any]]:
    """The presets for a profile of so many points."""
    profiles = {"profile_d": _PROFILE_D, "profile_b": _PROFILE_B}
    presets: dict[str, dict[str, Any]] = {
        name: {"profile_time": _padded(times, count), "profile_speed": _padded(speeds, count)}
        for name, (times, speeds) in profiles.items()
    }
    presets["profile_b"]["power_limit"] = 10e6
    return presets


def _profile(count: int) -> tuple[Signal, ...]:
    """Times and speeds of a profile of so many points, by default profile D."""
    times, speeds = (_padded(points, count) for points in _PROFILE_D)
    return (
        parameter("profile_time", "s", times, "Times of the speed profile, ascending", size=count),
        parameter("profile_speed", "m/s", speeds, "Speeds of the profile", min=0.0, size=count, display_unit="km/h"),
    )


class Driver(HybridSystem):
    """PI controller of the odometer speed along a profile: ``F = sat(Kp e + I)``, ``dI = Ki e + (F - Kp e - I) / T_t``.

    ``e`` is the profile minus the odometer. The demand ``F`` is limited to ``effort_limit`` both ways, and in traction
    to ``power_limit / |odometer|``; what the limits cut off is fed back into the integral over ``tracking_time``
    (anti-windup). The effort follows the demand with the lag of the traction chain, `effort_lag`.

    Feedback must come from the odometer: on the true speed the controller spins the wheel up in a degraded zone
    (independently measured). On the odometer, the printed gains need the lag: in a degraded zone the wheel itself
    answers an effort with ``v / (M g mu')``, 1 to 3 times ``1 / Kp``, so a controller without lag that is sampled at 10
    ms throws the wheel between spin and lock. With 0.2 s it holds for communication steps and odometers up to 0.1 s.

    Where the profile is at zero and the odometer below ``standstill_speed`` the train is held: the demand is the brake
    ``-holding_effort`` and the integral is let go over ``tracking_time``. The brake is released as soon as the profile
    rises.

    The profile is a broken line through (`profile_time`, `profile_speed`); unused points repeat the last.

    Args:
        profile_count: number of points of the profile.

    Raises:
        ValueError: the count is not a whole number from 4 to 64.

    Presets: `profile_d` (default): 50 km/h, up in 0-20 s, brake in 65-85 s, 902.8 m. `profile_b`: 50 m/s, 30 s each up,
    hold and down, 3000 m; near 50 m/s it needs 7.9 MW, more than the locomotive's 4.2 MW, so this preset raises
    `power_limit` to 10 MW. It also asks for more than the degraded adhesion gives, and slips by 13 to 19 % there.

    Source: gains Bouchama 2024, section 3.4.3; limits of the BB27000, section 4.1. The printed protocol (3 km at 50
    km/h with a brake phase in 70-80 s) contradicts itself: the two profiles are its two consistent readings. Limits,
    lag, anti-windup and hold are ours.
    """

    name = "driver"
    description = "Driver: speed profile and PI controller on the odometer, with effort and power limits"
    source = "Bouchama 2024, section 3.4.3 (gains) and section 4.1 (limits)"
    internal_step = 1e-2  # the integral's fastest time constant is tracking_time
    states = (
        state("integral", "N", 0.0, "Integral part of the effort"),
        state("developed_effort", "N", 0.0, "Effort the traction chain has built up"),
    )
    inputs = (input_signal("odometer", "m/s", 0.0, "Odometer speed", display_unit="km/h"),)
    outputs = (
        output_signal("effort", "N", "Effort demand: traction > 0, brake < 0"),
        output_signal("speed_reference", "m/s", "Speed of the profile", display_unit="km/h"),
    )
    parameters = (
        parameter("proportional_gain", "N.s/m", 7.2e5, "Proportional gain Kp", min=0.0),
        parameter("integral_gain", "N/m", 4.5e5, "Integral gain Ki", min=0.0),
        parameter("tracking_time", "s", 0.5, "Time constant of the anti-windup", min=0.05),
        parameter("effort_lag", "s", 0.2, "Time constant of the traction chain", min=0.01),
        parameter("effort_limit", "N", 350e3, "Largest effort, traction and brake", min=1.0),
        parameter("power_limit", "W", 4.2e6, "Largest traction power", min=1.0),
        parameter("holding_effort", "N", 60e3, "Brake effort that holds the train at standstill", min=0.0),
        parameter(
            "standstill_speed",
            "m/s",
            0.1,
            "Odometer speed below which the train counts as standing",
            min=0.0,
            display_unit="km/h",
        ),
        *_profile(PROFILE_POINTS),
    )
    presets = _presets(PROFILE_POINTS)
    default_preset = "profile_d"
    option_choices = {"profile_count": range(FEWEST_POINTS, MOST_POINTS + 1)}

    def __init__(self, *, profile_count: int = PROFILE_POINTS) -> None:
        require_whole("driver", FEWEST_POINTS, MOST_POINTS, profile_count=profile_count)
        own = tuple(s for s in type(self).parameters if not s.name.startswith("profile_"))
        self.parameters = (*own, *_profile(profile_count))
        self.presets = _presets(profile_count)
        super().__init__(profile_count=profile_count)

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """Derivatives of the integral part and of the developed effort [N/s]."""
        error = self._reference(t, p) - u.odometer
        wanted = p.proportional_gain * error + x.integral
        limited = _limited(wanted, u.odometer, p)
        standing = self._standing(t, u, p)
        following = p.integral_gain * error + (limited - wanted) / p.tracking_time
        demand = np.where(standing > 0.0, -np.minimum(p.holding_effort, p.effort_limit), limited)
        return {
            "integral": np.where(standing > 0.0, -x.integral / p.tracking_time, following),
            "developed_effort": (demand - x.developed_effort) / p.effort_lag,
        }

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return {"effort": x.developed_effort, "speed_reference": self._reference(t, p)}

    @staticmethod
    def _reference(t: Array, p: Any) -> Array:
        return piecewise_linear(t, p.profile_time, p.profile_speed)

    def _standing(self, t: Array, u: Any, p: Any) -> Array:
        """1 where the train is to stand and does, else 0."""
        slow = np.where(np.abs(u.odometer) < p.standstill_speed, 1.0, 0.0)
        return np.where(self._reference(t, p) <= 0.0, slow, 0.0)


def _limited(effort: Array, odometer: Array, p: Any) -> Array:
    """Effort within the brake limit and the traction limits of effort and power [N]."""
    # Above power_limit / effort_limit the hyperbola of constant power is lower than the effort limit, below it is never
    # reached.
    corner = p.power_limit / p.effort_limit
    traction_limit = p.power_limit / np.maximum(np.abs(odometer), corner)
    return np.minimum(np.maximum(effort, -p.effort_limit), traction_limit)
