"""Train observer that learns the Davis coefficients per unit mass, from the effort, the odometer and balises."""

from __future__ import annotations

from typing import Any

import numpy as np

from fmu_observer.certificates.aperiodic import certify_sampled_error
from fmu_observer.certificates.finding import Finding
from fmu_observer.certificates.impulsive_error import ImpulsiveError
from fmu_observer.formulas.adaptation.adaptation_at_samples import (
    AtSample,
    Constants,
    Since,
    constants_now,
    covariance_at_first,
    covariance_at_sample,
    covariance_now,
    excitation_now,
    gain_now,
    since_flow,
    state_covariance,
)
from fmu_observer.formulas.adaptation.adaptive_law import Sizes, learnt_constants, smallest_eigenvalue
from fmu_observer.models.observer_model import named_as
from fmu_observer.observers.evaluated_observer import GapCertified
from fmu_observer.observers.gated_observer import GatedObserver
from fmu_observer.observers.innovation_gate import gain_ratio, place_deviation
from fmu_observer.observers.train.standstill import ROLLS_BACK, rolls_back, stands
from fmu_observer.observers.train.train_signals import (
    BALISE,
    BALISE_AND_ODOMETER,
    INNOVATION_OUTPUT,
    LAST_INNOVATION,
    MOTION,
    MOTION_OUTPUTS,
    ODOMETER,
)
from plant_models.hybrid import Array, Signal, input_signal, matrix, memory, output_signal, parameter, state, vector

_SIZES = Sizes(2, 3, 2, sampled=True)
_SCALE = 30.0  # [m/s]: constants are what each term of the resistance is at this speed [m/s2]
_FIRST_GAIN = 1.0  # [ours], of R
_PRIOR = (100.0, 5.0, 0.02, 0.02, 0.02)  # standard deviations at the start [m], [m/s], [m/s2] three times [ours]
_FIRST = np.diag([*np.square(_PRIOR), *([0.0] * _SIZES.q)])  # where c and lambda are zero
_UPPER = "upper triangle row by row"


def _symmetric(size: int) -> dict[str, Any]:
    return {"shape": (size, size), "symmetric": True}


_STATES = (
    *MOTION,
    state("sensitivity", "1", 0.0, "Sensitivity lambda of position and speed, row by row", shape=(2, 3)),
    state("inverse_s", "1", np.eye(2), f"Inverse of S, {_UPPER}", **_symmetric(2)),
    state("elapsed", "s", 0.0, "Time since the last sample"),
    state("decay", "1", np.eye(2), "What is left of a sampled innovation, row by row", shape=(2, 2)),
    state("fade", "s", 0.0, f"Integral of its Gramian, {_UPPER}", **_symmetric(2)),
    state("own_transition", "1", (0.0, 1.0), "Transition of an error of speed since the last sample", size=2),
    state("forced_transition", "1", 0.0, "Transition of a sampled innovation, row by row", shape=(2, 2)),
    state("gathered_noise", "1", 0.0, "Covariance of noise since the last sample, upper triangle", **_symmetric(2)),
    memory("corrections", "m/s2", 0.0, f"Corrections of a, b, c, at {_SCALE:g} m/s", size=3),
    memory("sampled_innovation", "m/s", 0.0, "Innovation of balise (weighed) and odometer", size=2),
    memory("adaptation_gain", "1", _FIRST_GAIN * np.eye(3), f"Adaptation gain R, {_UPPER}", **_symmetric(3)),
    memory("seen_sensitivity", "1", 0.0, "Sensitivity chi of the innovation, row by row", shape=(2, 3)),
    memory("mean_excitation", "1", 0.0, "Mean Gramian of the excitation, upper triangle", **_symmetric(3)),
    memory("error_covariance", "1", _FIRST, f"Covariance of the errors, {_UPPER}", **_symmetric(_SIZES.error)),
    memory("learnt", "1", 0.0, "1 for each coefficient that is learnt until the next sample", size=3),
    memory("samples_used", "1", 0.0, "Balises and readings used so far", size=2),
    LAST_INNOVATION,
    memory("last_reading", "m/s", 0.0, "Last reading of the odometer that was not missing"),
)


