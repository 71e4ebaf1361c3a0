"""Adaptive observer of a state-affine model whose output is predicted between samples."""

from __future__ import annotations

from typing import Any, Literal

from fmu_observer.models.state_affine import StateAffineModel
from fmu_observer.observers.generic.adaptive.adaptive_observer import AdaptiveObserver
from fmu_observer.observers.generic.adaptive.adaptive_presets import ADAPTIVE_PRESETS
from plant_models.hybrid import Array, Signal, state
from plant_models.hybrid.option import require_chosen

Sensitivity = Literal["continuous", "sampled"]
_SENSITIVITIES: tuple[Sensitivity, ...] = ("continuous", "sampled")


class AdaptivePredictor(AdaptiveObserver):
    """State and unknown constants of ``dx = A(t, u) x + B(t, u) + Phi(t, u) rho`` from samples: Hann 2014, (4.7).

    The equations are those of `adaptive_law` with ``c = C xh - w``, ``dw = C (A xh + B + Phi rhoh)``, ``w = y`` at a
    sample; the print leaves out ``C B``, which vanishes in its example.

    With ``sensitivity="sampled"`` [ours] the sensitivity of the innovation is predicted and reset like the output. The
    adaptation then puts no limit on the period: only the observer that knows the constants has one.

    Args:
        model: a state-affine model or the name of one. sensitivity: ``continuous`` as published, or ``sampled``.

    Raises:
        ValueError: the model or the sensitivity is unknown, or there are more than three unknown constants.

    Presets: `as_published` (default), mu 10, forgetting 1, R without limit. On the printed example R grows by e each
    second, for the second regressor fades. `repaired` [ours]: R at most 1e7, and a constant without excitation is
    held. On the printed example that is the second one: what it says is that it cannot be known.
    """

    name = "adaptive_predictor"
    description = "Adaptive observer at samples, output predicted between them"
    source = "Hann 2014, (4.7), theorem 4.1; cap, holding and covariance ours"
    presets = ADAPTIVE_PRESETS
    default_preset = "as_published"
    predicts = True
    option_choices = {
        **AdaptiveObserver.option_choices,
        "sensitivity": _SENSITIVITIES,
    }

    def __init__(
        self, model: str | StateAffineModel = "time_varying_oscillator", sensitivity: Sensitivity = "continuous"
    ) -> None:
        require_chosen(self.name, self.option_choices, sensitivity=sensitivity)
        super().__init__(model, sensitivity == "sampled", sensitivity=sensitivity)

    def kept_signal(self) -> Signal:
        """The predicted outputs, a state."""
        return state(
            "predicted_output", "1", (0.0,) * self.sizes.q, "Output predicted since the last sample", size=self.sizes.q
        )

    def acting(self, x: Any) -> Array:
        """``C xh - w``, shape (q,)."""
        return self.model.C @ self.estimates(x) - x.predicted_output

    def kept_after(self, x: Any, y: Array) -> dict[str, Array]:
        """The measurements."""
        return {"predicted_output": y}
