"""S7, high-gain family: a wheel observer, then an augmented high-gain observer with the coupler force as an unknown."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from fmu_observer.certificates.finding import Finding
from fmu_observer.design.augmented_gains import augmented_matrix
from fmu_observer.observers.train.augmented_observer import ORDER, WAYS_OF_FIXES, AugmentedTrainObserver, Fixes
from fmu_observer.observers.train.high_gain_observer import TOP_SPEED
from fmu_observer.observers.train.train_resistance import drag_slope_range, rolling_drag
from fmu_observer.observers.train.wheel_stage import WHEEL_STAGES, MultirateStage
from plant_models.hybrid import Array, parameter
from plant_models.hybrid.option import require_chosen

_FirstStage = Literal["multirate", "differentiator"]

_AUGMENTED_K = (4.0, 6.0, 4.0, 1.0)  # all poles of A - K C at -1


class AugmentedHighGainCdo(AugmentedTrainObserver):
    """Cascade for a locomotive in a train: Bouchama 2024, (4.7)-(4.11).

    First stage: a wheel observer gives the adhesion force F_ad. Second stage: `AugmentedTrainObserver` with
    ``F = F_ad``, gains ``g_i = theta^i K_i`` and decay ``theta K_1``, theta by sensor.

    No gains are printed. K = (4, 6, 4, 1) puts all poles at -theta. Without drag, constant gaps below ``1.283 / theta``
    are stable and every mixture of gaps up to ``0.978 / theta`` is certified. Repaired: the scaling of F_ad (see
    `MultirateStage`), and the third state, which is an acceleration.

    Args:
        first_stage: ``multirate`` for an odometer sampled every `odometer_period`, ``differentiator`` for a fast one.
        fixes: how satellite fixes come: ``event``, or ``sampled`` from the input `fix_position`.

    Presets [ours]: `gps_and_balises` (default): theta 1.5 at balises, certified to 0.65 s between them, and 0.7 at
    fixes, a compromise between noise, which grows with theta, and coupler oscillations, which a small theta follows
    late; any mixture of both certified to 0.12 s, enough for 10 Hz. `gps`: fixes only, theta 0.7. `balises`: balises
    only, theta 1.75, certified to 0.559 s between them.
    """

    name = "augmented_high_gain_cdo"
    description = (
        "Wheel observer and augmented high-gain observer: speed, position and coupler force of a locomotive in a train"
    )
    source = "Bouchama 2024, (4.7)-(4.11); gains ours"
    presets = {
        "gps_and_balises": {"theta_balise": 1.5, "theta_gps": 0.7, "high_gain": _AUGMENTED_K},
        "gps": {"theta_balise": 0.0, "theta_gps": 0.7, "high_gain": _AUGMENTED_K},
        "balises": {"theta_balise": 1.75, "theta_gps": 0.0, "high_gain": _AUGMENTED_K},
    }
    default_preset = "gps_and_balises"
    stability_parameters = (
        "theta_balise",
        "theta_gps",
        "high_gain",
        "fix_period",
        *MultirateStage.stability_parameters,
    )
    option_choices = {"first_stage": tuple(WHEEL_STAGES), "fixes": WAYS_OF_FIXES}

    def __init__(self, first_stage: _FirstStage = "multirate", fixes: Fixes = "event") -> None:
        require_chosen(self.name, self.option_choices, first_stage=first_stage)
        self.stage = WHEEL_STAGES[first_stage]()
        self.own_states = self.stage.states
        self.own_parameters = (
            parameter(
                "theta_balise", "1/s", 1.5, "High gain at balises, at most 0.978 / longest gap; 0: not used", min=0.0
            ),
            parameter("theta_gps", "1/s", 0.7, "High gain at satellite fixes; 0: not used", min=0.0),
            parameter("high_gain", "1", _AUGMENTED_K, "Shape K of the high gain", size=ORDER),
            *self.stage.parameters,
        )
        self.own_events = self.stage.events
        super().__init__(fixes=fixes, first_stage=first_stage)

    def traction(self, x: Any, u: Any, p: Any) -> Array:
        """Adhesion force of the first stage [N]."""
        return self.stage.adhesion(x, u, p)

    def drag(self, x: Any, u: Any, p: Any) -> Array:
        """``b v + c v|v|`` [N]."""
        return rolling_drag(x.estimated_speed, p)

    def gains_of(self, sensor: str, p: Any) -> tuple[tuple[Array, ...], Array]:
        """``theta^i K_i`` and ``theta K_1``."""
        theta = p.theta_balise if sensor == "balise" else p.theta_gps
        return tuple(theta ** (i + 1) * p.high_gain[i] for i in range(ORDER)), theta * p.high_gain[0]

    def error_drifts(self, p: Any) -> tuple[np.ndarray, ...]:
        """Shift matrices with the smallest and the largest drag slope up to `TOP_SPEED`."""
        return tuple(augmented_matrix(float(slope)) for slope in drag_slope_range(p, 0.0, TOP_SPEED))

    def own_flow(self, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """Derivatives of the first stage."""
        return self.stage.flow(x, u, p)

    def own_jump(self, event: str, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """An odometer sample."""
        return self.stage.sampled(x, u)

    def gap_finding(self, gap: float, p: Any) -> Finding:
        """Certificate of the second stage, and for sampled odometers the exact check of the first at its constant
        period.
        """
        return self.stage.also_of(super().gap_finding(gap, p), p)
