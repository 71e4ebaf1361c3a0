"""Three states in a row, each driven by the next, with small nonlinear terms. Knows only the hybrid foundation."""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_models.exhibits.noisy_plant import NoisyPlant
from plant_models.hybrid import Array, discrete_output, output_signal, parameter, state


class ThreeStateCascade(NoisyPlant):
    """Cascade ``dx1 = x2 - e x1 |x2|^(1/3)``, ``dx2 = x3 + e x2 x3``, ``dx3 = c``, ``y = x1``: Omar 2012, (4.6.12) and
    (4.6.13).

    Printed: e = 0.07, c = 5, start (2, -2.7, 0.7). x3 grows without bound: it leaves the set [-3, 3] on which the
    thesis builds its tables after 0.46 s.
    """

    name = "three_state_cascade"
    description = "Three states in a row, of which the first is measured"
    source = "Omar 2012, (4.6.12)-(4.6.13)"
    moving = (
        state("state_1", "1", 2.0, "First state, which is measured"),
        state("state_2", "1/s", -2.7, "Second state"),
        state("state_3", "1/s2", 0.7, "Third state"),
    )
    plain_outputs = (
        output_signal("x1", "1", "First state"),
        output_signal("x2", "1/s", "Second state"),
        output_signal("x3", "1/s2", "Third state"),
    )
    presets = {"as_published": {}, "noisy": {"measurement_noise": 1e-4}}
    default_preset = "as_published"

    def __init__(self) -> None:
        self.declare(
            (discrete_output("measured_x1", "1", "Measured first state"),),
            (
                parameter("nonlinearity", "1", 0.07, "Factor e of the nonlinear terms"),
                parameter("ramp", "1/s3", 5.0, "Rate c of the third state"),
            ),
            period=1e-3,
        )
        super().__init__()

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        e, second, third = p.nonlinearity, x.state_2, x.state_3
        first = second - e * x.state_1 * np.abs(second) ** (1.0 / 3.0)
        return {"state_1": first, "state_2": third + e * second * third, "state_3": p.ramp}

    def measured(self, x: Any, p: Any) -> tuple[Array, ...]:
        return (x.state_1,)

    def plain(self, x: Any, p: Any) -> dict[str, Array]:
        return {"x1": x.state_1, "x2": x.state_2, "x3": x.state_3}
