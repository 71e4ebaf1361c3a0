"""The Van der Pol oscillator with three parameters, the example of graphical signatures. Knows only the foundation."""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_models.hybrid import Array, HybridSystem, input_signal, output_signal, parameter, state

LARGEST, LARGEST_SHIFT = 10.0, 1.0


class VanDerPol(HybridSystem):
    """Oscillator ``dx1 = p1 x2``, ``dx2 = -9 x1 + p2 (1 - (x1 + p3)^2) x2``, ``y = x1``: Omar 2012, (2.5.1).

    p1 lies in [1, 2], p2 in [1.5, 3], p3 in [0, 0.1]. The inputs are added to the parameters, so that a fault changes
    one of them at any time; the sums are kept within 0 to 10 and, of p3, within -1 to 1: beyond, the oscillator leaves
    every bound or becomes too stiff for its step. The thesis prints no start: (1, 0) is ours; after 20 s the limit
    cycle is reached.

    Presets: `nominal` (default), `quick` with p1 = 2, `stiff` with p2 = 3, `shifted` with p3 = 0.1.
    """

    name = "van_der_pol"
    description = "Van der Pol oscillator with three parameters that may change"
    source = "Omar 2012, (2.5.1)"
    internal_step = 5e-3
    states = (
        state("oscillation", "1", 1.0, "State x1, which is measured"),
        state("oscillation_rate", "1", 0.0, "State x2, derivative of x1 over p1"),
    )
    inputs = (
        input_signal("p1_change", "1/s", 0.0, "Added to p1", optional=True),
        input_signal("p2_change", "1/s", 0.0, "Added to p2", optional=True),
        input_signal("p3_change", "1", 0.0, "Added to p3", optional=True),
    )
    outputs = (
        output_signal("measured", "1", "Measured y = x1"),
        output_signal("x2", "1", "State x2"),
    )
    parameters = (
        parameter("p1", "1/s", 1.5, "Rate of x1 by x2", min=0.0, max=LARGEST),
        parameter("p2", "1/s", 2.25, "Strength of the damping that changes its sign", min=0.0, max=LARGEST),
        parameter("p3", "1", 0.0, "Shift of the damping", min=-LARGEST_SHIFT, max=LARGEST_SHIFT),
        parameter("stiffness", "1/s", 9.0, "Rate of x2 by x1", min=0.0, max=100.0),
    )
    presets = {
        "nominal": {},
        "quick": {"p1": 2.0},
        "stiff": {"p2": 3.0},
        "shifted": {"p3": 0.1},
    }
    default_preset = "nominal"

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        p1, p2 = np.clip(p.p1 + u.p1_change, 0.0, LARGEST), np.clip(p.p2 + u.p2_change, 0.0, LARGEST)
        shifted = x.oscillation + np.clip(p.p3 + u.p3_change, -LARGEST_SHIFT, LARGEST_SHIFT)
        damped = p2 * (1.0 - shifted * shifted) * x.oscillation_rate
        return {"oscillation": p1 * x.oscillation_rate, "oscillation_rate": -p.stiffness * x.oscillation + damped}

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return {"measured": x.oscillation, "x2": x.oscillation_rate}
