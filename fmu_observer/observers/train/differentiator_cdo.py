"""S1: filtering sliding-mode differentiator of the odometer, then a high-gain continuous-discrete observer."""

from __future__ import annotations

from fmu_observer.observers.train.high_gain_observer import HighGainTrainObserver
from fmu_observer.observers.train.wheel_stage import DifferentiatorStage


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
