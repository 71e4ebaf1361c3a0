"""A cart with an inverted pendulum, friction in wheels and pivot. Knows only the hybrid foundation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from plant_models.exhibits.noisy_plant import NoisyPlant, solved_2
from plant_models.hybrid import Array, discrete_output, input_signal, output_signal, parameter, state


@dataclass(frozen=True)
class _CartPendulumConstants:
    """Constants of Table 4.1.

    Attributes:
        cart_mass: M [kg]. bob_mass: m [kg]. length: l, pivot to the mass centre [m]. inertia: J [kg.m2].
        cart_friction: b [N.s/m]. pivot_friction: d [N.m.s/rad]. gravity: g [m/s2].
    """

    cart_mass: float = 2.3
    bob_mass: float = 0.2
    length: float = 0.3
    inertia: float = 0.0099
    cart_friction: float = 0.05
    pivot_friction: float = 0.005
    gravity: float = 9.81


TABLE_4_1 = _CartPendulumConstants()


class CartPendulum(NoisyPlant):
    """Cart and inverted pendulum: Allaoui 2024, (4.4) and (4.5), solved for both accelerations, which is (4.7).

    ``(M + m) x'' + m l a'' cos a - m l a'^2 sin a = u - b x'`` and ``(m l^2 + J) a'' + m l x'' cos a - m g l sin a =
    -d a'``, the angle a counted from upright. The thesis prints no start, input, period or noise: 0.2 rad at rest,
    1 ms and no noise are ours.

    Presets: `free_fall` (default); `noisy`, with noise of variance 1e-6 on each state and 1e-2 on each measurement
    [ours]; `upright`, at rest.
    """

    name = "cart_pendulum"
    description = "Cart with an inverted pendulum, driven by a force"
    source = "Allaoui 2024, (4.1) to (4.10), Table 4.1"
    moving = (
        state("cart_position", "m", 0.0, "Position of the cart"),
        state("cart_speed", "m/s", 0.0, "Speed of the cart"),
        state("pendulum_angle", "rad", 0.2, "Angle of the pendulum from upright"),
        state("pendulum_rate", "rad/s", 0.0, "Angular speed of the pendulum"),
    )
    inputs = (input_signal("force", "N", 0.0, "Force on the cart"),)
    plain_outputs = (
        output_signal("position", "m", "Position of the cart"),
        output_signal("speed", "m/s", "Speed of the cart", display_unit="km/h"),
        output_signal("angle", "rad", "Angle of the pendulum from upright"),
        output_signal("rate", "rad/s", "Angular speed of the pendulum"),
        output_signal("energy", "J", "Kinetic and potential energy; zero height is that of the pivot"),
    )
    presets = {
        "free_fall": {},
        "noisy": {"process_noise": 1e-3, "measurement_noise": 0.1},
        "upright": {"pendulum_angle": 0.0},
    }
    default_preset = "free_fall"

    def __init__(self) -> None:
        self.declare(
            (
                discrete_output("measured_position", "m", "Measured position of the cart"),
                discrete_output("measured_angle", "rad", "Measured angle of the pendulum"),
            ),
            (
                parameter("cart_mass", "kg", TABLE_4_1.cart_mass, "Mass M of the cart", min=1e-3),
                parameter("bob_mass", "kg", TABLE_4_1.bob_mass, "Mass m of the pendulum", min=1e-3),
                parameter("length", "m", TABLE_4_1.length, "Distance l of pivot and mass centre", min=1e-3),
                parameter("inertia", "kg.m2", TABLE_4_1.inertia, "Inertia J of the pendulum", min=0.0),
                parameter("cart_friction", "N.s/m", TABLE_4_1.cart_friction, "Friction b of the cart", min=0.0),
                parameter("pivot_friction", "N.m.s/rad", TABLE_4_1.pivot_friction, "Friction d of the pivot", min=0.0),
                parameter("gravity", "m/s2", TABLE_4_1.gravity, "Acceleration of gravity", min=0.0),
            ),
            period=1e-3,
        )
        super().__init__()

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        acceleration, angular = accelerations(x.cart_speed, x.pendulum_angle, x.pendulum_rate, u.force, p)
        return {
            "cart_position": x.cart_speed,
            "cart_speed": acceleration,
            "pendulum_angle": x.pendulum_rate,
            "pendulum_rate": angular,
        }

    def measured(self, x: Any, p: Any) -> tuple[Array, ...]:
        """Position and angle: (4.8)."""
        return x.cart_position, x.pendulum_angle

    def plain(self, x: Any, p: Any) -> dict[str, Array]:
        speed, angle, rate, lever = x.cart_speed, x.pendulum_angle, x.pendulum_rate, p.bob_mass * p.length
        kinetic = 0.5 * (
            (p.cart_mass + p.bob_mass) * speed**2
            + 2.0 * lever * np.cos(angle) * speed * rate
            + (lever * p.length + p.inertia) * rate**2
        )
        energy = kinetic + lever * p.gravity * np.cos(angle)
        return {"position": x.cart_position, "speed": speed, "angle": angle, "rate": rate, "energy": energy}


def accelerations(speed: Array, angle: Array, rate: Array, force: Array, p: Any) -> tuple[Array, Array]:
    """Acceleration of the cart [m/s2] and angular acceleration [rad/s2]: (4.4) and (4.5) solved.

    Args:
        speed: of the cart [m/s]. angle: from upright [rad]. rate: angular speed [rad/s]. force: on the cart [N].
        p: constants by the names of `_CartPendulumConstants`.
    """
    lever, cosine, sine = p.bob_mass * p.length, np.cos(angle), np.sin(angle)
    matrix = (p.cart_mass + p.bob_mass, lever * cosine, lever * p.length + p.inertia)
    on_cart = force - p.cart_friction * speed + lever * rate**2 * sine
    on_pendulum = lever * p.gravity * sine - p.pivot_friction * rate
    return solved_2(matrix, (on_cart, on_pendulum))
