"""The adaptive observers of a state-affine model: the innovation held, or the output predicted between samples."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

from fmu_observer.models.state_affine import StateAffineModel
from fmu_observer.observers.generic.adaptive.adaptive_observer import AdaptiveObserver
from plant_models.hybrid import Array, Signal, memory, state
from plant_models.hybrid.option import require_chosen

ADAPTIVE_PRESETS: Mapping[str, Mapping[str, Any]] = {
    "as_published": {"mu": 10.0, "forgetting": 1.0, "gain_floor": 0.0, "least_excitation": 0.0},
    # sin and cos of amplitude one through the observer at mu = 10 give 8e-4 and 2e-6
    "repaired": {"mu": 10.0, "forgetting": 1.0, "gain_floor": 1e-7, "least_excitation": 1e-7},
}


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
