"""The high-gain train observer at balises, shared by the cascades that differ in where the adhesion force comes
from.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np

from fmu_observer.certificates.aperiodic import certify_sampled_error, with_switching_noted
from fmu_observer.certificates.finding import Finding
from fmu_observer.certificates.gap_error import GapError
from fmu_observer.certificates.sampled_error import SampledError
from fmu_observer.design.certified_gains import certified_gains
from fmu_observer.formulas.correction.innovation_decay import HIGH_GAIN_K, correction, innovation_decay
from fmu_observer.observers.evaluated_observer import Evaluate
from fmu_observer.observers.train.train_observer import Estimate, TrainObserver
from fmu_observer.observers.train.train_resistance import drag_slope_range, rolling_drag
from fmu_observer.observers.train.train_signals import BALISE_INNOVATION, MOTION, POSITION, SPEED
from fmu_observer.observers.train.wheel_stage import WheelStage
from plant_models.hybrid import Array, Signal, parameter

TOP_SPEED = 50.0  # [m/s], the range of speeds over which stability is certified


class HighGainTrainObserver(TrainObserver):
    """Second stage of a cascade: position and speed from an adhesion force and balises (Bouchama 2024, (3.24)-(3.43)).

    ``dp = v - theta K1 eta``, ``dv = (F_ad - a sgn(v) - b v - c v|v|)/M - theta^2 K2 eta``, ``d eta = -theta K1 eta``,
    and at a balise ``eta = p - balise_position``. The first stage of a subclass, its `stage`, gives ``F_ad``.

    With K = (2, 1) and no drag it is stable for constant gaps below ``5.0 / theta``, and for any mixture of gaps up to
    ``4.0 / theta`` (independently measured): theta must fit the longest gap.

    Args:
        options: of the observer, see its `option_choices`.
    """

    stage: WheelStage = WheelStage()
    gain_states: tuple[Signal, ...] = ()
    theta_name: ClassVar[str] = "theta"
    innovation_state: ClassVar[Signal] = BALISE_INNOVATION
    frictions = (SPEED.name,)

    def __init__(self, **options: Any) -> None:
        self.estimator_states = (*MOTION, self.innovation_state, *self.gain_states, *self.stage.states)
        self.estimator_parameters = (*self.gain_parameters(), *self.stage.parameters)
        self.estimator_events = self.stage.events
        super().__init__(**options)

    def gain_parameters(self) -> tuple[Signal, ...]:
        """Theta and the shape of the gain."""
        return (
            parameter(self.theta_name, "1/s", 8.0, "High gain at balises, at most 4 / longest gap", min=0.0),
            parameter("high_gain", "1", HIGH_GAIN_K, "Shape K of the high gain", size=2),
        )

    def theta_in_force(self, x: Any, p: Any) -> Array:
        """High gain at balises [1/s]."""
        return getattr(p, self.theta_name)

    def acting_innovation(self, x: Any, p: Any) -> Array:
        """The innovation of the last balise as it acts now [m]."""
        return x.balise_innovation

    def innovation_flow(self, x: Any, p: Any) -> Array:
        """Derivative of the innovation state."""
        return innovation_decay(self.theta_in_force(x, p), p.high_gain, x.balise_innovation)

    def vertex_error(self, drift: Sequence[Sequence[float]], p: Any) -> GapError:
        """Error equations of position and speed between two balises, for one drag slope in `drift`, shape (2, 2)."""
        theta = float(getattr(p, self.theta_name))
        return SampledError.of(drift, correction(theta, p.high_gain, 1.0), theta * float(p.high_gain[0]))

    def vertices(self, p: Any) -> tuple[GapError, ...]:
        """Error equations at the smallest and the largest drag slope of the speed range."""
        return tuple(self.vertex_error([[0.0, 1.0], [0.0, -s]], p) for s in drag_slope_range(p, 0.0, TOP_SPEED))

    def estimator_flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        theta, speed = self.theta_in_force(x, p), x.estimated_speed
        on_position, on_speed = correction(theta, p.high_gain, self.acting_innovation(x, p))
        traction = np.maximum(self.stage.adhesion(x, u, p), 0.0)  # a negative one is a brake: see friction
        acceleration = (traction - rolling_drag(speed, p)) / p.mass
        return {
            POSITION.name: speed - on_position,
            SPEED.name: acceleration - on_speed,
            self.innovation_state.name: self.innovation_flow(x, p),
        } | self.stage.flow(x, u, p)

    def estimate(self, x: Any, u: Any, p: Any) -> Estimate:
        adhesion, innovation = self.stage.adhesion(x, u, p), self.acting_innovation(x, p)
        return Estimate(x.estimated_position, x.estimated_speed, adhesion, innovation)

    def update(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """A balise sets the innovation anew, position and speed stay continuous; an odometer sample is the stage's."""
        if event != "balise":
            return self.stage.sampled(x, u)
        return {BALISE_INNOVATION.name: x.estimated_position - u.balise_position}

    def alternative(self, gap: float, p: Any, evaluate: Evaluate) -> str | None:
        """The largest theta that is certified."""
        gains = certified_gains(gap, lambda theta: {self.theta_name: theta}, evaluate)
        if gains is None:
            return None
        return f"{self.theta_name} at most {gains[self.theta_name]:g} is certified for {gap:.3g} s"

    def gap_finding(self, gap: float, p: Any) -> Finding:
        """Certificate of ``de = [[0, 1], [0, -s]] e - theta inv(Delta) K eta`` for all drag slopes s of the speed
        range, and of the first stage.
        """
        vertices = self.vertices(p)
        model = (
            f"position and speed error with the drag slope (b + 2 c v)/M at 0 and {TOP_SPEED:g} m/s, constant over a "
            "gap; standstill and the error of the adhesion force, an input to it, are left out"
        )
        found = with_switching_noted(certify_sampled_error(vertices, gap, model), vertices, "drag slopes")
        return self.stage.also_of(found, p)
