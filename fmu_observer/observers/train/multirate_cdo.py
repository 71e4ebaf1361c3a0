"""S4: cascade of two high-gain continuous-discrete observers for a sampled odometer and aperiodic balises."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from fmu_observer.certificates import Certificate, SampledError
from fmu_observer.observers.train.high_gain import HIGH_GAIN_K, correction, innovation_decay
from fmu_observer.observers.train.high_gain_observer import HighGainTrainObserver
from plant_models.hybrid import PeriodicEvent, parameter, state, vector
from plant_models.hybrid.system import Array

WHEEL_SPEED, WHEEL_DECELERATION, WHEEL_INNOVATION = 3, 4, 5  # indices behind position, speed and balise innovation


class MultirateCdo(HighGainTrainObserver):
    """Cascade of two continuous-discrete observers with measurements at two rates: Bouchama 2024, (3.50)-(3.87).

    First stage, odometer sampled every `odometer_period`, states ``x1 = r w`` and ``x2 = -(r^2 / J) F_ad``:
    ``dx1 = x2 + (r / J) T - theta_1 K1 eta_1``, ``dx2 = -theta_1^2 K2 eta_1``, ``d eta_1 = -theta_1 K1 eta_1``, and at a sample
    ``eta_1 = x1 - y``.
    Second stage: `HighGainTrainObserver` with ``F_ad = -(J / r^2) x2`` and gain `theta_2`.

    The printed scalings of x2 (``-int F_ad``, later ``-(r / J) F_ad``) are dimensionally wrong; the one above is re-derived.
    Preset `repaired`: printed gains theta_1 = theta_2 = 8, K = (2, 1), 10 Hz, with that scaling.
    """

    name = "multirate_cdo"
    description = "Cascade of two high-gain continuous-discrete observers, sampled odometer and balises"
    source = "Bouchama 2024, (3.50)-(3.87)"
    theta_name = "theta_2"
    first_stage_states = (
        state("wheel_speed_estimate", "m/s", 0.0, "Estimate of the wheel circumferential speed r w"),
        state("adhesion_deceleration", "m/s2", 0.0, "Deceleration of r w by adhesion, -(r^2/J) F_ad"),
        state("odometer_innovation", "m/s", 0.0, "Error seen at the last odometer sample, decaying since"),
    )
    first_stage_parameters = (
        parameter("theta_1", "1/s", 8.0, "High gain of the wheel observer; stable up to 5 / odometer_period", min=0.0),
        parameter("wheel_high_gain", "1", HIGH_GAIN_K, "Shape K of the wheel observer's gain", size=2),
        parameter("odometer_period", "s", 0.1, "Sampling period of the odometer", min=1e-4),
    )
    estimator_events = (PeriodicEvent("odometer_sample", "odometer_period", description="The odometer is read"),)
    stability_parameters = ("theta_2", "high_gain", "theta_1", "wheel_high_gain", "odometer_period")
    presets: Mapping[str, Mapping[str, Any]] = {
        "repaired": {"theta_1": 8.0, "theta_2": 8.0, "wheel_high_gain": HIGH_GAIN_K, "high_gain": HIGH_GAIN_K, "n_axles": 1.0}
    }
    default_preset = "repaired"

    def adhesion(self, x: Array, u: Any, p: Any) -> Array:
        """``F_ad = -(J / r^2) x2`` [N]."""
        return -p.n_axles * p.wheel_inertia / p.wheel_radius**2 * x[WHEEL_DECELERATION]

    def first_stage_flow(self, x: Array, u: Any, p: Any) -> tuple[Array, ...]:
        """The wheel observer: ``r w``, its deceleration by adhesion, and the decaying innovation."""
        innovation = x[WHEEL_INNOVATION]
        on_speed, on_adhesion = correction(p.theta_1, p.wheel_high_gain, innovation)
        driven = p.wheel_radius**2 / (p.n_axles * p.wheel_inertia) * u.effort
        decay = innovation_decay(p.theta_1, p.wheel_high_gain, innovation)
        return x[WHEEL_DECELERATION] + driven - on_speed, -on_adhesion, decay

    def jump(self, event: str, t: Array, x: Array, u: Any, p: Any) -> Array:
        """A balise or an odometer sample sets its innovation anew."""
        if event == "balise":
            return super().jump(event, t, x, u, p)
        parts = [x[i] for i in range(self.state_count)]
        parts[WHEEL_INNOVATION] = x[WHEEL_SPEED] - u.odometer
        return vector(*parts)

    def error_certificate(self, max_gap: float, p: Any) -> Certificate:
        """Certificate of the balise stage, and the exact check of the wheel stage at its constant period."""
        certificate = super().error_certificate(max_gap, p)
        gain = correction(float(p.theta_1), p.wheel_high_gain, 1.0)
        wheel = SampledError.of([[0.0, 1.0], [0.0, 0.0]], gain, float(p.theta_1) * float(p.wheel_high_gain[0]))
        period = float(p.odometer_period)
        radius = wheel.spectral_radius(period)
        note = f"wheel stage at its odometer period of {period:g} s: spectral radius {radius:.4f}"
        return replace(certificate, holds=certificate.holds and radius < 1.0, notes=(*certificate.notes, note))
