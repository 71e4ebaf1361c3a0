"""S4: cascade of two high-gain continuous-discrete observers for a sampled odometer and aperiodic balises."""

from __future__ import annotations

from fmu_observer.formulas.correction.decaying_gain import HIGH_GAIN_K
from fmu_observer.observers.train.high_gain_observer import HighGainTrainObserver
from fmu_observer.observers.train.wheel_stage import MultirateStage


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
    stage = MultirateStage()
    stability_parameters = ("theta_2", "high_gain", "theta_1", "wheel_high_gain", "odometer_period")
    presets = {
        "repaired": {
            "theta_1": 8.0,
            "theta_2": 8.0,
            "wheel_high_gain": HIGH_GAIN_K,
            "high_gain": HIGH_GAIN_K,
            "n_axles": 1.0,
        }
    }
    default_preset = "repaired"
