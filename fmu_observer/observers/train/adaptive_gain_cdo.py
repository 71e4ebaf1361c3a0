"""High-gain train observer whose gain follows the gap it expects: balises laid by distance, speeds that change.
Ours.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from fmu_observer.certificates.adapting_gain import GainAdaptation, certify_adapting_gain
from fmu_observer.certificates.finding import Finding
from fmu_observer.design.certified_gains import certified_gains, rounded_down
from fmu_observer.formulas.correction.innovation_decay import HIGH_GAIN_K
from fmu_observer.observers.evaluated_observer import Evaluate
from fmu_observer.observers.train.high_gain_observer import TOP_SPEED, HighGainTrainObserver
from fmu_observer.observers.train.train_observer import TrainObserver
from fmu_observer.observers.train.train_resistance import drag_slope_range
from fmu_observer.observers.train.wheel_stage import WHEEL_STAGES, WheelStage
from plant_models.hybrid import Array, Signal, memory, output_signal, parameter
from plant_models.hybrid.option import require_chosen

_FirstStage = Literal["effort", "differentiator", "multirate"]
_SpeedSource = Literal["odometer", "estimated"]
_SpacingSource = Literal["expected", "learnt"]

_ADVISED_RATIO, _ADVISED_SHARES = 2.0, (3.0, 1.5)  # what `advise` tries: ratio, and theta_min times the longest gap
_SHORTEST_LEARNT = 0.25  # of the expected spacing: nearer to the last one a balise teaches no spacing


_STAGES: dict[str, type[WheelStage]] = {"effort": WheelStage, **WHEEL_STAGES}


class AdaptiveGainCdo(HighGainTrainObserver):
    """High-gain observer with ``theta = clip(ratio v / d, theta_min, theta_max)``, set at each balise: ours.

    The equations are those of `HighGainTrainObserver`; v is the speed at the balise, d the spacing that is expected, so
    that theta times the gap is about `ratio` whatever the speed. Bouchama 2024 has constant gains only: theta = 8
    diverges for spacings of 8.7 m and more at 14 m/s. Theta is memory: it is in force, with its own decay of the
    innovation, until the next balise.

    `findings(gap)` assumes what must be assumed of a journey: the speed is never below ``d / gap`` (with the
    tolerance of d), acceleration and deceleration stay within `assumed_acceleration`, v is right within
    `assumed_speed_error` and each spacing is d within `assumed_spacing_error`. These three act on the certificate only.
    A smaller ratio leaves more room for changing speeds, a larger one corrects faster; theta_min at most
    ``4 / longest gap``.

    Args:
        first_stage: where the adhesion force comes from. ``effort``: the applied effort, blind to slip of the wheels
            but robust between balises far apart. ``differentiator``: of a fast odometer. ``multirate``: of a sampled
            one.
        gain_speed: where v comes from. ``odometer``; or ``estimated``, free of slip but only as good as the estimate: a
            wrong start then also makes the gain wrong, and the certificate speaks only from the time the estimate is
            within tolerance.
        spacing: ``expected``: d is the parameter. ``learnt``: d is the distance between the last two balises, the
            parameter before there are two; a balise nearer than a quarter of the parameter to the last one does not
            change d.
    """

    name = "adaptive_gain_cdo"
    description = "High-gain continuous-discrete observer whose gain follows the expected balise gap"
    source = "ours, after Bouchama 2024, (3.24)-(3.43)"
    outputs = (*TrainObserver.outputs, output_signal("gain", "1/s", "High gain theta in force"))
    stability_parameters: tuple[str, ...] = (
        "ratio",
        "theta_min",
        "theta_max",
        "expected_spacing",
        "high_gain",
        "assumed_acceleration",
        "assumed_speed_error",
        "assumed_spacing_error",
    )
    option_choices = {
        "first_stage": tuple(_STAGES),
        "gain_speed": ("odometer", "estimated"),
        "spacing": ("expected", "learnt"),
    }

    def __init__(
        self,
        first_stage: _FirstStage = "effort",
        gain_speed: _SpeedSource = "odometer",
        spacing: _SpacingSource = "expected",
    ) -> None:
        chosen = {"first_stage": first_stage, "gain_speed": gain_speed, "spacing": spacing}
        require_chosen(self.name, self.option_choices, **chosen)
        self.stage, self.gain_speed, self.spacing = _STAGES[first_stage](), gain_speed, spacing
        self.stability_parameters = (*type(self).stability_parameters, *self.stage.stability_parameters)
        self.estimator_memory = (memory("theta", "1/s", 1.0, "High gain in force since the last balise"),)
        if spacing == "learnt":
            self.estimator_memory += (
                memory("last_balise", "m", 0.0, "Position of the last balise"),
                memory(
                    "learnt_spacing",
                    "m",
                    -1.0,
                    "Distance between the last two balises; 0 before the second one, -1 before any",
                ),
            )
        super().__init__(**chosen)

    def gain_parameters(self) -> tuple[Signal, ...]:
        error = "Largest relative error"
        return (
            parameter("ratio", "1", 2.5, "Gain times the expected gap", min=0.0),
            parameter("theta_min", "1/s", 0.1, "Smallest gain, at most 4 / longest gap", min=1e-4),
            parameter("theta_max", "1/s", 8.0, "Largest gain", min=1e-4),
            parameter("expected_spacing", "m", 50.0, "Expected distance between balises", min=1e-3),
            parameter("high_gain", "1", HIGH_GAIN_K, "Shape K of the high gain", size=2),
            parameter("assumed_acceleration", "m/s2", 0.7, "Largest acceleration, for the certificate only", min=0.0),
            parameter("assumed_speed_error", "1", 0.05, f"{error} of v, for the certificate only", min=0.0, max=1.0),
            parameter("assumed_spacing_error", "1", 0.0, f"{error} of d, for the certificate only", min=0.0, max=1.0),
        )

    def theta_in_force(self, x: Any, p: Any) -> Array:
        """High gain since the last balise [1/s]."""
        return x.theta

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return super().output(t, x, u, p) | {"gain": self.theta_in_force(x, p)}

    def update(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """At a balise innovation and gain are set anew; an odometer sample goes to the first stage."""
        if event != "balise":
            return super().update(event, t, x, u, p)
        speed = np.abs(u.odometer if self.gain_speed == "odometer" else x.estimated_speed)
        spacing, learnt = self._spacing(x, u, p)
        theta = np.clip(p.ratio * speed / spacing, p.theta_min, np.maximum(p.theta_max, p.theta_min))  # as certified
        return super().update(event, t, x, u, p) | {"theta": theta} | learnt

    def alternative(self, gap: float, p: Any, evaluate: Evaluate) -> str | None:
        """The ratio and theta_min of a few that are certified; where none is, a constant theta."""
        for share in _ADVISED_SHARES:
            rule = {"ratio": _ADVISED_RATIO, "theta_min": rounded_down(share / gap)}
            if evaluate(rule).holds:
                values = f"ratio = {_ADVISED_RATIO:g} and theta_min = {rule['theta_min']:g}"
                return f"{values} are certified for {gap:.3g} s"
        gains = certified_gains(gap, lambda theta: {"theta_min": theta, "theta_max": theta}, evaluate)
        if gains is None:
            return None
        return f"theta_min = theta_max = {gains['theta_min']:g} is certified for {gap:.3g} s"

    def gap_finding(self, gap: float, p: Any) -> Finding:
        """Certificate over all gaps, gains and changes of gain that the assumed journey allows."""
        slowest, fastest = drag_slope_range(p, 0.0, TOP_SPEED)
        adaptation = GainAdaptation(
            ratio=float(p.ratio),
            theta_min=float(p.theta_min),
            theta_max=float(max(p.theta_max, p.theta_min)),
            spacing=float(p.expected_spacing),
            high_gain=(float(p.high_gain[0]), float(p.high_gain[1])),
            drag_slopes=(float(slowest), float(fastest)),
            acceleration=float(p.assumed_acceleration),
            speed_tolerance=float(p.assumed_speed_error),
            spacing_tolerance=float(p.assumed_spacing_error),
            learnt=self.spacing == "learnt",
        )
        return self.stage.also_of(certify_adapting_gain(adaptation, gap, _error_model(adaptation)), p)

    def _spacing(self, x: Any, u: Any, p: Any) -> tuple[Array, dict[str, Array]]:
        """Spacing d to expect [m], and the memory of balises after this one."""
        if self.spacing == "expected":
            return p.expected_spacing, {}
        before, distance = x.learnt_spacing, np.abs(u.balise_position - x.last_balise)
        usable = np.where(distance >= _SHORTEST_LEARNT * p.expected_spacing, 1.0, 0.0) * np.where(
            before >= 0.0, 1.0, 0.0
        )
        learnt = np.where(usable > 0.0, distance, np.maximum(before, 0.0))
        spacing = np.where(learnt > 0.0, learnt, p.expected_spacing)
        return spacing, {"last_balise": u.balise_position, "learnt_spacing": learnt}


def _error_model(adaptation: GainAdaptation) -> str:
    a, far = adaptation, adaptation.slowest_speed(1.0)
    learnt = ", the gain set by a spacing learnt within the same range" if a.learnt else ""
    return (
        "position and speed error in units of the gain in force, for every change of gain that a train can cause whose "
        f"speed is never below {far:g} m divided by the longest gap and whose acceleration stays within "
        f"{a.acceleration:g} m/s2, with balises "
        f"every {a.spacing:g} m within {100.0 * a.spacing_tolerance:g} % and a speed known within "
        f"{100.0 * a.speed_tolerance:g} %{learnt}; drag slope of 0 to {TOP_SPEED:g} m/s, constant over a gap; "
        f"standstill and the error of the adhesion force, an input to it, are left out"
    )
