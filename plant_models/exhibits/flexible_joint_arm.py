"""Robot arm with a flexible joint: two angles, two speeds, each angle measured by a node of its own. Knows only the
hybrid foundation.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from plant_models.hybrid import Array, HybridSystem, input_signal, output_signal, parameter, state
from plant_models.hybrid.option import require_chosen

Gravity = Literal["link_angle", "motor_speed"]
GRAVITY: tuple[Gravity, ...] = ("link_angle", "motor_speed")

STIFFNESS_MOTOR, STIFFNESS_LINK = 48.6, 19.5  # of the joint over the moments of inertia [1/s2]
DAMPING = 1.25  # of the motor [1/s]
DRIVE = 21.6  # motor torque constant over its moment of inertia [rad/s2]
WEIGHT = 3.3  # of the link over its moment of inertia [1/s2]


class FlexibleJointArm(HybridSystem):
    """A motor turns a link through a spring: Hann 2014, (2.60) to (2.62).

    ``d motor_speed = -48.6 (motor_angle - link_angle) - 1.25 motor_speed + 21.6 u``,
    ``d link_speed = 19.5 (motor_angle - link_angle) - 3.3 sin(g)``. The thesis prints ``g = x3``, the motor speed; the
    weight of a link acts on its angle, x2, and so do the sources of this benchmark. As printed the rest is unstable
    (eigenvalues ``0.67 +- 8.43 j`` 1/s) and the arm ends in a limit cycle. It is driven by the printed
    ``u = 0.1 sin t`` times `drive_gain`, plus the input `drive`; the drive that acts is an output, for the observer.

    Args:
        gravity: what the weight depends on: ``link_angle``, or ``motor_speed`` as printed.

    Raises:
        ValueError: another word.
    """

    name = "flexible_joint_arm"
    description = "Robot arm with a flexible joint, two angles measured"
    source = "Hann 2014, (2.60) to (2.62)"
    states = (
        state("motor_angle", "rad", 0.0, "Angle of the motor"),
        state("link_angle", "rad", 0.0, "Angle of the link"),
        state("motor_speed", "rad/s", 0.0, "Angular speed of the motor"),
        state("link_speed", "rad/s", 0.0, "Angular speed of the link"),
    )
    inputs = (input_signal("drive", "1", 0.0, "Added to the printed drive", optional=True),)
    outputs = (
        output_signal("measured_motor_angle", "rad", "Angle of the motor"),
        output_signal("measured_link_angle", "rad", "Angle of the link"),
        output_signal("true_motor_speed", "rad/s", "Angular speed of the motor"),
        output_signal("true_link_speed", "rad/s", "Angular speed of the link"),
        output_signal("total_drive", "1", "Drive u that acts"),
    )
    parameters = (parameter("drive_gain", "1", 1.0, "Size of the printed drive"),)
    option_choices = {"gravity": GRAVITY}

    def __init__(self, gravity: Gravity = "link_angle") -> None:
        self.gravity = checked_gravity(gravity, self.name)
        super().__init__(gravity=gravity)

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        twist = x.motor_angle - x.link_angle
        return {
            "motor_angle": x.motor_speed,
            "link_angle": x.link_speed,
            "motor_speed": -STIFFNESS_MOTOR * twist - DAMPING * x.motor_speed + DRIVE * self._drive(t, u, p),
            "link_speed": STIFFNESS_LINK * twist - WEIGHT * np.sin(getattr(x, self.gravity)),
        }

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        names = [s.name for s in self.outputs[:4]]
        return dict(zip(names, x, strict=True)) | {"total_drive": self._drive(t, u, p)}

    @staticmethod
    def _drive(t: Array, u: Any, p: Any) -> Array:
        return p.drive_gain * 0.1 * np.sin(t) + u.drive


def checked_gravity(gravity: Gravity, where: str) -> Gravity:
    """Name of the state on which the weight depends.

    Args:
        gravity: one of `GRAVITY`. where: what asks, for the message.

    Raises:
        ValueError: another word.
    """
    require_chosen(where, {"gravity": GRAVITY}, gravity=gravity)
    return gravity
