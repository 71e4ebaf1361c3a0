"""O16: high-gain observer with the innovation of the last sample held."""

from __future__ import annotations

from typing import Any

import numpy as np

from fmu_observer.certificates.aperiodic import certify_sampled_error
from fmu_observer.certificates.finding import Finding, condition_found
from fmu_observer.certificates.gap_error import GapError
from fmu_observer.certificates.gap_finding import CONSTANT_GAP
from fmu_observer.certificates.impulsive_error import ImpulsiveError
from fmu_observer.models.observer_model import ObserverModel
from fmu_observer.observers.generic.sampled.high_gain_sampled import HighGainSampled
from fmu_observer.observers.generic.sampled.sampled_observer import per_measurement
from plant_models.hybrid import Array, memory


class HeldInnovation(HighGainSampled):
    """High-gain observer that holds the innovation of the last sample: Bouchama 2024, section 1.3, its reference 76.

    ``dxh = A xh + phi(xh, u) - theta inv(Delta) K eta``, ``eta = C xh(t_k) - y(t_k)`` on ``[t_k, t_k+1)``:
    `exponential_gain` without decay. For gaps that are short against 1/theta it converges faster, but its limit is
    lower:
    with K = (2, 1) and no drag constant gaps must stay below ``1 / theta``, against ``5 / theta``. The model must be a
    chain with its first block measured. Default theta: 1 1/s [ours]..
    """

    name = "held_innovation"
    description = "High-gain observer at aperiodic samples, innovation held"
    source = "Bouchama 2024, section 1.3, reference 76"
    theta_start = 1.0

    def declare_sampled_part(self, model: ObserverModel) -> None:
        self.extra_memory = (per_measurement(model, "innovation", "Error at the last sample, held", memory),)

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        predicted = self.model.flow(self.estimates(x), self.known(u))
        return self.named_estimates(predicted - self.correction(x, self.acting(x, p), p))

    def acting(self, x: Any, p: Any) -> Array:
        """The innovation as it acts now, shape (q,)."""
        return self.sampled_part(x)

    def update(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """The innovation is set anew; the estimates stay continuous."""
        return self.named_part(self.innovation(x, u))

    def vertex_error(self, drift: np.ndarray, p: Any) -> GapError:
        """``de = drift e - theta inv(Delta) K c``, ``dc = 0``, ``c = C e`` at a sample."""
        gain, decay = self.gain_matrices(p)
        return ImpulsiveError.with_innovation(drift, gain, 0.0 * decay, self.model.C, self.levels())

    def condition_of(self, p: Any) -> Finding:
        """``theta gap`` of the bare chain against its exact limits, constant and aperiodic, at the model's
        `sample_period`.
        """
        theta, gap = float(p.theta), self.model.sample_period
        found = certify_sampled_error((self.vertex_error(self.model.A, p),), gap, "bare chain")
        return condition_found(
            holds=bool(found.holds),
            numbers={
                "theta_gap": theta * gap,
                "constant_limit": theta * found.condition(CONSTANT_GAP).limit,
                "aperiodic_limit": theta * found.limit,
            },
            statement="theta_gap <= aperiodic_limit for the model without its nonlinear part; the "
            "finding about gaps takes that into account",
            source="exact transition over a gap; the thesis prints no condition",
        )
