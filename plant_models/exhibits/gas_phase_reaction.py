"""A gas-phase reaction in a closed reactor of which only the total pressure is measured. Knows only the hybrid
foundation.
"""

from __future__ import annotations

from typing import Any

from plant_models.exhibits.noisy_plant import NoisyPlant
from plant_models.hybrid import Array, discrete_output, output_signal, parameter, state


class GasPhaseReaction(NoisyPlant):
    """Reaction 2A -> B: ``dx1 = -2 b x1^2``, ``dx2 = b x1^2``, ``y = x1 + x2``: Omar 2012, (4.8.1) to (4.8.3).

    x1 and x2 are the partial pressures of A and B, scaled. ``x1(t) = x1(0) / (1 + 2 b x1(0) t)``, and ``x1 + 2 x2``
    stays what it is. Presets: `as_published` (default), b = 0.15 and samples each 0.01 s; the thesis prints no start,
    (2.5, 0.5) is ours. `wide_samples`, samples each 0.1 s, with which the rate can be distinguished from noise [ours].
    `literature`, b = 0.16, start (3, 1), samples each 0.1 s, as in Haseltine and Rawlings 2005.
    """

    name = "gas_phase_reaction"
    description = "Gas-phase reaction, total pressure measured"
    source = "Omar 2012, (4.8.1)-(4.8.3)"
    internal_step = 1e-2
    moving = (
        state("state_1", "1", 2.5, "Partial pressure of A, scaled"),
        state("state_2", "1", 0.5, "Partial pressure of B, scaled"),
    )
    plain_outputs = (
        output_signal("x1", "1", "Partial pressure of A, scaled"),
        output_signal("x2", "1", "Partial pressure of B, scaled"),
        output_signal("y", "1", "Total pressure without noise, now"),
    )
    presets = {
        "as_published": {},
        "wide_samples": {"sample_period": 0.1},
        "literature": {"rate": 0.16, "state_1": 3.0, "state_2": 1.0, "sample_period": 0.1},
    }
    default_preset = "as_published"

    def __init__(self) -> None:
        self.declare(
            (discrete_output("measured_y", "1", "Measured total pressure"),),
            (parameter("rate", "1/s", 0.15, "Rate b of the reaction", min=0.0),),
            period=1e-2,
        )
        super().__init__()

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        reaction = p.rate * x.state_1 * x.state_1
        return {"state_1": -2.0 * reaction, "state_2": reaction}

    def measured(self, x: Any, p: Any) -> tuple[Array, ...]:
        return (x.state_1 + x.state_2,)

    def plain(self, x: Any, p: Any) -> dict[str, Array]:
        return {"x1": x.state_1, "x2": x.state_2, "y": x.state_1 + x.state_2}
