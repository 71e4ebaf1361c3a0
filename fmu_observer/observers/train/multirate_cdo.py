"""Cascades of a first stage at the odometer, sampled or differentiated, and a high-gain observer at balises."""

from __future__ import annotations

from fmu_observer.formulas.correction.innovation_decay import HIGH_GAIN_K
from fmu_observer.observers.train.high_gain_observer import HighGainTrainObserver
from fmu_observer.observers.train.wheel_stage import DifferentiatorStage, MultirateStage


class DifferentiatorCdo(HighGainTrainObserver):
    """Cascade of a filtering differentiator (n = 1, nf = 3) and a high-gain observer: Bouchama 2024, (3.17)-(3.43).

    The differentiator of ``y / r`` gives the wheel acceleration ``Z1``; the wheelset gives the adhesion force
    ``F_ad = (T - J Z1) / r`` with ``T = r effort``, ``J = n_axles wheel_inertia`` (3.22); the observer does the rest.
    The speed is corrected by balises only, so slip does not bias it.

    The differentiator's equations are discontinuous. They are integrated with the Runge-Kutta step of all observers at
    the internal step h as they stand: the adhesion force then chatters by less than ``(J / r^2) jerk_bound h``, 7 N at
    the defaults (measured 4.3 N at 1 ms, 0.9 N at 0.2 ms), far below what zone edges and noise do to it.
    `jerk_bound` [ours, none is printed] bounds ``|r d2w/dt2|``; a larger one follows faster and passes more noise. Zone
    edges and a stepped effort exceed any bound for an instant. An odometer held between samples looks like a staircase
    to the
    differentiator: give it a fast one, or use `MultirateCdo`.

    Preset `as_published`: gains (3.19), theta = 8 (printed in section 3.5 only), one axle.
    """

    name = "differentiator_cdo"
    description = "Filtering sliding-mode differentiator and high-gain continuous-discrete observer"
    source = "Bouchama 2024, (3.17)-(3.43)"
    stage = DifferentiatorStage()
    stability_parameters = ("theta", "high_gain")
    presets = {"as_published": {"theta": 8.0, "high_gain": (2.0, 1.0), "n_axles": 1.0}}
    default_preset = "as_published"


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
