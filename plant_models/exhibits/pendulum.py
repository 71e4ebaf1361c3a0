"""The damped pendulum driven by a torque, the small nonlinear plant of the generic observers. Knows only the
foundation.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_models.hybrid import Array, HybridSystem, input_signal, output_signal, parameter, state


class Pendulum(HybridSystem):
    """Damped pendulum: ``d angle = rate``, ``d rate = -a sin(angle) - d rate + torque`` [ours].

    In the normal form of Bouchama 2024, (1.10): a chain of integrators with the rest in the last equation, globally
    Lipschitz. The thesis prints no plant for its chapter 1; this is the smallest one with all the properties that
    chapter asks for. It starts at 1 rad at rest, while its observers start at 0.

    Presets: `swinging` (default), `small` (0.05 rad, where the linear observers are right), `rest`.
    """

    name = "pendulum"
    description = "Damped pendulum driven by a torque"
    source = "ours, in the normal form of Bouchama 2024, (1.10)"
    internal_step = 5e-3
    states = (
        state("pendulum_angle", "rad", 1.0, "Angle from the lower rest"),
        state("pendulum_rate", "rad/s", 0.0, "Angular speed"),
    )
    inputs = (input_signal("torque", "rad/s2", 0.0, "Torque over the moment of inertia"),)
    outputs = (
        output_signal("angle", "rad", "Angle from the lower rest"),
        output_signal("rate", "rad/s", "Angular speed"),
    )
    parameters = (
        parameter("stiffness", "1/s2", 1.0, "Gravity over length, g / l", min=0.0),
        parameter("damping", "1/s", 0.2, "Damping over the moment of inertia", min=0.0),
    )
    presets = {
        "swinging": {},
        "small": {"pendulum_angle": 0.05},
        "rest": {"pendulum_angle": 0.0},
    }
    default_preset = "swinging"

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        turning = -p.stiffness * np.sin(x.pendulum_angle) - p.damping * x.pendulum_rate + u.torque
        return {"pendulum_angle": x.pendulum_rate, "pendulum_rate": turning}

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """Angle [rad] and rate [rad/s]."""
        return {"angle": x.pendulum_angle, "rate": x.pendulum_rate}
