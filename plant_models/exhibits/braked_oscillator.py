"""An oscillator with a term that brakes it far from its centre, in the three variants of the thesis. Knows only the
hybrid foundation.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from plant_models.exhibits.noisy_plant import NoisyPlant
from plant_models.hybrid import Array, discrete_output, output_signal, parameter, state
from plant_models.hybrid.option import require_chosen

Variant = Literal["mixed", "speed", "root"]
STIFFNESS = 9.0  # printed factor of x1
BRAKING = {"mixed": 5.0, "speed": 5.0, "root": 7.5}  # printed factors of |x1|^2


class BrakedOscillator(NoisyPlant):
    """Oscillator ``dx1 = p1 x2``, ``dx2 = -9 x1 + p2 (1 - 5 |x1|^2) x2``: Omar 2012, (4.6.1) to (4.6.11).

    The thesis prints neither p1 nor p2. The default ``p1 = 1, p2 = 0.1`` [ours] keeps the limit cycle within the
    printed set ``[-1, 1] x [-3, 3]``, and the state within it follows from the output and its rate alone. Presets:
    `fits_set` (default); `chapter_2`, ``p1 = 1.5, p2 = 2.25`` of the thesis' other oscillator, which leaves the set and
    in which two states have one signature; `noisy`, the default with measurement noise of 0.03, 1 % of the largest
    output.

    Args:
        variant: ``mixed`` measures ``0.2 sin(x1) + x2``, (4.6.2); ``speed`` measures x2, (4.6.9); ``root`` has
            ``dx2 = -9 x1 + p2 (1 - 7.5 |x1|^2) sqrt(|x2|)`` and measures x1, (4.6.10) and (4.6.11).
    """

    name = "braked_oscillator"
    description = "Oscillator that is braked far from its centre"
    source = "Omar 2012, (4.6.1)-(4.6.11), Fig. 4.19"
    internal_step = 1.25e-3
    moving = (state("state_1", "1", -0.7, "First state"), state("state_2", "1/s", 1.5, "Second state"))
    plain_outputs = (
        output_signal("x1", "1", "First state"),
        output_signal("x2", "1/s", "Second state"),
        output_signal("y", "1/s", "Output without noise, now"),
    )
    presets = {
        "fits_set": {},
        "chapter_2": {"rate_factor": 1.5, "braking": 2.25},
        "noisy": {"measurement_noise": 0.03},
    }
    default_preset = "fits_set"
    option_choices = {"variant": ("mixed", "speed", "root")}

    def __init__(self, variant: Variant = "mixed") -> None:
        require_chosen(self.name, self.option_choices, variant=variant)
        self.variant: Variant = variant
        self.declare(
            (discrete_output("measured_y", "1/s", "Measured output"),),
            (
                parameter("rate_factor", "1", 1.0, "Factor p1 of x2 in the rate of x1"),
                parameter("braking", "1/s", 0.1, "Factor p2 of the braking term"),
            ),
            period=5e-3,
        )
        super().__init__(variant=variant)

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        first, second = x.state_1, x.state_2
        driven = np.sqrt(np.abs(second)) if self.variant == "root" else second
        braked = p.braking * (1.0 - BRAKING[self.variant] * first * first) * driven
        return {"state_1": p.rate_factor * second, "state_2": -STIFFNESS * first + braked}

    def measured(self, x: Any, p: Any) -> tuple[Array, ...]:
        mixed = 0.2 * np.sin(x.state_1) + x.state_2
        return ({"mixed": mixed, "speed": x.state_2, "root": x.state_1}[self.variant],)

    def plain(self, x: Any, p: Any) -> dict[str, Array]:
        return {"x1": x.state_1, "x2": x.state_2, "y": self.measured(x, p)[0]}