_BALISE_WEIGHT = 0.1  # [1/m] [ours]: a metre of a balise counts as 0.1 m/s of the odometer
C = np.array([[_BALISE_WEIGHT, 0.0], [0.0, 1.0]])
A = np.array([[0.0, 1.0], [0.0, 0.0]])
MU, FORGETTING = 0.2, 0.0  # [1/s] [ours]
QUICKEST = 50.0  # [1/s]: no sample moves constants faster [ours]
NAMES = ("davis_a_per_mass", "davis_b_per_mass", "davis_c_per_mass")
UNITS = ("m/s2", "1/s", "1/m")
POWERS = np.array([1.0, _SCALE, _SCALE**2])
ADAPTIVE = (
    parameter("mu", "1/s", MU, "Rate at which position and speed forget measurements", min=1e-9),
    parameter("forgetting", "1/s", FORGETTING, "Rate at which the coefficients forget measurements", min=0.0),
    parameter("gain_floor", "1", 0.0, "One over the largest adaptation gain; 0 for no limit", min=0.0),
    parameter("least_excitation", "1", 1e-4, "Mean excitation below which a coefficient is held", min=0.0),
    parameter("excitation_time", "s", 120.0, "Window of that mean", min=1e-9),
    parameter("first_gain", "1", _FIRST_GAIN, "Adaptation gain R at the first reading", min=0.0),
    parameter("balise_deviation", "m", 0.5, "Standard deviation of the place of a balise, at least", min=0.0),
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
    outputs, and the coefficients move in closed form, see `adaptation_at_samples`. The regressors ``1, v, v^2`` are
    those of the estimated speed. The first balise sets the position, the first reading the speed.

    Only effort over mass is known, so a mass or an effort that is wrong by a share shows as resistance, and so are
    gradients: use it where the line is level or its gradient is part of the effort, with the effort that acts. One
    speed shows the resistance at that speed and no more: b and c are learnt where the speed varies.
    Constant resistance and brake are dry friction, which holds a train that stands.
    `resistance_per_mass_deviation` is the standard deviation of the resistance at the speed now, always much surer than
    its parts. Below `minimum_speed`, and where `least_excitation` is not reached, coefficients are held: from one
    sample to the next.

    Gains [ours]: mu 0.2 1/s; coefficients do not forget.
    """

    name = "adaptive_davis"
    description = "Train observer that learns the Davis coefficients per unit mass"
    source = "Hann 2014, (4.7); the train case, covariance and holding are ours"
    internal_step = 1e-2
    weighing = "itself"
    bounded_parameters = ADAPTIVE
    frictions = ("estimated_speed",)
    states = _STATES
    inputs: tuple[Signal, ...] = (
        input_signal("effort", "N", 0.0, "Effort that acts at the wheel rim: traction positive, brake negative"),
        ODOMETER,
    )
    outputs = (
        *MOTION_OUTPUTS,
        INNOVATION_OUTPUT,
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
        ROLLS_BACK,
    )
    parameters = (
        parameter("mass", "kg", 90000.0, "Train mass", min=1.0),
        parameter("davis_a", "N", 900.0, "Running resistance believed first, constant term"),
        parameter("davis_b", "N.s/m", 32.4, "Running resistance believed first, linear term"),
        parameter("davis_c", "N.s2/m2", 1.65287, "Running resistance believed first, quadratic term"),
        parameter("minimum_speed", "m/s", 2.0, "Speed below which coefficients are held", min=0.1),
        *ADAPTIVE,
    )
    events = BALISE_AND_ODOMETER

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        known, since = _parts_of(x)
        now = constants_now(known, since)
        sensitivity, inverse_s, speed = x.sensitivity, x.inverse_s, x.estimated_speed
        slope = (p.davis_b + 2.0 * p.davis_c * speed) / p.mass
        drift = A - np.vstack([np.zeros((1, 2)), np.hstack([0.0, slope])])
        gain = inverse_s @ C.T
        predicted = vector(speed, self._free_acceleration(x, now, u, p))
        moving = since_flow(since, gain, drift, C, p.unknown_acceleration * DISTURBED)
        d_sensitivity = drift @ sensitivity - gain @ (since.decay @ known.seen)
        moves = 1.0 - stands(speed)  # the speed of a train that its friction holds follows no coefficient
        d_speed = [moves * (d_sensitivity[1, j] - r) for j, r in enumerate(_regressor(speed))]
        rates = predicted - gain @ now.innovation + sensitivity @ now.rates
        d_inverse = p.mu * inverse_s + drift @ inverse_s + inverse_s @ drift.T - gain @ gain.T
        return {
            **named_as(MOTION, rates),
            "sensitivity": matrix(d_sensitivity[0], d_speed),
            "inverse_s": d_inverse,
            **_moving_values(moving),
        }

    def friction(self, t: Array, x: Any, u: Any, p: Any) -> Array:
        """Constant resistance and brake [m/s2], shape (1,)."""
        now = constants_now(*_parts_of(x))
        return vector(np.maximum(self._coefficients(now, p)[0], 0.0) + np.maximum(-u.effort, 0.0) / p.mass)

    def update(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """One component of the innovation is set to what is measured; the first measurement sets the estimate too."""
        row = 0 if event == BALISE.name else 1
        known, since = _parts_of(x)
        now = constants_now(known, since)
        measured, deviation, gain = self._measured(row, x, now, u, p)
        used, estimate = [*x.samples_used], [x.estimated_position, x.estimated_speed]
        first = np.where(used[row] > 0.0, 0.0, 1.0)
        weight = float(C[row, row]) * gain
        sensitivity, seen, c = [*x.sensitivity], [*(since.decay @ known.seen)], [*now.innovation]
        # what has just been measured for the first time does not depend on the coefficients
        sensitivity[row] = np.where(first > 0.0, 0.0, sensitivity[row])
        seen[row] = reads = weight * sensitivity[row]
        c[row] = np.where(first > 0.0, 0.0, weight * (estimate[row] - measured))
        used[row], estimate[row] = used[row] + 1.0, np.where(first > 0.0, measured, estimate[row])
        R = gain_now(known, since, p.forgetting, p.gain_floor)
        if row == 1:
            R = np.where(first > 0.0, p.first_gain * np.eye(3), R)
        before = covariance_now(known, since, now.by_innovation, _SIZES)
        moved = covariance_at_sample(before, gain * C, row, reads, (weight * deviation) ** 2, _SIZES)
        begun = covariance_at_first(before, row, row, deviation**2, _SIZES)
        excitation = excitation_now(known, since, p.excitation_time)
        return {
            **named_as(MOTION, estimate),
            **_just_sampled(),
            "sensitivity": matrix(*sensitivity),
            "corrections": now.values,
            "sampled_innovation": vector(*c),
            "adaptation_gain": _gentle_gain(R, reads, QUICKEST),
            "seen_sensitivity": matrix(*seen),
            "mean_excitation": excitation,
            "error_covariance": np.where(first > 0.0, begun, moved),
            "learnt": self._learnt(excitation, estimate[1], p),
            "samples_used": vector(*used),
        } | ({"last_innovation": x.estimated_position - measured} if row == 0 else {"last_reading": u.odometer})

    def _measured(self, row: int, x: Any, now: Constants, u: Any, p: Any) -> tuple[Array, Array, Array]:
        """The place of a balise [m] or the reading now [m/s], its deviation, and the share of the full gain [1]."""
        if row == 0:
            deviation = place_deviation(u.balise_location_accuracy, p.balise_deviation)
            return u.balise_position, deviation, gain_ratio(self.own_bound(x, p), deviation, p.balise_deviation)
        return u.odometer + p.reading_age * self._acceleration(x, now, u, p), p.odometer_deviation, 1.0

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        known, since = _parts_of(x)
        now = constants_now(known, since)
        covariance = self._covariance(x, known, since, now)
        regressor = _regressor(x.estimated_speed)
        of_resistance = sum(
            (regressor[i] * regressor[j] * covariance[2 + i, 2 + j] for i in range(3) for j in range(3)), 0.0
        )
        believed = self._coefficients(now, p)
        return {
            "position": x.estimated_position,
            "speed": x.estimated_speed,
            "innovation": x.last_innovation,
            "position_deviation": _root(covariance[0, 0]),
            **{n: believed[i] for i, n in enumerate(NAMES)},
            **{f"{n}_deviation": _root(covariance[2 + i, 2 + i]) / POWERS[i] for i, n in enumerate(NAMES)},
            **{f"{n}_learnt": known.learnt[i] for i, n in enumerate(NAMES)},
            "resistance_per_mass": self._resistance(x, now, p),
            "resistance_per_mass_deviation": _root(of_resistance),
            "rolls_back": rolls_back(x.last_reading),
            "smallest_excitation": smallest_eigenvalue(excitation_now(known, since, p.excitation_time), 3),
        }

    def own_bound(self, x: Any, p: Any) -> Array:
        """One standard deviation of the position [m]; the gate adds three times the recent innovation."""
        known, since = _parts_of(x)
        return _root(self._covariance(x, known, since, constants_now(known, since))[0, 0])

    def gap_finding(self, gap: float, p: Any) -> Finding:
        """Certificate of position and speed with the coefficients known and the odometer read all the time."""
        K = _settled(float(p.mu))
        drift = A - K[:, 1:] @ C[1:]
        error = ImpulsiveError.with_innovation(drift, K[:, :1], C[:1] @ K[:, :1], C[:1], (0, 1))
        model = (
            "errors of position and speed with the Davis coefficients known and the odometer read all the time; those "
            "of the coefficients obey least squares at any gaps, in cascade; drag slopes, noise and standstill are "
            "left out"
        )
        return certify_sampled_error((error,), gap, model)

    # -- internals --------------------------------------------------------------------------------------------------

    def _covariance(self, x: Any, known: AtSample, since: Since, now: Constants) -> Array:
        """Of position, speed and corrections, shape (5, 5)."""
        V_now = covariance_now(known, since, now.by_innovation, _SIZES)
        return state_covariance(V_now, x.sensitivity, _SIZES)

    def _learnt(self, excitation: Array, speed: Array, p: Any) -> Array:
        return np.where(speed > p.minimum_speed, 1.0, 0.0) * learnt_constants(excitation, p.least_excitation, 3)

    def _coefficients(self, now: Constants, p: Any) -> tuple[Array, ...]:
        first = (p.davis_a, p.davis_b, p.davis_c)
        return tuple(first[i] / p.mass + now.values[i] / POWERS[i] for i in range(3))

    def _resistance(self, x: Any, now: Constants, p: Any) -> Array:
        a, b, c = self._coefficients(now, p)
        return a + b * x.estimated_speed + c * x.estimated_speed**2

    def _free_acceleration(self, x: Any, now: Constants, u: Any, p: Any) -> Array:
        """Acceleration without dry friction [m/s2]."""
        (a, b, c), speed = self._coefficients(now, p), x.estimated_speed
        return np.maximum(u.effort, 0.0) / p.mass - np.minimum(a, 0.0) - (b + c * np.abs(speed)) * speed

    def _acceleration(self, x: Any, now: Constants, u: Any, p: Any) -> Array:
        """Acceleration of a train that moves, else 0 [m/s2]."""
        return np.where(x.estimated_speed > 0.0, u.effort / p.mass - self._resistance(x, now, p), 0.0)


DISTURBED = np.array([[0.0, 0.0], [0.0, 1.0]])


def _regressor(speed: Array) -> tuple[Array, Array, Array]:
    share = speed / _SCALE
    return 1.0, share, share * share


def _settled(mu: float) -> np.ndarray:
    left = mu * np.eye(4) + np.kron(np.eye(2), A.T) + np.kron(A.T, np.eye(2))
    return np.asarray(np.linalg.solve(np.linalg.solve(left, (C.T @ C).ravel()).reshape(2, 2), C.T))


def _root(variance: Array) -> Array:
    return np.sqrt(np.maximum(variance, 1e-30))


def _gentle_gain(R: Array, seen: Array, quickest: float) -> Array:
    """R after a measurement, so that it moves no constant faster than `quickest`: ``inv(R) + chi' chi / quickest``.

    Without it the first sample after long would make the adaptation stiff.
    """
    moved = R @ seen
    size = len(seen)
    outer = np.reshape(moved, (size, 1)) @ np.reshape(moved, (1, size))
    return R - outer / (quickest + seen @ moved)


def _parts_of(x: Any) -> tuple[AtSample, Since]:
    """What was known at the last sample, and what has happened since."""
    one, two = x.own_transition
    own = matrix([1.0, one], [0.0, two])
    return (
        AtSample(
            x.corrections,
            x.sampled_innovation,
            x.adaptation_gain,
            x.seen_sensitivity,
            x.mean_excitation,
            x.error_covariance,
            x.learnt,
        ),
        Since(x.elapsed, x.decay, x.fade, own, x.forced_transition, x.gathered_noise),
    )


def _moving_values(since: Since) -> dict[str, Array]:
    """A `Since` by the names of the states."""
    return {
        "elapsed": since.elapsed,
        "decay": since.decay,
        "fade": since.fade,
        "own_transition": vector(since.own[0, 1], since.own[1, 1]),
        "forced_transition": since.forced,
        "gathered_noise": since.noise,
    }


def _just_sampled() -> dict[str, Array]:
    """The same at a sample."""
    none = np.zeros((2, 2))
    return _moving_values(Since(0.0, np.eye(2), none, np.eye(2), none, none))
