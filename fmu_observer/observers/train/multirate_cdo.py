"""S4: cascade of two high-gain continuous-discrete observers for a sampled odometer and aperiodic balises."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from fmu_observer.certificates.certificate import Certificate
from fmu_observer.certificates.sampled_error import SampledError
from fmu_observer.formulas.correction.decaying_gain import HIGH_GAIN_K, correction
from fmu_observer.observers.train.high_gain_observer import HighGainTrainObserver
from fmu_observer.observers.train.wheel_stage import MultirateStage
from plant_models.hybrid.system import Array

STAGE = MultirateStage()


class MultirateCdo(HighGainTrainObserver):
    """Cascade of two continuous-discrete observers with measurements at two rates: Bouchama 2024, (3.50)-(3.87).

    First stage, odometer sampled every `odometer_period`, states ``x1 = r w`` and ``x2 = -(r^2 / J) F_ad``:
    ``dx1 = x2 + (r / J) T - theta_1 K1 eta_1``, ``dx2 = -theta_1^2 K2 eta_1``, ``d eta_1 = -theta_1 K1 eta_1``, and at
    a sample ``eta_1 = x1 - y``.
    Second stage: `HighGainTrainObserver` with ``F_ad = -(J / r^2) x2`` and gain `theta_2`.

    The printed scalings of x2 (``-int F_ad``, later ``-(r / J) F_ad``) are dimensionally wrong; the one above is
    re-derived. Preset `repaired`: printed gains theta_1 = theta_2 = 8, K = (2, 1), 10 Hz, with that scaling.
    """

    name = "multirate_cdo"
    description = "Cascade of two high-gain continuous-discrete observers, sampled odometer and balises"
    source = "Bouchama 2024, (3.50)-(3.87)"
    theta_name = "theta_2"
    first_stage_states = STAGE.states
    first_stage_parameters = STAGE.parameters
    estimator_events = STAGE.events
    stability_parameters = ("theta_2", "high_gain", "theta_1", "wheel_high_gain", "odometer_period")
    presets: Mapping[str, Mapping[str, Any]] = {
        "repaired": {
            "theta_1": 8.0,
            "theta_2": 8.0,
            "wheel_high_gain": HIGH_GAIN_K,
            "high_gain": HIGH_GAIN_K,
            "n_axles": 1.0,
        }
    }
    default_preset = "repaired"

    def adhesion(self, x: Any, u: Any, p: Any) -> Array:
        """``F_ad = -(J / r^2) x2`` [N]."""
        return STAGE.adhesion(x, u, p)

    def first_stage_flow(self, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """The wheel observer: ``r w``, its deceleration by adhesion, and the decaying innovation."""
        return STAGE.flow(x, u, p)

    def update(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """A balise or an odometer sample sets its innovation anew."""
        return super().update(event, t, x, u, p) if event == "balise" else STAGE.sampled(x, u)

    def error_certificate(self, max_gap: float, p: Any) -> Certificate:
        """Certificate of the balise stage, and the exact check of the wheel stage at its constant period."""
        certificate = super().error_certificate(max_gap, p)
        gain = correction(float(p.theta_1), p.wheel_high_gain, 1.0)
        wheel = SampledError.of([[0.0, 1.0], [0.0, 0.0]], gain, float(p.theta_1) * float(p.wheel_high_gain[0]))
        period = float(p.odometer_period)
        radius = wheel.spectral_radius(period)
        note = f"wheel stage at its odometer period of {period:g} s: spectral radius {radius:.4f}"
        return replace(certificate, holds=certificate.holds and radius < 1.0, notes=(*certificate.notes, note))
