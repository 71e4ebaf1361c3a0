"""Train observer that learns by how much the wheel radius is wrong, from the odometer and balises on the way."""

from __future__ import annotations

from typing import Any

import numpy as np

from fmu_observer.certificates.aperiodic import certify_sampled_error
from fmu_observer.certificates.finding import Finding
from fmu_observer.certificates.impulsive_error import ImpulsiveError
from fmu_observer.formulas.adaptation.adaptive_law import (
    Plant,
    Sizes,
    adaptation_flow,
    adaptation_of,
    adaptation_states,
    error_drift,
    gains_of,
    learnt_constants,
    start_covariance,
)
from fmu_observer.observers.evaluated_observer import GapCertified
from fmu_observer.observers.gated_observer import GatedObserver
from fmu_observer.observers.innovation_gate import gain_ratio, place_deviation
from fmu_observer.observers.train.standstill import stands
from fmu_observer.observers.train.train_signals import (
    BALISE,
    BALISES_USED,
    INNOVATION_OUTPUT,
    LAST_INNOVATION,
    POSITION,
    POSITION_OUTPUT,
)
from plant_models.hybrid import Array, Signal, input_signal, matrix, output_signal, parameter, state

SIZES = Sizes(1, 1, 1, sampled=True)
C = np.ones((1, 1))
MU, FORGETTING = 0.03, 0.003  # [1/s] [ours]
FIRST_GAIN = 1e-4  # [1/(m2 s)] [ours], of R
PRIOR = 0.02  # standard deviation of the wheel radius' error before any balise [ours]
QUICKEST = 50.0  # [1/s]: no balise moves the constant faster, which keeps explicit integration stable
ADAPTIVE = (
    parameter("mu", "1/s", MU, "Rate at which the position forgets balises", min=1e-9),
    parameter("forgetting", "1/s", FORGETTING, "Rate at which the wheel radius forgets balises", min=0.0),
    parameter("gain_floor", "1", 0.0, "One over the largest adaptation gain; 0 for no limit", min=0.0),
    parameter(
        "least_excitation", "1", 0.25, "Mean square of the sensitivity [m2] below which the radius is held", min=0.0
    ),
    parameter("excitation_time", "s", 20.0, "Window of that mean", min=1e-9),
    parameter("first_gain", "1", FIRST_GAIN, "Adaptation gain R at the first balise", min=0.0),
    parameter("balise_deviation", "m", 0.5, "Standard deviation of the place of a balise, at least", min=0.0),
    parameter("odometer_deviation", "m/s", 0.05, "Standard deviation of the noise of a reading", min=0.0),
    parameter("odometer_period", "s", 0.2, "Time between readings of independent noise", min=0.0),
    parameter("reading_age", "s", 0.0, "Mean age of the reading that is held", min=0.0),
    parameter("creep_per_effort", "1/N", 0.0, "Creep of the wheel over the effort; 0 for a free axle", min=0.0),
)


