"""The second-order plant with a hyperbolic tangent, in its three readings. Knows only the hybrid foundation."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from plant_models.hybrid import Array, HybridSystem, output_signal, parameter, state
from plant_models.hybrid.option import require_chosen

Reading = Literal["minus", "as_published", "product"]


class TanhSystem(HybridSystem):
    """Oscillator ``dx1 = x2``, ``dx2 = -0.1 x1 - tanh(x1) x2``, x1 is measured: Hann 2014, (3.110).

    Printed is ``+ tanh(x1) x2``, and printed so the plant leaves every bound from its own start (5, 3): x1 is 2e4 after
    10 s. With the minus it stays on a closed orbit, ``|x1| <= 6.9``, and gives the published tables; so does
    ``tanh(x1 x2)``, ``|x1| <= 20.6``. Neither reading is in the thesis.

    Args:
        reading: ``minus``; ``as_published``, for runs of 3 s at most; ``product``, which is ``+ tanh(x1 x2)``.
    """

    name = "tanh_system"
    description = "Second-order plant with tanh(x1) x2"
    source = "Hann 2014, (3.110)"
    internal_step = 5e-3
    states = (state("first", "1", 5.0, "State x1"), state("second", "1/s", 3.0, "State x2, derivative of x1"))
    outputs = (output_signal("x1", "1", "State x1"), output_signal("x2", "1/s", "State x2"))
    parameters = (
        parameter("stiffness", "1/s2", 0.1, "Factor of x1", min=0.0),
        parameter("tanh_gain", "1/s", 1.0, "Factor of the term with tanh", min=0.0),
    )
    presets = {"large": {}, "small": {"first": 0.05, "second": 0.0}}
    default_preset = "large"
    option_choices = {"reading": ("minus", "as_published", "product")}

    def __init__(self, reading: Reading = "minus") -> None:
        require_chosen(self.name, self.option_choices, reading=reading)
        self.reading = reading
        super().__init__(reading=reading)

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        braked = p.tanh_gain * tanh_term(x.first, x.second, self.reading)
        return {"first": x.second, "second": -p.stiffness * x.first + braked}

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return {"x1": x.first, "x2": x.second}


def tanh_term(first: Array, second: Array, reading: Reading) -> Array:
    """The term with tanh, of one of the readings, without its factor.

    Args:
        first, second: states x1 [1] and x2 [1/s]. reading: see `TanhSystem`.
    """
    if reading == "product":
        return np.tanh(first * second)
    return (-1.0 if reading == "minus" else 1.0) * np.tanh(first) * second
