"""Controller of the wind turbine: most power in weak wind, rated power in strong wind. Knows only the hybrid
foundation and the formula of the optimal torque.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_models.exhibits.wind_turbine.rotor import Rotor, optimal_torque_gain
from plant_models.hybrid import Array, HybridSystem, PeriodicEvent
from plant_models.hybrid.signal import discrete_output, input_signal, memory, parameter

LEAST_SPEED = 1.0  # [rad/s]; a generator that stands would be asked for an infinite torque


class WindTurbineController(HybridSystem):
    """Torque and pitch references from the measured speed and power of the generator, at each `sample_period`.

    Zone 2 (weak wind): pitch zero, torque ``K omega^2``. To zone 3 where the power reaches `rated_power` or the speed
    `rated_speed`. Zone 3: torque ``P_r / (eta_g omega)``, pitch by ``b(n) = b(n-1) + Kp e(n) + (Ki T - Kp) e(n-1)``,
    ``e = omega - rated_speed``, kept between `least_pitch` and `most_pitch` [ours: the thesis states no limits]. Back
    where the speed is below ``rated_speed - speed_margin``. The margin is 15 rad/s in the published benchmark and 5 in
    a script of it.

    All three blades take the one pitch reference.

    Source: Omar 2012, section 7.2.2; Odgaard, Stoustrup, Kinnaert 2009 (gains and zones).
    """

    name = "wind_turbine_controller"
    description = "Controller of a wind turbine: measured generator speed and power in, torque and pitch out"
    source = "Omar 2012, section 7.2.2; Odgaard, Stoustrup, Kinnaert 2009"
    internal_step = 1e-2  # nothing flows
    bounded_parameters = "all"
    states = (
        memory("strong_wind", "1", 0.0, "1 in zone 3, 0 in zone 2"),
        memory("held_pitch", "deg", 0.0, "Pitch reference"),
        memory("held_torque", "N.m", 0.0, "Torque reference"),
        memory("last_error", "rad/s", 0.0, "Speed of the generator above the rated one, at the last instant"),
    )
    inputs = (
        input_signal("generator_speed", "rad/s", 0.0, "Measured speed of the generator"),
        input_signal("generator_power", "W", 0.0, "Measured power of the generator"),
    )
    outputs = (
        discrete_output("torque_reference", "N.m", "Torque asked of the generator"),
        discrete_output("pitch_reference", "deg", "Pitch asked of the three blades"),
        discrete_output("zone", "1", "2 in weak wind, 3 in strong wind", integer=True),
    )
    parameters = (
        parameter("sample_period", "s", 0.01, "Time between two instants", min=1e-6),
        parameter(
            "optimal_gain",
            "N.m.s2/rad2",
            optimal_torque_gain(Rotor(), 0.97, 95.0),
            "Gain K of the torque in weak wind",
            min=0.0,
        ),
        parameter("rated_power", "W", 4.8e6, "Rated power P_r", min=0.0),
        parameter("rated_speed", "rad/s", 162.0, "Rated speed of the generator", min=1.0),
        parameter("speed_margin", "rad/s", 15.0, "How far below the rated speed zone 3 ends", min=0.0),
        parameter("generator_efficiency", "1", 0.98, "Efficiency of the generator eta_g", min=0.01, max=1.0),
        parameter("proportional_gain", "deg.s/rad", 4.0, "Gain Kp of the pitch", min=0.0),
        parameter("integral_gain", "deg/rad", 1.0, "Gain Ki of the pitch", min=0.0),
        parameter("least_pitch", "deg", 0.0, "Least pitch reference"),
        parameter("most_pitch", "deg", 90.0, "Largest pitch reference"),
    )
    events = (PeriodicEvent("sampling", "sample_period", description="References are computed"),)

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        error = u.generator_speed - p.rated_speed
        rated = np.where(u.generator_power >= p.rated_power, 1.0, np.where(error >= 0.0, 1.0, 0.0))
        strong = np.where(x.strong_wind > 0.0, np.where(error < -p.speed_margin, 0.0, 1.0), rated)
        share = p.integral_gain * p.sample_period - p.proportional_gain
        moved = x.held_pitch + p.proportional_gain * error + share * x.last_error
        pitch = np.where(strong > 0.0, np.clip(moved, p.least_pitch, p.most_pitch), p.least_pitch)
        speed = np.maximum(u.generator_speed, LEAST_SPEED)
        most_power = p.optimal_gain * u.generator_speed * u.generator_speed
        torque = np.where(strong > 0.0, p.rated_power / (p.generator_efficiency * speed), most_power)
        return {"strong_wind": strong, "held_pitch": pitch, "held_torque": torque, "last_error": error}

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return {"torque_reference": x.held_torque, "pitch_reference": x.held_pitch, "zone": 2.0 + x.strong_wind}

    def requirements(self, p: Any) -> dict[str, Array]:
        """Parameters keep their bounds, and the limits of the pitch are in order."""
        ordered = np.where(p.most_pitch >= p.least_pitch, 1.0, 0.0)
        return {**super().requirements(p), "most_pitch must not lie below least_pitch": ordered}
