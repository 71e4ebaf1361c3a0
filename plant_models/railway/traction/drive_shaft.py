"""The drive shaft between traction motors and wheels: gear, and an elastic shaft that couples both inertias."""

from __future__ import annotations

from typing import Any

from plant_models.hybrid import Array, HybridSystem, input_signal, output_signal, parameter, state


class DriveShaft(HybridSystem):
    """Shaft with spring and damper: ``dtwist = w_motor - gear_ratio v_wheel / r``, ``T = k twist + d dtwist``.

    One motor stands for `motors` equal ones, each with a shaft of its own. `load_torque` acts on the motor, `effort =
    motors gear_ratio T / r` at the rims of all wheels. Twist and torque are on the side of the motor; the gear has no
    losses. `estimated_wheel_speed` is the speed of the rims that an estimated motor speed means, `torque_reference` the
    torque of a motor for `wanted_effort`; twist and inertia of the motor are left out of both.

    A motor has states of its own and so has the train: the shaft makes no algebraic loop of the two, and lets them be
    stepped at rates of their own. For that its oscillation, ``sqrt(k / J)`` of the motor, must be slow against the
    slower of both rates.

    Source: ours; standard two-mass drive.
    """

    name = "drive_shaft"
    description = "Elastic drive shaft with gear between traction motors and wheels"
    source = "ours"
    bounded_parameters = "all"
    states = (state("twist", "rad", 0.0, "Twist of the shaft, side of the motor"),)
    inputs = (
        input_signal("motor_speed", "rad/s", 0.0, "Speed of the motor's shaft", display_unit="rpm"),
        input_signal("wheel_speed", "m/s", 0.0, "Circumferential speed of the wheels", display_unit="km/h"),
        input_signal(
            "estimated_motor_speed", "rad/s", 0.0, "The same as an observer sees it", display_unit="rpm", optional=True
        ),
        input_signal("wanted_effort", "N", 0.0, "Effort that is asked of all motors", optional=True),
    )
    outputs = (
        output_signal("load_torque", "N.m", "Torque of the shaft against a motor"),
        output_signal("effort", "N", "Effort of all motors at the rims: traction > 0, brake < 0"),
        output_signal(
            "estimated_wheel_speed", "m/s", "Speed of the rims by the estimated motor speed", display_unit="km/h"
        ),
        output_signal("torque_reference", "N.m", "Torque asked of a motor"),
    )
    parameters = (
        parameter("motors", "1", 4.0, "Number of equal motors", min=1.0),
        parameter("gear_ratio", "1", 6.5, "Revolutions of a motor for one of the wheel", min=1e-3),
        parameter("wheel_radius", "m", 0.575, "Radius of the wheel", min=1e-3),
        parameter("stiffness", "N.m/rad", 1e4, "Stiffness k of the shaft, side of the motor", min=0.0),
        parameter("damping", "N.m.s/rad", 150.0, "Damping d of the shaft, side of the motor", min=0.0),
    )
    presets = {"locomotive": {}}
    default_preset = "locomotive"

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return {"twist": _slip(u, p)}

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        torque = p.stiffness * x.twist + p.damping * _slip(u, p)
        return {
            "load_torque": torque,
            "effort": p.motors * p.gear_ratio * torque / p.wheel_radius,
            "estimated_wheel_speed": u.estimated_motor_speed * p.wheel_radius / p.gear_ratio,
            "torque_reference": u.wanted_effort * p.wheel_radius / (p.motors * p.gear_ratio),
        }


def _slip(u: Any, p: Any) -> Array:
    """Speed of the motor less that of the wheels, side of the motor [rad/s]."""
    return u.motor_speed - p.gear_ratio * u.wheel_speed / p.wheel_radius
