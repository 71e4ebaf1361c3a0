"""Train observer that learns the Davis coefficients per unit mass, from the effort, the odometer and balises."""

from __future__ import annotations

from typing import Any

import numpy as np

from fmu_observer.certificates import Certificate, ImpulsiveError, certify_sampled_error
from fmu_observer.observers.adaptive_law import (
    Adaptation,
    Gains,
    Plant,
    Sizes,
    adaptation_flow,
    adaptation_of,
    adaptation_states,
    covariance_after,
    error_drift,
    gains_of,
    gentle_gain,
    learnt_constants,
    packed,
    smallest_eigenvalue,
    start_covariance,
)
from fmu_observer.observers.gap_certified import GapCertified
from fmu_observer.observers.gated_observer import GatedObserver
from fmu_observer.observers.train.train_observer import BALISE, POSITION, SPEED
from plant_models.hybrid import PeriodicEvent, Signal, input_signal, memory, output_signal, parameter, state, vector
from plant_models.hybrid.requirements import within_bounds
from plant_models.hybrid.system import Array

SIZES = Sizes(2, 3, 2, sampled=True)
BALISE_WEIGHT = 0.1  # [1/m] [ours]: a metre of a balise counts as 0.1 m/s of the odometer
C = np.array([[BALISE_WEIGHT, 0.0], [0.0, 1.0]])
A = np.array([[0.0, 1.0], [0.0, 0.0]])
SCALE = 30.0  # [m/s]: constants are what each term of the resistance is at this speed [m/s2]
MU, FORGETTING = 0.2, 0.0  # [1/s] [ours]
FIRST_GAIN = 1.0  # [ours], of R
PRIOR = (100.0, 5.0, 0.02, 0.02, 0.02)  # standard deviations at the start [m], [m/s], [m/s2] three times [ours]
QUICKEST = 50.0  # [1/s]: no sample moves constants faster, which keeps explicit integration stable
COUNT = SIZES.error * (SIZES.error + 1) // 2
P, V, DELTA, ADAPTATION = 0, 1, 2, 5
NAMES = ("davis_a_per_mass", "davis_b_per_mass", "davis_c_per_mass")
UNITS = ("m/s2", "1/s", "1/m")
POWERS = np.array([1.0, SCALE, SCALE**2])
ADAPTIVE = (
    parameter("mu", "1/s", MU, "Rate at which position and speed forget measurements", min=1e-9),
    parameter("forgetting", "1/s", FORGETTING, "Rate at which the coefficients forget measurements", min=0.0),
    parameter("gain_floor", "1", 0.0, "One over the largest adaptation gain; 0 for no limit", min=0.0),
    parameter("least_excitation", "1", 1e-4, "Mean excitation below which a coefficient is held", min=0.0),
    parameter("excitation_time", "s", 120.0, "Window of that mean", min=1e-9),
    parameter("first_gain", "1", FIRST_GAIN, "Adaptation gain R at the first balise", min=0.0),
    parameter("balise_deviation", "m", 0.5, "Standard deviation of the place of a balise as read", min=0.0),
    parameter("odometer_deviation", "m/s", 0.05, "Standard deviation of the noise of a reading", min=0.0),
    parameter("odometer_period", "s", 0.2, "Time between two readings", min=1e-4),
    parameter("reading_age", "s", 0.0, "Mean age of a reading at its sample", min=0.0),
    parameter("unknown_acceleration", "m2/s3", 0.0, "Intensity of the unknown acceleration, white", min=0.0),
)


