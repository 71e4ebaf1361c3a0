"""Adaptive observer of a state-affine model whose innovation is held between samples."""

from __future__ import annotations

from typing import Any

from fmu_observer.models.state_affine import StateAffineModel
from fmu_observer.observers.generic.adaptive.adaptive_observer import AdaptiveObserver
from fmu_observer.observers.generic.adaptive.adaptive_presets import ADAPTIVE_PRESETS
from plant_models.hybrid import Array, Signal, memory


class AdaptiveHold(AdaptiveObserver):
    """State and unknown constants of ``dx = A(t, u) x + B(t, u) + Phi(t, u) rho`` from samples: Hann 2014, (4.65).

    The equations are those of `adaptive_law` with the innovation held, ``c = C xh(t_k) - y(t_k)``. The list (4.65a)
    leaves out ``lambda d rhoh``; the form (4.66) below it has it, and so has this observer.

    Args:
        model: a state-affine model or the name of one.

    Raises:
        ValueError: the model is unknown, or it has more than three unknown constants.

    Presets: those of `adaptive_predictor`. Use that one: on the printed example the longest period is 0.096 s here and
    0.12 s there.
    """

    name = "adaptive_hold"
    description = "Adaptive observer at samples, innovation held between them"
    source = "Hann 2014, (4.65)-(4.66), theorem 4.6; cap, holding and covariance ours"
    presets = ADAPTIVE_PRESETS
    default_preset = "as_published"
    predicts = False

    def __init__(self, model: str | StateAffineModel = "time_varying_oscillator") -> None:
        super().__init__(model, False)

    def kept_signal(self) -> Signal:
        """The held innovations, memory."""
        q = self.sizes.q
        return memory("held_innovation", "1", (0.0,) * q, "Innovation at the last sample", size=q)

    def acting(self, x: Any) -> Array:
        """The held innovation, shape (q,)."""
        return x.held_innovation

    def kept_after(self, x: Any, y: Array) -> dict[str, Array]:
        """``C xh - y``."""
        return {"held_innovation": self.model.C @ self.estimates(x) - y}
