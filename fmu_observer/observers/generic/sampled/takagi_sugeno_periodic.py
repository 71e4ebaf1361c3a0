"""O13: Takagi-Sugeno observer at periodic samples, innovation held, weights from the estimate."""

from __future__ import annotations

from typing import Any

from fmu_observer.observers.generic.sampled.takagi_sugeno_held import TakagiSugenoHeld
from plant_models.hybrid import Array, Signal, parameter


class TakagiSugenoPeriodic(TakagiSugenoHeld):
    """Takagi-Sugeno observer at periodic samples, innovation held: Bouchama 2024, (1.38)-(1.41).

    ``dxh = sum_i h_i(zh) [A_i xh + B_i u + L_i (y(kT) - C xh(kT))]`` on ``[kT, (k+1) T)``. The printed bracket is
    damaged; repaired to the held innovation with the sign that corrects. The weights follow the estimate. The unknown f
    of (1.38) with ``|f| <= alpha |F x|`` is met by `condition`, as the slope it tolerates.
    """

    name = "takagi_sugeno_periodic"
    description = "Takagi-Sugeno observer at periodic samples, innovation held"
    source = "Bouchama 2024, (1.38)-(1.41)"
    periodic = True

    def timing_parameters(self) -> tuple[Signal, ...]:
        """The sampling period."""
        return (parameter("sample_period", "s", self.model.max_gap, "Sampling period of the measurements", min=1e-6),)

    def weights(self, x: Any, u: Any) -> tuple[Array, ...]:
        """Weights at the estimate."""
        return self.model.weights(self.model.premise_values(self.estimates(x), self.known(u)))

    def premise_remark(self) -> str:
        """The weights are those of the estimate."""
        return "their change within a gap, the difference between the weights of estimate and truth"
