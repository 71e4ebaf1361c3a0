"""O15: high-gain observer with an output predictor between samples."""

from __future__ import annotations

from typing import Any

import numpy as np

from fmu_observer.certificates.impulsive_error import ImpulsiveError
from fmu_observer.models.observer_model import ObserverModel
from fmu_observer.observers.generic.sampled.high_gain_sampled import HighGainSampled
from fmu_observer.observers.generic.sampled.sampled_observer import per_measurement
from plant_models.hybrid import Array


class OutputPredictor(HighGainSampled):
    """High-gain observer whose output is predicted between samples: Bouchama 2024, figure 1.2.

    ``dxh = A xh + phi(xh, u) - theta inv(Delta) K (C xh - w)``, ``dw = C (A xh + phi(xh, u))``, ``w = y`` at a sample.
    The thesis prints no equations, these are those of its references. Since ``d(C xh - w) = -theta K_1 (C xh - w)``, it
    is the observer `exponential_gain` in other coordinates: same estimates, same certificate, same condition. The model
    must be a chain with its first block measured.
    """

    name = "output_predictor"
    description = "High-gain observer with the output predicted between samples"
    source = "Bouchama 2024, figure 1.2, equations of its references"
    sampled_state = "predicted_output"

    def declare_sampled_part(self, model: ObserverModel) -> None:
        self.extra_states = (per_measurement(model, "predicted_output", "Output predicted since the last sample"),)

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        predicted = self.model.flow(self.estimates(x), self.known(u))
        error = self.model.measured(self.estimates(x)) - self.sampled_part(x)
        follows = self.named_part(self.model.measured(predicted))
        return self.named_estimates(predicted - self.correction(x, error, p)) | follows

    def update(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """The predicted output is set to the measured one."""
        return self.named_part(self.measured(u))

    def vertex_error(self, drift: np.ndarray, p: Any) -> ImpulsiveError:
        """``de = drift e - theta inv(Delta) K c``, ``dc = -theta K_1 c``, ``c = C e`` at a sample, with
        ``c = C xh - w``.
        """
        gain, decay = self.gain_matrices(p)
        return ImpulsiveError.with_innovation(drift, gain, decay, self.model.C, self.levels())
