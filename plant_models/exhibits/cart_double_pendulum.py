"""A cart with an inverted double pendulum, without friction, with its signs repaired or as printed. Knows only the
hybrid foundation.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from plant_models.exhibits.cart_pendulum import CartPendulum
from plant_models.exhibits.noisy_plant import NoisyPlant, solved_2
from plant_models.hybrid import Array, discrete_output, output_signal, parameter, state

Pair = tuple[Array, Array]


@dataclass(frozen=True)
class _DoublePendulumConstants:
    """Constants of section IV.2.2.3.

    Attributes:
        cart_mass: M [kg]. first_mass: m1 [kg]. second_mass: m2 [kg]. first_length: l1, joint to mass centre [m].
        second_length: l2 [m]. gravity: g [m/s2]. coupling_sign: of the coupling to the cart in A(q) [1].
        centrifugal_sign: of the terms with ``sin(a2 - a1)`` in b2 and b3 [1].
    """

    cart_mass: float = 1.5
    first_mass: float = 0.5
    second_mass: float = 0.75
    first_length: float = 0.5
    second_length: float = 0.75
    gravity: float = 9.81
    coupling_sign: float = 1.0
    centrifugal_sign: float = 1.0


SECTION_IV_2_2_3 = _DoublePendulumConstants()
_MEASURED = (
    discrete_output("measured_position", "m", "Measured position of the cart"),
    discrete_output("measured_first_angle", "rad", "Measured angle of the lower rod"),
    discrete_output("measured_second_angle", "rad", "Measured angle of the upper rod"),
)
_PARAMETERS = (
    parameter("cart_mass", "kg", SECTION_IV_2_2_3.cart_mass, "Mass M of the cart", min=1e-3),
    parameter("first_mass", "kg", SECTION_IV_2_2_3.first_mass, "Mass m1 of the lower rod", min=1e-3),
    parameter("second_mass", "kg", SECTION_IV_2_2_3.second_mass, "Mass m2 of the upper rod", min=1e-3),
    parameter("first_length", "m", SECTION_IV_2_2_3.first_length, "Half length l1 of the lower rod", min=1e-3),
    parameter("second_length", "m", SECTION_IV_2_2_3.second_length, "Half length l2 of the upper rod", min=1e-3),
    parameter("gravity", "m/s2", SECTION_IV_2_2_3.gravity, "Acceleration of gravity", min=0.0),
    parameter("coupling_sign", "1", 1.0, "Sign of the coupling to the cart; -1 as (4.11) prints it", min=-1.0, max=1.0),
    parameter(
        "centrifugal_sign", "1", 1.0, "Sign of the terms with sin(a2 - a1); -1 as (4.14) prints it", min=-1.0, max=1.0
    ),
)


class CartDoublePendulum(NoisyPlant):
    """Cart and inverted double pendulum of uniform rods: Allaoui 2024, (4.12) to (4.18), signs repaired.

    ``A(q) [x'', a1'', a2''] = [b1, b2, b3]``, angles absolute from upright, l1 and l2 to the mass centres. Repaired are
    the signs of the centrifugal terms with ``sin(a2 - a1)`` in b2 and b3: as printed in (4.14) the energy, 14.78 J, is
    26.17 J after 3 s of free fall. In (4.11) the signs of the coupling to the cart are those of angles that count
    towards -x, and the centrifugal terms of b1 those of angles that count towards +x: 335.2 J. The thesis prints no
    start, input or noise: (0.3, -0.2) rad at rest and no noise are ours.

    Presets: `repaired` (default), free fall from there; `as_published`, the same with the signs of (4.13) and (4.14);
    `as_published_4_11`, with those of (4.11); `annex_c`, repaired, with m1 = 0.2 kg as the annex has it; `noisy`,
    repaired, with noise of variance 1e-6 on each state and 1e-2 on each measurement [ours]; `upright`, repaired, at
    rest.
    """

    name = "cart_double_pendulum"
    description = "Cart with an inverted double pendulum, driven by a force"
    source = "Allaoui 2024, (4.11) to (4.18), section IV.2.2.3"
    moving = (
        *CartPendulum.moving[:2],
        state("lower_angle", "rad", 0.3, "Angle of the lower rod from upright"),
        state("lower_rate", "rad/s", 0.0, "Angular speed of the lower rod"),
        state("upper_angle", "rad", -0.2, "Angle of the upper rod from upright"),
        state("upper_rate", "rad/s", 0.0, "Angular speed of the upper rod"),
    )
    inputs = CartPendulum.inputs
    plain_outputs = (
        *CartPendulum.plain_outputs[:2],
        output_signal("first_angle", "rad", "Angle of the lower rod from upright"),
        output_signal("first_rate", "rad/s", "Angular speed of the lower rod"),
        output_signal("second_angle", "rad", "Angle of the upper rod from upright"),
        output_signal("second_rate", "rad/s", "Angular speed of the upper rod"),
        output_signal("energy", "J", "Kinetic and potential energy; zero height is that of the lower joint"),
    )
    presets = {
        "repaired": {},
        "as_published": {"centrifugal_sign": -1.0},
        "as_published_4_11": {"coupling_sign": -1.0},
        "annex_c": {"first_mass": 0.2},
        "noisy": {"process_noise": 1e-3, "measurement_noise": 0.1},
        "upright": {"lower_angle": 0.0, "upper_angle": 0.0},
    }
    default_preset = "repaired"

    def __init__(self) -> None:
        self.declare(_MEASURED, _PARAMETERS, period=1e-3)
        super().__init__()

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        acceleration, lower, upper = accelerations(*_turning(x), u.force, p)
        return {
            "cart_position": x.cart_speed,
            "cart_speed": acceleration,
            "lower_angle": x.lower_rate,
            "lower_rate": lower,
            "upper_angle": x.upper_rate,
            "upper_rate": upper,
        }

    def measured(self, x: Any, p: Any) -> tuple[Array, ...]:
        """Position and both angles: (4.18)."""
        return x.cart_position, x.lower_angle, x.upper_angle

    def plain(self, x: Any, p: Any) -> dict[str, Array]:
        (first, second), (first_rate, second_rate) = _turning(x)
        a11, a12, a13, a22, a23, a33 = _mass_matrix((first, second), p)
        speed = x.cart_speed
        kinetic = 0.5 * (a11 * speed**2 + a22 * first_rate**2 + a33 * second_rate**2)
        coupled = a12 * speed * first_rate + a13 * speed * second_rate + a23 * first_rate * second_rate
        heights = _both_masses(p) * p.first_length * np.cos(first) + p.second_mass * p.second_length * np.cos(second)
        values = (x.cart_position, speed, first, first_rate, second, second_rate)
        energy = kinetic + coupled + p.gravity * heights
        return dict(zip((s.name for s in self.plain_outputs), (*values, energy), strict=True))


def _turning(x: Any) -> tuple[Pair, Pair]:
    """Both angles and their rates."""
    return (x.lower_angle, x.upper_angle), (x.lower_rate, x.upper_rate)


def _both_masses(p: Any) -> Array:
    """What the lower joint carries, ``m1 + 2 m2`` [kg]."""
    return p.first_mass + 2.0 * p.second_mass


def _mass_matrix(angles: Pair, p: Any) -> tuple[Array, ...]:
    """Entries 11, 12, 13, 22, 23, 33 of the symmetric matrix A(q): (4.13)."""
    first, second = angles
    lower, upper = _both_masses(p) * p.first_length, p.second_mass * p.second_length
    return (
        p.cart_mass + p.first_mass + p.second_mass,
        p.coupling_sign * lower * np.cos(first),
        p.coupling_sign * upper * np.cos(second),
        4.0 * (p.first_mass / 3.0 + p.second_mass) * p.first_length**2,
        2.0 * upper * p.first_length * np.cos(second - first),
        4.0 / 3.0 * upper * p.second_length,
    )


def _right_hand_side(angles: Pair, rates: Pair, force: Array, p: Any) -> tuple[Array, Array, Array]:
    """b1, b2 and b3: (4.14), with its signs repaired or not."""
    (first, second), (first_rate, second_rate) = angles, rates
    lower, upper = _both_masses(p) * p.first_length, p.second_mass * p.second_length
    centrifugal = p.centrifugal_sign * 2.0 * upper * p.first_length * np.sin(second - first)
    return (
        force + lower * first_rate**2 * np.sin(first) + upper * second_rate**2 * np.sin(second),
        lower * p.gravity * np.sin(first) + centrifugal * second_rate**2,
        upper * p.gravity * np.sin(second) - centrifugal * first_rate**2,
    )


def accelerations(angles: Pair, rates: Pair, force: Array, p: Any) -> tuple[Array, Array, Array]:
    """Acceleration of the cart [m/s2] and angular accelerations of both rods [rad/s2]: (4.12) solved.

    Args:
        angles: of the lower and of the upper rod from upright [rad]. rates: their derivatives [rad/s].
        force: on the cart [N]. p: constants by the names of `_DoublePendulumConstants`.
    """
    return _solved_3(_mass_matrix(angles, p), _right_hand_side(angles, rates, force, p))


def _solved_3(matrix: tuple[Array, ...], right: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
    """Solution of a symmetric positive definite system of three equations, the first eliminated, then `solved_2`."""
    a11, a12, a13, a22, a23, a33 = matrix
    second, third = a12 / a11, a13 / a11
    rest = (a22 - second * a12, a23 - second * a13, a33 - third * a13)
    y, z = solved_2(rest, (right[1] - second * right[0], right[2] - third * right[0]))
    return (right[0] - a12 * y - a13 * z) / a11, y, z
