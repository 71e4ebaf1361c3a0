"""The robot arm with a flexible joint as its observers see it, in both readings of its weight. Data only."""

from __future__ import annotations

from functools import partial

import numpy as np

from fmu_observer.models.observer_model import ObserverModel, shift_matrix
from plant_models.exhibits.flexible_joint_arm import (
    DAMPING,
    DRIVE,
    STIFFNESS_LINK,
    STIFFNESS_MOTOR,
    WEIGHT,
    FlexibleJointArm,
    Gravity,
    checked_gravity,
)
from plant_models.hybrid import Array, input_signal, vector

_NAMES = ("motor_angle", "link_angle", "motor_speed", "link_speed")


def flexible_joint_arm(gravity: Gravity = "link_angle") -> ObserverModel:
    """Two angles on a network of two nodes: Hann 2014, (2.60) to (2.62), as a chain of two blocks of two states.

    Args:
        gravity: what the weight of the link depends on: ``link_angle``, or ``motor_speed`` as printed.

    Raises:
        ValueError: another word.
    """
    at = _NAMES.index(checked_gravity(gravity, "flexible_joint_arm"))
    return ObserverModel(
        name="flexible_joint_arm" + ("" if gravity == "link_angle" else "_as_printed"),
        description="Robot arm with a flexible joint, two angles measured by two nodes",
        source="Hann 2014, (2.60) to (2.62)" + (", the weight acting on the link's angle" if at == 1 else ""),
        states=FlexibleJointArm.states,
        inputs=(input_signal("drive", "1", 0.0, "Drive u of the motor"),),
        measurements=(
            input_signal("motor_angle", "rad", 0.0, "Angle of the motor, node 1"),
            input_signal("link_angle", "rad", 0.0, "Angle of the link, node 2"),
        ),
        A=shift_matrix(2, 2),
        B=np.array([[0.0], [0.0], [DRIVE], [0.0]]),
        C=np.eye(2, 4),
        phi=partial(_remainder, gravity),
        slopes=tuple(_slope(at, cosine) for cosine in (-1.0, 1.0)),
        event="packet",
    )


def flexible_joint_arm_as_printed() -> ObserverModel:
    """`flexible_joint_arm` with ``sin(x3)``, as printed."""
    return flexible_joint_arm("motor_speed")


def _remainder(gravity: Gravity, x: Array, _u: Array) -> Array:
    motor_angle, link_angle, motor_speed, _ = x
    twist = motor_angle - link_angle
    weight = WEIGHT * np.sin(link_angle if gravity == "link_angle" else motor_speed)
    return vector(0.0, 0.0, -STIFFNESS_MOTOR * twist - DAMPING * motor_speed, STIFFNESS_LINK * twist - weight)


def _slope(at: int, cosine: float) -> np.ndarray:
    slope = np.zeros((4, 4))
    slope[2, :3] = -STIFFNESS_MOTOR, STIFFNESS_MOTOR, -DAMPING
    slope[3, :2] = STIFFNESS_LINK, -STIFFNESS_LINK
    slope[3, at] -= WEIGHT * cosine
    return slope
