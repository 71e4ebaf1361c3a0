"""Base of the train observers: the signals, the slip part and the question of stability that they share.

It knows the single-mass train (mass, Davis resistance, wheelset) and nothing of how an observer corrects itself.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, NamedTuple

import numpy as np

from fmu_observer.detection.slip_indicator import (
    FILTERED_SLIP,
    SLIP_OUTPUTS,
    SLIP_PARAMETERS,
    indicator_level,
    odometer_slip,
    slip_filter_derivative,
)
from fmu_observer.observers.evaluated_observer import GapCertified
from fmu_observer.observers.gated_observer import GatedObserver
from fmu_observer.observers.train.standstill import ROLLS_BACK, rolls_back
from fmu_observer.observers.train.train_signals import BALISE, MOTION_OUTPUTS, TRAIN_PARAMETERS
from plant_models.hybrid import Array, PeriodicEvent, TriggeredEvent, vector
from plant_models.hybrid.signal import Signal, input_signal, output_signal, parameter


class Estimate(NamedTuple):
    """What a train observer believes: position [m], speed [m/s], adhesion force [N], balise innovation [m]."""

    position: Array
    speed: Array
    adhesion_force: Array
    innovation: Array


class TrainObserver(GatedObserver, GapCertified):
    """Base of the observers of a train ``dp = v``, ``M dv = F_ad - a sgn(v) - b v - c v|v|`` (Bouchama 2024,
    (3.1)-(3.3)).

    The contract:

    1. A subclass sets `estimator_states` (continuous), `estimator_memory`, `estimator_parameters` and
       `estimator_events`; the state is laid out as estimator states, filtered slip, memory, and the memory of the gate
       (`GatedObserver`).
    2. It writes `estimator_flow` (derivatives of the estimator states by name), `estimate`, `update` and
       `gap_finding`.
    3. `findings` says first whether the very gains in use are stable for balise gaps up to a given length.
    4. Where the speed is a state, the Davis constant and a negative adhesion force (a brake) are dry friction: they
       stop the observed train and hold it, and never push it backwards. For a speed above zero that is the thesis's
       equation.
    5. Estimates start at position 0 and speed 1 m/s, the deliberately wrong start of the thesis.

    Args:
        options: of the observer, see its `option_choices`.
    """

    estimator_states: tuple[Signal, ...] = ()
    estimator_memory: tuple[Signal, ...] = ()
    estimator_parameters: tuple[Signal, ...] = ()
    estimator_events: tuple[PeriodicEvent | TriggeredEvent, ...] = ()
    stability_parameters: tuple[str, ...] = ()

    inputs: tuple[Signal, ...] = (
        input_signal("effort", "N", 0.0, "Applied effort at the wheel rim: traction positive, brake negative"),
        input_signal("odometer", "m/s", 0.0, "Odometer speed r w"),
    )
    outputs: tuple[Signal, ...] = (
        *MOTION_OUTPUTS,
        *SLIP_OUTPUTS,
        output_signal("adhesion_force", "N", "Estimated adhesion force between wheels and rails"),
        output_signal("innovation", "m", "Estimated minus true position at the last balise, as it acts now"),
        ROLLS_BACK,
    )
    train_parameters: tuple[Signal, ...] = (
        *TRAIN_PARAMETERS,
        parameter("wheel_radius", "m", 0.575, "Wheel radius", min=1e-3),
        parameter("wheel_inertia", "kg.m2", 225.0, "Rotating inertia of one axle", min=1e-3),
        parameter(
            "n_axles", "1", 1.0, "Number of motored axles: 1 as printed in the thesis, 4 on the BB 27000", min=1.0
        ),
    )

    def __init__(self, **options: Any) -> None:
        self.states = (*self.estimator_states, FILTERED_SLIP, *self.estimator_memory)
        self.parameters = (*self.train_parameters, *SLIP_PARAMETERS, *self.estimator_parameters)
        self.events = (BALISE, *self.estimator_events)
        super().__init__(**options)

    # -- what a subclass writes -------------------------------------------------------------------------------------

    @abstractmethod
    def estimator_flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """Derivatives of the estimator states by name."""

    @abstractmethod
    def estimate(self, x: Any, u: Any, p: Any) -> Estimate:
        """Position, speed, adhesion force and innovation."""

    # -- what follows -----------------------------------------------------------------------------------------------

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        slip = odometer_slip(u.odometer, self.estimate(x, u, p).speed, p.slip_floor)
        filtered = slip_filter_derivative(x.filtered_slip, slip, p.slip_filter_time)
        return self.estimator_flow(t, x, u, p) | {FILTERED_SLIP.name: filtered}

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """The estimate with its slip and indicator."""
        estimate = self.estimate(x, u, p)
        filtered = x.filtered_slip
        return estimate._asdict() | {
            "rolls_back": rolls_back(u.odometer),
            "slip": odometer_slip(u.odometer, estimate.speed, p.slip_floor),
            "slip_indicator": indicator_level(filtered, u.odometer, estimate.speed, p.slip_threshold, p.slip_min_speed),
        }

    def friction(self, t: Array, x: Any, u: Any, p: Any) -> Array:
        """Davis constant and brake as dry friction on the speed, ``(a + max(-F_ad, 0)) / M`` [m/s2], shape
        (len(frictions),).
        """
        if not self.frictions:
            return np.zeros(0)
        return vector((p.davis_a + np.maximum(-self.estimate(x, u, p).adhesion_force, 0.0)) / p.mass)

    # -- internals --------------------------------------------------------------------------------------------------

    def deciding_parameters(self) -> tuple[Signal, ...]:
        """Those that decide stability, as the observer names them."""
        return tuple(s for s in self.parameter_signals if s.name in self.stability_parameters)
