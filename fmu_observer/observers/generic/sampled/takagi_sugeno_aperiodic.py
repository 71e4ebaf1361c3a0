"""O19: Takagi-Sugeno observer at aperiodic samples, innovation and weights held."""

from __future__ import annotations

from typing import Any

import numpy as np

from fmu_observer.observers.generic.sampled.takagi_sugeno_held import TakagiSugenoHeld
from plant_models.hybrid import Array, Signal, memory, vector


class TakagiSugenoAperiodic(TakagiSugenoHeld):
    """Takagi-Sugeno observer at aperiodic samples, innovation and weights held: Bouchama 2024, (1.55).

    ``dxh = sum_i h_i(z(t_k)) [A_i xh + B_i u + L_i (y(t_k) - C xh(t_k))]`` on ``[t_k, t_k+1)``. Weights and innovation
    are frozen at the sample; the premises are read from the measurements there, and from the estimate where these do
    not give them. Printed with damaged brackets; repaired.

    Frozen weights leave an error of the order of what the premises change within a gap: it does not die out while the
    plant moves.
    """

    name = "takagi_sugeno_aperiodic"
    description = "Takagi-Sugeno observer at aperiodic samples, innovation and weights held"
    source = "Bouchama 2024, (1.55)"

    def weight_memory(self) -> tuple[Signal, ...]:
        """The weights, until the first sample those of the start."""
        start = self.model.weights(self.model.premise_values(self.model.start, np.zeros(len(self.model.inputs))))
        weights = tuple(map(float, start))
        return (memory("weight", "1", weights, "Weights h_i of the vertices at the last sample", size=len(weights)),)

    def held_weights(self, estimate: Array, u: Any) -> dict[str, Array]:
        """Weights at the sample."""
        measured, count = self.measured(u), len(self.model.sampled)
        best = self.model.informed(estimate, measured[:count], measured[count:] if self.model.continuous else None)
        return {"weight": vector(*self.model.weights(self.model.premise_values(best, self.known(u))))}

    def weights(self, x: Any, u: Any) -> tuple[Array, ...]:
        """Weights of the last sample."""
        return tuple(x.weight)

    def premise_remark(self) -> str:
        """The weights are those of the last sample."""
        return "what the premises change within a gap, an input to the error"
