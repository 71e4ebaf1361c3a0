"""The mission: the speed reference of a journey over a given distance, by time or by place.

A generator as a hybrid system of its own; knows the hybrid foundation and the closed form of the journey.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from plant_models.hybrid import Array, HybridSystem, discrete_output, input_signal, output_signal, parameter
from plant_models.hybrid.option import require_chosen
from plant_models.railway.control.logic import either, every, holds


@dataclass(frozen=True)
class _Trapezoid:
    """Speed over time from rest to rest. Where the distance is too short for the top speed, it is a triangle.

    Args:
        top_speed: [m/s], > 0. acceleration, deceleration: [m/s2], both > 0. distance: [m], > 0.
    """

    top_speed: Array
    acceleration: Array
    deceleration: Array
    distance: Array

    @property
    def peak(self) -> Array:
        """Highest speed reached [m/s]."""
        a, d = self.acceleration, self.deceleration
        return np.minimum(self.top_speed, np.sqrt(2.0 * self.distance * a * d / (a + d)))

    @property
    def durations(self) -> tuple[Array, Array, Array]:
        """Times of acceleration, hold and braking [s]."""
        v, a, d = self.peak, self.acceleration, self.deceleration
        held = np.maximum(self.distance - 0.5 * v * v / a - 0.5 * v * v / d, 0.0)
        return v / a, held / v, v / d

    def speed(self, elapsed: Array) -> Array:
        """Speed [m/s] at a time since the departure [s].

        Args:
            elapsed: time since the departure [s].
        """
        rising = self.acceleration * elapsed
        falling = self.deceleration * (sum(self.durations) - elapsed)
        return np.maximum(np.minimum(np.minimum(rising, self.peak), falling), 0.0)

    def phase(self, elapsed: Array) -> Array:
        """0 before the departure, 1 accelerating, 2 holding, 3 braking, 4 arrived.

        Args:
            elapsed: time since the departure [s].
        """
        up, hold, down = self.durations
        later = [np.where(elapsed >= instant, 1.0, 0.0) for instant in (0.0, up, up + hold, up + hold + down)]
        return later[0] + later[1] + later[2] + later[3]

    def position(self, elapsed: Array) -> Array:
        """Distance run [m].

        Args:
            elapsed: time since the departure [s].
        """
        up, hold, down = self.durations
        rising = np.clip(elapsed, 0.0, up)
        held = np.clip(elapsed - up, 0.0, hold)
        falling = np.clip(elapsed - up - hold, 0.0, down)
        braked = self.peak * falling - 0.5 * self.deceleration * falling * falling
        return 0.5 * self.acceleration * rising * rising + self.peak * held + braked


BrakingPoint = Literal["time", "position"]
_KMH_35, _KMH_50 = 35.0 / 3.6, 50.0 / 3.6
ARRIVED = 4.0


class Mission(HybridSystem):
    """Speed and acceleration reference: up with `acceleration`, hold `target_speed`, down with `deceleration` to the
    stop.

    With ``braking="time"`` the reference is the trapezoid whose area is `distance`. With ``braking="position"`` the
    brake begins where the input `position`, measured or estimated, meets the braking curve
    ``v = sqrt(2 d (distance - s))``, and the reference follows that curve: what was lost in slip is made up for before
    the stop. It falls to zero `stopping_tolerance` before the stopping point, where the curve is at
    ``sqrt(2 d tolerance)`` (0.2 m/s): without that a train that stands a millimetre short would be sent on.

    Where the distance is too short for the target speed, the train turns from acceleration to braking at once.

    Args:
        braking: ``time`` or ``position``.

    Raises:
        ValueError: an unknown option.

    Presets: `sc1` (35 km/h, soft acceleration 0.35 m/s2; default), `sc2` and `sc3` (35 km/h, nominal 0.5 m/s2), `sc4`
    (50 km/h, soft). All: 850 m, -0.4 m/s2.

    Source: Bouchama 2024, section 4.5 and Table 4.4; the trapezoid, the curve and the tolerance are ours.
    """

    name = "mission"
    description = "Mission: speed reference of a journey over a distance, braking by time or by position"
    source = "Bouchama 2024, section 4.5 and Table 4.4"
    internal_step = 1e-2  # nothing flows
    outputs = (
        output_signal("speed_reference", "m/s", "Speed to be driven", display_unit="km/h"),
        output_signal("acceleration_reference", "m/s2", "Acceleration to be driven"),
        output_signal("position_reference", "m", "Distance run by the reference in time"),
        discrete_output("phase", "1", "0 waiting, 1 accelerating, 2 holding, 3 braking, 4 arrived"),
    )
    parameters = (
        parameter("target_speed", "m/s", _KMH_35, "Speed of the hold phase", min=0.1, display_unit="km/h"),
        parameter("acceleration", "m/s2", 0.35, "Acceleration: 0.5 nominal, 0.35 soft", min=1e-3),
        parameter("deceleration", "m/s2", 0.4, "Deceleration, a positive number", min=1e-3),
        parameter("distance", "m", 850.0, "Distance from the start to the stop", min=1.0),
        parameter("departure_time", "s", 0.0, "Time of departure", min=0.0),
        parameter("start_position", "m", 0.0, "Position from which the distance counts"),
        parameter("stopping_tolerance", "m", 0.05, "Distance before the stop at which the reference is zero", min=0.0),
    )
    presets = {
        "sc1": {"target_speed": _KMH_35, "acceleration": 0.35},
        "sc2": {"target_speed": _KMH_35, "acceleration": 0.5},
        "sc3": {"target_speed": _KMH_35, "acceleration": 0.5},
        "sc4": {"target_speed": _KMH_50, "acceleration": 0.35},
    }
    default_preset = "sc1"
    option_choices = {"braking": ("time", "position")}

    def __init__(self, *, braking: BrakingPoint = "time") -> None:
        require_chosen(self.name, self.option_choices, braking=braking)
        self._by_position = braking == "position"
        if self._by_position:
            self.inputs = (input_signal("position", "m", 0.0, "Position of the train, measured or estimated"),)
        super().__init__(braking=braking)

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        elapsed = t - p.departure_time
        journey = _Trapezoid(p.target_speed, p.acceleration, p.deceleration, p.distance)
        values = (
            _by_curve(elapsed, u.position - p.start_position, p) if self._by_position else _by_time(elapsed, journey)
        )
        return {**values, "position_reference": journey.position(elapsed)}


def _by_time(elapsed: Array, journey: _Trapezoid) -> dict[str, Array]:
    phase = journey.phase(elapsed)
    return {
        "speed_reference": journey.speed(elapsed),
        "acceleration_reference": _acceleration(phase, journey.acceleration, journey.deceleration),
        "phase": phase,
    }


def _by_curve(elapsed: Array, run: Array, p: Any) -> dict[str, Array]:
    remaining = p.distance - run
    departed = holds(elapsed >= 0.0)
    rising = np.maximum(p.acceleration * elapsed, 0.0)
    ahead = np.minimum(rising, p.target_speed)
    curve = _braking_curve(remaining, p.deceleration)
    arrived = every(departed, holds(remaining <= p.stopping_tolerance))
    braking = every(departed, holds(curve <= ahead))
    cruising = either(holds(rising < p.target_speed), 1.0, 2.0)
    phase = departed * either(arrived, ARRIVED, either(braking, 3.0, cruising))
    return {
        "speed_reference": either(arrived, 0.0, np.minimum(ahead, curve)),
        "acceleration_reference": _acceleration(phase, p.acceleration, p.deceleration),
        "phase": phase,
    }


def _acceleration(phase: Array, acceleration: Array, deceleration: Array) -> Array:
    return np.where(phase == 1.0, acceleration, np.where(phase == 3.0, -deceleration, 0.0))


def _braking_curve(remaining: Array, deceleration: Array) -> Array:
    """Speed from which a constant deceleration stops within the remaining distance, ``sqrt(2 d s)`` [m/s]; 0 beyond the
    point.
    """
    return np.sqrt(2.0 * deceleration * np.maximum(remaining, 0.0))