class AdaptiveWheelRadius(GatedObserver, GapCertified):
    """Position, speed and relative error of the wheel radius: the adaptive observer (4.7) of Hann 2014 on a train.

    An odometer that believes a wheel radius reads ``odometer = (1 + wheel_radius_error) v`` [ours: positive where the
    wheel is worn, for it turns faster than believed]. So ``dp = odometer + odometer k`` with the unknown constant
    ``k = 1 / (1 + wheel_radius_error) - 1``: affine in the state, without mass, effort or resistance. Measured is p, at
    balises. With ``w`` the position predicted since the last balise and ``c = ph - w``

    ``d ph = odometer (1 + kh) - mu c + lambda d kh``, ``d kh = -R chi c``,
    ``d w = odometer (1 + kh) + (lambda - chi) d kh``, ``d lambda = odometer - mu chi``, ``d chi = -mu chi``,
    ``d R = forgetting R - R^2 chi^2``, and at a balise ``w = p_B``, ``chi = lambda``: the sampled sensitivity of
    `adaptive_law`, for balises are seconds apart. At the first balise the position is set, and the adaptation begins
    anew. A reading that is held is late by half of its
    period, one that was aggregated by a whole one: p is the position `reading_age` ago, and what a balise says, and
    what is reported, are moved by the way since.

    `wheel_radius_error_deviation` is the standard deviation of its error, of white noise of the places of balises and
    of the readings, carried exactly between them; `position_deviation` likewise. What is no noise is not in it: the
    mean creep of a pulling or braking wheel counts as wheel radius unless `creep_per_effort` shows how much of it an
    effort makes [ours: ``odometer / (1 + creep_per_effort effort)`` stands for the reading], and a wheel that locks or
    spins spoils the estimate (give an axle that does neither). At standstill nothing is learnt: below
    `least_excitation` the constant is held and `wheel_radius_learnt` is 0. Without balises the deviations grow.

    Gains [ours]: mu 0.03 1/s, forgetting 0.003 1/s. Errors of position and constant die out at any gaps.
    """

    name = "adaptive_wheel_radius"
    description = "Train observer that learns the error of the wheel radius from balises"
    source = "Hann 2014, (4.7); the train case, covariance and holding are ours"
    internal_step = 1e-2
    weighing = "itself"
    bounded_parameters = ADAPTIVE
    inputs: tuple[Signal, ...] = (
        input_signal("odometer", "m/s", 0.0, "Odometer speed, by the believed wheel radius"),
        input_signal(
            "effort",
            "N",
            0.0,
            "Effort, for the creep of a driven axle; not used where creep_per_effort is 0",
            optional=True,
        ),
    )
    outputs = (
        POSITION_OUTPUT,
        output_signal("speed", "m/s", "Odometer speed, corrected by the estimate", display_unit="km/h"),
        INNOVATION_OUTPUT,
        output_signal("position_deviation", "m", "Standard deviation of the position's error"),
        output_signal(
            "wheel_radius_error", "1", "Estimate of odometer over true speed, minus 1; worn wheels: positive"
        ),
        output_signal("wheel_radius_error_deviation", "1", "Standard deviation of its error"),
        output_signal("wheel_radius_learnt", "1", "1 where the wheel radius is learnt, 0 where it is held"),
        output_signal("excitation", "m2", "Mean square of the sensitivity of the position to the wheel radius"),
    )
    parameters = ADAPTIVE
    events = (BALISE,)

    def __init__(self) -> None:
        first = start_covariance(C, (100.0, PRIOR), SIZES, True)
        adaptation = adaptation_states(SIZES, first, gain=FIRST_GAIN, inverse_s=MU)
        self.states = (
            POSITION,
            state("predicted_position", "m", 0.0, "Position predicted since the last balise"),
            state("estimated_scale", "1", 0.0, "Estimate of true speed over odometer, minus 1"),
            *adaptation,
            BALISES_USED,
            LAST_INNOVATION,
        )
        super().__init__()

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        adaptation = adaptation_of(x, C, SIZES)
        reading, scale = _without_creep(u, p), 1.0 + x.estimated_scale
        speed = reading * scale
        noise = p.odometer_deviation**2 * p.odometer_period * scale**2
        plant = Plant(np.zeros((1, 1)), reading, np.reshape(reading, (1, 1)), C, noise * DISTURBED)
        gains = gains_of(adaptation, C, learnt_constants(adaptation.excitation, p.least_excitation, 1))
        moves = 1.0 - stands(0.0 * reading, reading, 3.0 * p.odometer_deviation)
        # Time at standstill makes nothing older.
        p = p._replace(forgetting=moves * p.forgetting, excitation_time=p.excitation_time / np.maximum(moves, 1e-9))
        c = x.estimated_position - x.predicted_position
        drift = error_drift(plant, gains, SIZES, True)
        return {
            "estimated_position": speed - gains.total[0, 0] * c,
            "predicted_position": speed - gains.output[0, 0] * c,
            "estimated_scale": -gains.constants[0, 0] * c,
            **adaptation_flow(adaptation, plant, gains, drift, p.mu, p, SIZES),
        }

    def update(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """The predicted position is that of the balise; the first one sets the position too."""
        begins = x.balises_used <= 0.0
        deviation = place_deviation(u.balise_location_accuracy, p.balise_deviation)
        gain, variance = gain_ratio(self.own_bound(x, p), deviation, p.balise_deviation), deviation**2
        reported = u.balise_position - p.reading_age * _without_creep(u, p) * (1.0 + x.estimated_scale)
        position, R, seen = x.estimated_position, x.adaptation_gain[0, 0], gain * x.sensitivity[0, 0]
        quickest = R / (1.0 + R * seen**2 / QUICKEST)
        predicted = np.where(gain < 1.0, position + gain * (reported - position), reported)
        covariance = x.error_covariance
        jump = np.vstack([_UNMOVED, np.hstack([1.0 - gain, 0.0, 0.0])])
        moved = jump @ covariance @ jump.T + gain**2 * variance * _OF_PREDICTED
        known = variance * EQUAL_PLACE + covariance[1, 1] * _OF_SCALE
        return {
            "estimated_position": np.where(begins, reported, position),
            "predicted_position": np.where(begins, reported, predicted),
            "adaptation_gain": matrix([np.where(begins, p.first_gain, quickest)]),
            "sensitivity": np.where(begins, 0.0, x.sensitivity),
            "seen_sensitivity": matrix([np.where(begins, 0.0, seen)]),
            "mean_excitation": np.where(begins, 0.0, x.mean_excitation),
            "error_covariance": np.where(begins, known, moved),
            "balises_used": x.balises_used + 1.0,
            "last_innovation": position - reported,
        }

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        V, scale, reading = x.error_covariance, 1.0 + x.estimated_scale, _without_creep(u, p)
        return {
            "position": x.estimated_position + p.reading_age * reading * scale,
            "speed": reading * scale,
            "innovation": x.last_innovation,
            "position_deviation": _root(V[0, 0]),
            "wheel_radius_error": 1.0 / scale - 1.0,
            "wheel_radius_error_deviation": _root(V[1, 1]) / scale**2,
            "wheel_radius_learnt": learnt_constants(x.mean_excitation, p.least_excitation, 1)[0],
            "excitation": x.mean_excitation[0, 0],
        }

    def own_bound(self, x: Any, p: Any) -> Array:
        """One standard deviation of the position [m]; the gate adds three times the recent innovation."""
        return _root(x.error_covariance[0, 0])

    def gap_finding(self, gap: float, p: Any) -> Finding:
        """Certificate of the observer that knows the wheel radius, ``d e = -mu c``, ``d c = -mu c``, ``c = e`` at a
        balise; what is learnt obeys least squares, which forget at any gaps.
        """
        mu = np.array([[float(p.mu)]])
        error = ImpulsiveError.with_innovation(np.zeros((1, 1)), mu, mu, C, (0,))
        model = (
            "error of the position with the wheel radius known; that of the wheel radius obeys least squares at any "
            "gaps, in cascade; noise, standstill and wheels that lock or spin are left out"
        )
        return certify_sampled_error((error,), gap, model)


DISTURBED = np.outer([1.0, 0.0, 1.0], [1.0, 0.0, 1.0])  # the odometer's noise moves position and predicted position
EQUAL_PLACE = DISTURBED
_OF_SCALE = np.diag([0.0, 1.0, 0.0])
_OF_PREDICTED = np.diag([0.0, 0.0, 1.0])
_UNMOVED = np.eye(2, 3)  # position and scale at a balise


def _without_creep(u: Any, p: Any) -> Array:
    """What the odometer would read of a wheel that rolls freely [m/s]."""
    return u.odometer / (1.0 + p.creep_per_effort * u.effort)


def _root(variance: Array) -> Array:
    return np.sqrt(np.maximum(variance, 1e-30))