class AdaptiveDavis(GatedObserver, GapCertified):
    """Position, speed and Davis coefficients per unit mass: the adaptive observer (4.7) of Hann 2014 on a train.

    ``dp = v``, ``dv = effort / mass - (a + b v + c v^2)``, with a, b, c unknown, believed first to be the parameters
    `davis_a`, `davis_b`, `davis_c` over `mass`. Measured are the position at balises and the speed at samples of the
    odometer, each with an output of its own that is predicted between its samples; sensitivities are sampled like the
    outputs, see `adaptive_law`. The regressors ``1, v, v^2`` are those of the estimated speed. The first balise sets
    the position, the first reading the speed.

    Only effort over mass is known, so a mass or an effort that is wrong by a share is told as resistance, and so are
    gradients: use it where the line is level or its gradient is part of the effort, with the effort that acts. One
    speed tells the resistance at that speed and no more: b and c are learnt where the speed varies.
    `resistance_per_mass_deviation` is the standard deviation of the resistance at the speed now, always much surer
    than its parts. Below `minimum_speed`, and where `least_excitation` is not reached, coefficients are held.

    Gains [ours]: mu 0.2 1/s; coefficients do not forget.
    """

    name = "adaptive_davis"
    description = "Train observer that learns the Davis coefficients per unit mass"
    source = "Hann 2014, (4.7); the train case, covariance and holding are ours"
    internal_step = 1e-2
    inputs: tuple[Signal, ...] = (
        input_signal("effort", "N", 0.0, "Effort that acts at the wheel rim: traction positive, brake negative"),
        input_signal("odometer", "m/s", 0.0, "Odometer speed"),
    )
    outputs = (
        output_signal("position", "m", "Estimated position"),
        output_signal("speed", "m/s", "Estimated speed", display_unit="km/h"),
        output_signal("innovation", "m", "Estimated minus true position at the last balise", variability="discrete"),
        output_signal("position_deviation", "m", "Standard deviation of the position's error"),
        *(output_signal(n, unit, f"Estimated coefficient {n[6]}") for n, unit in zip(NAMES, UNITS, strict=True)),
        *(
            output_signal(f"{n}_deviation", unit, f"Standard deviation of the error of coefficient {n[6]}")
            for n, unit in zip(NAMES, UNITS, strict=True)
        ),
        *(
            output_signal(f"{n}_learnt", "1", f"1 where coefficient {n[6]} is learnt, 0 where it is held")
            for n in NAMES
        ),
        output_signal("resistance_per_mass", "m/s2", "Running resistance at the estimated speed"),
        output_signal("resistance_per_mass_deviation", "m/s2", "Standard deviation of its error"),
        output_signal("smallest_excitation", "s2", "Smallest eigenvalue of the mean Gramian of the excitation"),
    )
    parameters = (
        parameter("mass", "kg", 90000.0, "Train mass", min=1.0),
        parameter("davis_a", "N", 900.0, "Running resistance believed first, constant term"),
        parameter("davis_b", "N.s/m", 32.4, "Running resistance believed first, linear term"),
        parameter("davis_c", "N.s2/m2", 1.65287, "Running resistance believed first, quadratic term"),
        parameter("minimum_speed", "m/s", 2.0, "Speed below which coefficients are held", min=0.1),
        *ADAPTIVE,
    )
    events = (BALISE, PeriodicEvent("odometer_sample", "odometer_period", description="The odometer is read"))

    def __init__(self) -> None:
        first = start_covariance(C, PRIOR, SIZES, True)
        self.states = (
            POSITION,
            SPEED,
            *(state(f"correction_{n[6]}", "m/s2", 0.0, f"Correction of {n[6]}, at {SCALE:g} m/s") for n in NAMES),
            *adaptation_states(SIZES, first, gain=FIRST_GAIN),
            state("predicted_balise", "1", 0.0, f"Predicted position times {BALISE_WEIGHT:g}"),
            state("predicted_odometer", "m/s", 1.0, "Predicted odometer"),
            memory("balises_used", "1", 0.0, "Balises used so far"),
            memory("readings_used", "1", 0.0, "Readings used so far"),
            memory("last_innovation", "m", 0.0, "Position error seen at the last balise"),
        )
        super().__init__()

    def requirements(self, p: Any) -> dict[str, Array]:
        """The parameters lie within their bounds."""
        return super().requirements(p) | within_bounds(ADAPTIVE, p)

    def flow(self, t: Array, x: Array, u: Any, p: Any) -> Array:
        """Position, speed, corrections, adaptation and predicted outputs."""
        adaptation = self._adaptation(x)
        regressor = _regressor(x[V])
        acceleration = self._acceleration(x, u, p)
        slope = (p.davis_b + 2.0 * p.davis_c * x[V]) / p.mass
        drift = A - np.vstack([np.zeros((1, 2)), np.hstack([0.0, slope])])
        Phi = -np.vstack([np.zeros((1, 3)), regressor])
        noise = p.unknown_acceleration * np.outer(DISTURBED, DISTURBED)
        plant = Plant(drift, x[:2], Phi, C, noise)
        gains = self._gains(adaptation, x, p)
        c = C @ x[:2] - x[self.own_count - 5 : self.own_count - 3]
        predicted = vector(x[V], acceleration)
        return np.hstack(
            [
                predicted - gains.total @ c,
                -(gains.constants @ c),
                *adaptation_flow(adaptation, plant, gains, error_drift(plant, gains, SIZES, True), p.mu, p, SIZES),
                C @ predicted - gains.output @ c,
            ]
        )

    def update(self, event: str, t: Array, x: Array, u: Any, p: Any) -> Array:
        """The predicted output of what is measured is set to it; the first measurement sets the estimate too."""
        row = 0 if event == BALISE.name else 1
        if row == 0:
            measured, deviation = u.balise_position, p.balise_deviation
        else:
            measured, deviation = u.odometer + p.reading_age * self._acceleration(x, u, p), p.odometer_deviation
        weight = float(C[row, row])
        first = np.where(x[self.own_count - 3 + row] > 0.0, 0.0, 1.0)
        adaptation = self._adaptation(x)
        moved = covariance_after(adaptation.covariance, C, row, (weight * deviation) ** 2, SIZES, True)
        begun = _begun(adaptation.covariance, row, weight, deviation**2)
        V_after = np.where(first > 0.0, packed(begun, SIZES.error), packed(moved, SIZES.error))
        # what has just been measured does not depend on the coefficients
        L = [np.where(first > 0.0, 0.0, adaptation.sensitivity[row, j]) for j in range(3)]
        R = packed(gentle_gain(adaptation.R, weight * vector(*L), QUICKEST), 3)
        before = self.own_count - 5 - COUNT
        estimate = np.where(first > 0.0, measured, x[row])
        own = [x[i] for i in range(before)]
        own[row] = estimate
        own[ADAPTATION : ADAPTATION + 6] = [R[i] for i in range(6)]
        own[ADAPTATION + 6 + 3 * row : ADAPTATION + 9 + 3 * row] = L
        own[ADAPTATION + 12 + 3 * row : ADAPTATION + 15 + 3 * row] = [weight * value for value in L]
        kept = [x[i] for i in range(self.own_count - 5, self.own_count)]
        kept[row] = weight * measured
        kept[2 + row] = kept[2 + row] + 1.0
        if row == 0:
            kept[4] = x[P] - measured
        return vector(*own, *(V_after[i] for i in range(COUNT)), *kept)

    def output(self, t: Array, x: Array, u: Any, p: Any) -> dict[str, Array]:
        """Position, speed and coefficients with their uncertainty."""
        adaptation = self._adaptation(x)
        covariance = adaptation.covariance
        learnt = self._learnt(adaptation, x, p)
        regressor = _regressor(x[V])
        of_resistance = sum(
            (regressor[0, i] * regressor[0, j] * covariance[2 + i, 2 + j] for i in range(3) for j in range(3)), 0.0
        )
        believed = self._coefficients(x, p)
        return {
            "position": x[P],
            "speed": x[V],
            "innovation": x[self.own_count - 1],
            "position_deviation": _root(covariance[0, 0]),
            **{n: believed[i] for i, n in enumerate(NAMES)},
            **{f"{n}_deviation": _root(covariance[2 + i, 2 + i]) / POWERS[i] for i, n in enumerate(NAMES)},
            **{f"{n}_learnt": learnt[i] for i, n in enumerate(NAMES)},
            "resistance_per_mass": self._resistance(x, p),
            "resistance_per_mass_deviation": _root(of_resistance),
            "smallest_excitation": smallest_eigenvalue(adaptation.excitation, 3),
        }

    def odometer_of(self, u: Any) -> Array:
        """The odometer [m/s]."""
        return u.odometer

    def own_bound(self, x: Array, p: Any) -> Array:
        """One standard deviation of the position [m]; the gate adds three times the recent innovation."""
        return _root(self._adaptation(x).covariance[0, 0])

    def error_certificate(self, max_gap: float, p: Any) -> Certificate:
        """Certificate of position and speed with the coefficients known and the odometer read all the time."""
        K = _settled(float(p.mu))
        drift = A - K[:, 1:] @ C[1:]
        error = ImpulsiveError.with_innovation(drift, K[:, :1], C[:1] @ K[:, :1], C[:1], (0, 1))
        model = (
            "errors of position and speed with the Davis coefficients known and the odometer read all the time; those "
            "of the coefficients obey least squares at any gaps, in cascade; drag slopes, noise and standstill are "
            "left out"
        )
        return certify_sampled_error((error,), max_gap, model)

    # -- internals --------------------------------------------------------------------------------------------------

    def _adaptation(self, x: Array) -> Adaptation:
        return adaptation_of(x[ADAPTATION:], C, SIZES)[0]

    def _learnt(self, adaptation: Adaptation, x: Array, p: Any) -> Array:
        moves = np.where(x[V] > p.minimum_speed, 1.0, 0.0)
        return moves * learnt_constants(adaptation.excitation, p.least_excitation, 3)

    def _gains(self, adaptation: Adaptation, x: Array, p: Any) -> Gains:
        return gains_of(adaptation, C, self._learnt(adaptation, x, p))

    def _coefficients(self, x: Array, p: Any) -> tuple[Array, ...]:
        first = (p.davis_a, p.davis_b, p.davis_c)
        return tuple(first[i] / p.mass + x[DELTA + i] / POWERS[i] for i in range(3))

    def _resistance(self, x: Array, p: Any) -> Array:
        a, b, c = self._coefficients(x, p)
        return a + b * x[V] + c * x[V] ** 2

    def _acceleration(self, x: Array, u: Any, p: Any) -> Array:
        moves = np.where(x[V] > 0.0, 1.0, 0.0)
        return u.effort / p.mass - moves * self._resistance(x, p)


DISTURBED = np.array([0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0])


def _regressor(speed: Array) -> Array:
    share = speed / SCALE
    return np.reshape(vector(1.0 + 0.0 * share, share, share * share), (1, 3))


def _begun(covariance: Array, row: int, weight: float, variance: Array) -> Array:
    """Covariance where an estimate has just been set to its first measurement."""
    place = SIZES.n + SIZES.m + row
    kept = np.eye(SIZES.error)
    kept[row, row] = kept[place, place] = 0.0
    noise = np.zeros(SIZES.error)
    noise[row], noise[place] = 1.0, weight
    return kept @ covariance @ kept + variance * np.outer(noise, noise)


def _settled(mu: float) -> np.ndarray:
    left = mu * np.eye(4) + np.kron(np.eye(2), A.T) + np.kron(A.T, np.eye(2))
    return np.asarray(np.linalg.solve(np.linalg.solve(left, (C.T @ C).ravel()).reshape(2, 2), C.T))


def _root(variance: Array) -> Array:
    return np.sqrt(np.maximum(variance, 1e-30))
