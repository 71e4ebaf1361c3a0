"""First stages of the cascades: the adhesion force from the applied effort and the odometer. They know the wheelset
only.

A stage reads its own states of an observer's, so that any second stage can stand on it.
"""

from __future__ import annotations

from typing import Any

from fmu_observer.certificates.finding import Finding
from fmu_observer.certificates.sampled_error import SampledError
from fmu_observer.detection.jam_detector import ODOMETER_SAMPLE
from fmu_observer.formulas.correction.innovation_decay import HIGH_GAIN_K, correction, innovation_decay
from fmu_observer.formulas.differentiation.differentiator import filtering_differentiator_flow
from fmu_observer.models.observer_model import named_as, stacked_of
from plant_models.hybrid import Array, PeriodicEvent, Signal, parameter, state


class WheelStage:
    """What a second stage needs of a first one; this one is none at all: the applied effort stands for the adhesion
    force, and the inertia of the wheels is neglected.

    1. `states` are some of the observer's, which it is handed as ``x``.
    2. `flow` returns the derivative of each by name, `sampled` what an odometer sample changes.
    3. `events` are the odometer samples it needs, if any.
    4. `also_of` adds its own check to the certificate of the second stage.
    """

    states: tuple[Signal, ...] = ()
    parameters: tuple[Signal, ...] = ()
    events: tuple[PeriodicEvent, ...] = ()
    stability_parameters: tuple[str, ...] = ()

    def adhesion(self, x: Any, u: Any, p: Any) -> Array:
        """Adhesion force [N]."""
        return u.effort

    def flow(self, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """Derivatives of the stage's states."""
        return {}

    def sampled(self, x: Any, u: Any) -> dict[str, Array]:
        """The states that an odometer sample changes."""
        return {}

    def also_of(self, found: Finding, p: Any) -> Finding:
        """The finding of the second stage, with that of the first.

        Args:
            found: of the second stage.
        """
        return found


class DifferentiatorStage(WheelStage):
    """Filtering differentiator of ``y / r`` (n = 1, nf = 3), ``F_ad = effort - (J / r) Z1``: Bouchama 2024,
    (3.18)-(3.22).
    """

    states: tuple[Signal, ...] = (
        state("filter_1", "rad.s2", 0.0, "First filter state of the differentiator"),
        state("filter_2", "rad.s", 0.0, "Second filter state of the differentiator"),
        state("filter_3", "rad", 0.0, "Third filter state of the differentiator"),
        state("wheel_rate", "rad/s", 0.0, "Filtered wheel angular speed"),
        state("wheel_acceleration", "rad/s2", 0.0, "Wheel angular acceleration"),
    )
    parameters: tuple[Signal, ...] = (
        parameter("jerk_bound", "m/s3", 10.0, "Bound of the odometer's second derivative [ours]", min=1e-6),
    )

    def adhesion(self, x: Any, u: Any, p: Any) -> Array:
        """``F_ad = effort - (J / r) Z1`` [N], (3.22)."""
        return u.effort - p.n_axles * p.wheel_inertia / p.wheel_radius * x.wheel_acceleration

    def flow(self, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """The filtering differentiator of the wheel rate ``y / r``, (3.18)."""
        z = stacked_of(x, self.states)
        dw, dz = filtering_differentiator_flow(z[:3], z[3:], u.odometer / p.wheel_radius, p.jerk_bound / p.wheel_radius)
        return named_as(self.states, (*dw, *dz))


class MultirateStage(WheelStage):
    """High-gain observer of ``r w`` at odometer samples, ``F_ad = -(J / r^2) z2``: Bouchama 2024, (3.50)-(3.67).

    The printed scalings of the second state (``-int F_ad``, later ``-(r / J) F_ad``) are dimensionally wrong; the one
    here, ``z2 = -(r^2 / J) F_ad``, is re-derived.
    """

    states: tuple[Signal, ...] = (
        state("wheel_speed_estimate", "m/s", 0.0, "Estimate of the wheel circumferential speed r w"),
        state("adhesion_deceleration", "m/s2", 0.0, "Deceleration of r w by adhesion, -(r^2/J) F_ad"),
        state("odometer_innovation", "m/s", 0.0, "Error seen at the last odometer sample, decaying since"),
    )
    parameters: tuple[Signal, ...] = (
        parameter("theta_1", "1/s", 8.0, "High gain of the wheel observer; stable up to 5 / odometer_period", min=0.0),
        parameter("wheel_high_gain", "1", HIGH_GAIN_K, "Shape K of the wheel observer's gain", size=2),
        parameter("odometer_period", "s", 0.1, "Sampling period of the odometer", min=1e-4),
    )
    events: tuple[PeriodicEvent, ...] = (ODOMETER_SAMPLE,)
    stability_parameters: tuple[str, ...] = ("theta_1", "wheel_high_gain", "odometer_period")

    def adhesion(self, x: Any, u: Any, p: Any) -> Array:
        """``F_ad = -(J / r^2) z2`` [N]."""
        return -p.n_axles * p.wheel_inertia / p.wheel_radius**2 * x.adhesion_deceleration

    def flow(self, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """``r w``, its deceleration by adhesion, and the decaying innovation."""
        innovation = x.odometer_innovation
        on_speed, on_adhesion = correction(p.theta_1, p.wheel_high_gain, innovation)
        driven = p.wheel_radius**2 / (p.n_axles * p.wheel_inertia) * u.effort
        return {
            "wheel_speed_estimate": x.adhesion_deceleration + driven - on_speed,
            "adhesion_deceleration": -on_adhesion,
            "odometer_innovation": innovation_decay(p.theta_1, p.wheel_high_gain, innovation),
        }

    def sampled(self, x: Any, u: Any) -> dict[str, Array]:
        """The innovation is set anew."""
        return {"odometer_innovation": x.wheel_speed_estimate - u.odometer}

    def also_of(self, found: Finding, p: Any) -> Finding:
        """The exact check of this stage at its constant period beside the certificate."""
        gain = correction(float(p.theta_1), p.wheel_high_gain, 1.0)
        wheel = SampledError.of([[0.0, 1.0], [0.0, 0.0]], gain, float(p.theta_1) * float(p.wheel_high_gain[0]))
        period = float(p.odometer_period)
        radius = wheel.spectral_radius(period)
        text = f"wheel stage at its odometer period of {period:g} s: spectral radius {radius:.4f}"
        what = "growth of the wheel stage from sample to sample"
        return found.also(Finding(what, radius, "1", "exact", "the transition over its period", radius < 1.0, text))


WHEEL_STAGES: dict[str, type[WheelStage]] = {"multirate": MultirateStage, "differentiator": DifferentiatorStage}
