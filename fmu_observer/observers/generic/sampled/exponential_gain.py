"""O17: high-gain observer at aperiodic samples, its gain decaying exponentially since the last one."""

from __future__ import annotations

from typing import Any

import numpy as np

from fmu_observer.certificates.impulsive_error import ImpulsiveError
from fmu_observer.observers.generic.sampled.high_gain_sampled import HighGainSampled
from plant_models.hybrid import Array


class ExponentialGain(HighGainSampled):
    """High-gain observer at samples, its gain decaying since the last one: Bouchama 2024, (1.47)-(1.52).

    ``dxh = A xh + phi(xh, u) - theta inv(Delta) K eta``, ``d eta = -theta K_1 eta``, ``eta = C xh - y`` at a sample.
    The decay is that of the gain ``exp(-theta K_1 (t - t_k))``, with K_1 the first block of K where the thesis prints
    L^1; where several outputs are measured it is a matrix exponential. Written so it costs one more state a
    measurement, reset at samples, and no time stamp is stored. The model must be a chain with its first block measured.
    Default K: all poles of ``A - K C`` at -1, so (2, 1) for two states; default theta 2 1/s [ours].
    """

    name = "exponential_gain"
    description = "High-gain observer at aperiodic samples, gain decaying since the last"
    source = "Bouchama 2024, (1.47)-(1.52)"

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        eta = self.sampled_part(x)
        predicted = self.model.flow(self.estimates(x), self.known(u))
        return self.named_estimates(predicted - self.correction(x, eta, p)) | self.named_part(-self.decay(eta, p))

    def update(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """The innovation is set anew; the estimates stay continuous."""
        return self.named_part(self.innovation(x, u))

    def vertex_error(self, drift: np.ndarray, p: Any) -> ImpulsiveError:
        """``de = drift e - theta inv(Delta) K c``, ``dc = -theta K_1 c``, ``c = C e`` at a sample."""
        gain, decay = self.gain_matrices(p)
        return ImpulsiveError.with_innovation(drift, gain, decay, self.model.C, self.levels())
