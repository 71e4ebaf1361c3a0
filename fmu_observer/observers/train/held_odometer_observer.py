"""Observers of speed and acceleration disturbance whose odometer reading is held between samples, with bounds of their
speed error that run between them: what the two of them share.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import replace
from math import sqrt
from typing import Any, Literal

import numpy as np

from fmu_observer.certificates.aperiodic import certify_sampled_error, with_switching_noted
from fmu_observer.certificates.bounds import ErrorBounds
from fmu_observer.certificates.bounds.carried import first_component, level, level_of_box
from fmu_observer.certificates.bounds.formulas import improved_dmo_bound
from fmu_observer.certificates.finding import Finding
from fmu_observer.detection.jam_detector import ODOMETER_SAMPLE
from fmu_observer.observers.innovation_gate import known_accuracy
from fmu_observer.observers.parameter_values import Value, parameter_values
from fmu_observer.observers.train.held_odometer_error import error_matrix, first_gain, position_error, proven
from fmu_observer.observers.train.held_odometer_presets import DRAG_SLOPES, HELD_ODOMETER_PRESETS
from fmu_observer.observers.train.standstill import held_disturbance, stands
from fmu_observer.observers.train.train_observer import Estimate, TrainObserver
from fmu_observer.observers.train.train_resistance import rolling_drag
from fmu_observer.observers.train.train_signals import LAST_INNOVATION, POSITION, SPEED
from plant_models.hybrid import Array, input_signal, memory, output_signal, parameter, state
from plant_models.hybrid.option import require_chosen
from plant_models.hybrid.signal import within_bounds

_BOUND_NUMBERS = {  # of `ErrorBounds`: by which parameter
    "period": "odometer_period",
    "rate": "acceleration_max",
    "beta": "published_beta",
    "m": "published_decay",
    "sample_error": "published_sample_error",
    "noise": "odometer_error",
    "decay": "bound_decay",
}
Missing = Literal["predicted", "held"]

REPAIRED = HELD_ODOMETER_PRESETS["repaired"]
_PROOF = (
    "the error must decay with bound_decay under gain, as lyapunov_matrix proves for the drag slopes of the train "
    f"(mass, davis_b, davis_c, speed_max; those of the presets for {DRAG_SLOPES[0]:g} to {DRAG_SLOPES[1]:g} 1/s); see "
    "fmu_observer.design.proposition_4_1.bound_matrix"
)


class HeldOdometerObserver(TrainObserver):
    """Base of the observers with a held odometer reading: Aguiar Cota 2019, (4.1)-(4.3).

    ``dv = effort/m - w(v) - d + k1 r``, ``d d = d' + k2 r``, ``d d' = k3 r``, ``r = y_k - v`` with the odometer reading
    ``y_k`` of the last sample, held, and ``w`` the Davis resistance, ``k1 = gain[1] + gain_schedule (b + c z) / m`` and
    z the speed that a subclass gives. The position is the integral of the speed; at a balise it is set to that of the
    balise. A sample at which the input `odometer_fault` is 1 is not used, and the option `missing` says what then.
    A disturbance that brakes is dry friction on the speed, as the Davis constant and the brake are: it stops the
    observed train and never pushes it back, unless the wheel turns backwards by more than its readings err: then it
    drives the train. For a speed above zero that is the equation above.

    The error obeys ``de = (A - K C) e + K (v(t) - y_k) + w``: the motion since the sample drives it, so it does not
    vanish while the train accelerates, and bounds of it run as outputs.

    1. `error_as_printed`: i-DMO or i-CDO, from each sample on, with the error there stated by `published_sample_error`.
       No bound: what the samples before leave at a sample is larger than stated for some of the printed gains.
    2. `carried_bound` [ours]: the level ``W = sqrt(e' P e)``, carried over samples, no sample needs a statement of its
       own. It covers accelerations up to `acceleration_max`, readings wrong by `odometer_error`, unknown parts of the
       acceleration up to `unknown_acceleration`, of its rate and of the rate of that. What the observer itself does
       to its estimate beside the equation above is known, and is added to the level.
    3. `error_bound` [ours]: the lesser of the carried bound and of the reading itself, which is
       ``|y_k - v_estimated| + odometer_error + acceleration_max (t - t_k)`` and needs neither model nor gain. Where the
       train may stand still only the latter counts, for there the disturbance jumps by the brake's effort.

    `position_bound` is the integral of `error_bound` since the last balise, from its location accuracy on.

    Args:
        missing: what becomes of the estimate after a sample that is not used, until the next one that is: ``predicted``
            by the model and the disturbance alone [ours], ``held`` to the last reading that was used, as in the thesis.
            Held, the estimate is drawn to an old speed; predicted, it goes on, and `error_as_printed` does not apply.
            To predict, d and d' are set back to the sample before, for the last reading that was used may have lied
            already, and limited to `disturbance_max` and `disturbance_rate_max`; from there on d' decays,
            ``d d' = -d' / rate_decay_time``, so that d goes on by ``d' rate_decay_time`` at most, however long.

    Raises:
        ValueError: another word for `missing`.
    """

    source = "Aguiar Cota 2019, (4.1)-(4.19), (4.40), 4.3.4, 5.4"
    frictions = (SPEED.name,)
    weighing = "position"
    weighed_states = ("estimated_position", "integrated_bound")
    inputs = (
        *TrainObserver.inputs,
        input_signal(
            "odometer_fault",
            "1",
            0.0,
            "1 where a detector says that the odometer lies: its sample is not used",
            optional=True,
        ),
    )
    outputs = (
        *TrainObserver.outputs,
        output_signal("disturbance", "m/s2", "Estimated deceleration that is not in the model"),
        output_signal("residual", "m/s", "Odometer reading of the last sample minus estimated speed"),
        output_signal("error_bound", "m/s", "Bound of the speed error now: the lesser of carried bound and reading"),
        output_signal("carried_bound", "m/s", "Bound of the speed error carried over samples"),
        output_signal("error_as_printed", "m/s", "Printed formula of the error, with a stated one at the last sample"),
        output_signal("position_bound", "m", "Bound of the position error, from the last balise on"),
        output_signal("sample_age", "s", "Time since the last odometer sample that was used"),
    )
    train_parameters = tuple(
        replace(s, min=None) if s.name in ("davis_b", "davis_c") else s for s in TrainObserver.train_parameters
    )
    estimator_states = (
        POSITION,
        SPEED,
        state("estimated_disturbance", "m/s2", 0.0, "Estimate of the deceleration that is not in the model"),
        state("estimated_disturbance_rate", "m/s3", 0.0, "Estimate of its rate"),
        state("bound_level", "1", 0.0, "Level W of the error in the norm of lyapunov_matrix, at most"),
        state("integrated_bound", "m", 0.0, "Bound of the position error"),
    )
    estimator_memory = (
        memory("held_speed", "m/s", 1.0, "Odometer reading that is held"),
        memory("held_time", "s", 0.0, "Time of that reading"),
        memory("held_error", "m/s", 0.0, "Largest error of that reading"),
        memory("sampled_once", "1", 0.0, "1 after the first sample"),
        memory("predicting", "1", 0.0, "1 while no reading acts on the estimate"),
        LAST_INNOVATION,
        memory("last_disturbance", "m/s2", 0.0, "Disturbance at the last sample that was used"),
        memory("last_disturbance_rate", "m/s3", 0.0, "Its rate then"),
    )
    estimator_parameters = (
        parameter("odometer_period", "s", 0.2, "Sampling period of the odometer", min=1e-4),
        parameter("gain", "1", REPAIRED["gain"], "Gain K on speed, disturbance and its rate", size=3),
        parameter("gain_schedule", "1", REPAIRED["gain_schedule"], "Share of the drag slope added to the first gain"),
        parameter("acceleration_max", "m/s2", 1.7, "Largest acceleration or deceleration of the train", min=0.0),
        parameter("odometer_error", "m/s", 0.05, "Largest error of a reading that is no fault", min=0.0),
        parameter("unknown_acceleration", "m/s2", 0.05, "Largest unknown part of the acceleration", min=0.0),
        parameter("unknown_jerk", "m/s3", 0.0, "Largest unknown part of the disturbance's rate", min=0.0),
        parameter("unknown_jerk_rate", "m/s4", 0.05, "Largest second derivative of the disturbance", min=0.0),
        parameter("disturbance_max", "m/s2", 2.0, "Largest disturbance, at the start and to predict with", min=0.0),
        parameter("disturbance_rate_max", "m/s3", 1.0, "Largest rate of it, likewise", min=0.0),
        parameter("rate_decay_time", "s", 1.0, "Time in which the rate decays while speed is predicted", min=1e-3),
        parameter("start_speed_error", "m/s", 50.0, "Largest speed error before the first sample", min=0.0),
        parameter("start_position_error", "m", 0.0, "Largest position error at the start", min=0.0),
        parameter(
            "lyapunov_matrix",
            "1",
            REPAIRED["lyapunov_matrix"],
            "P: 11, 12, 13, 22, 23, 33",
            shape=(3, 3),
            symmetric=True,
        ),
        parameter("bound_decay", "1/s", REPAIRED["bound_decay"], "Decay rate of the error that P proves", min=1e-6),
        parameter("speed_max", "m/s", 50.0, "Speed up to which the carried bound holds", min=1e-3),
        parameter("bound_min_speed", "m/s", 0.5, "Speed below which the train may stand still", min=0.0),
        parameter("published_beta", "1", REPAIRED["published_beta"], "Overshoot beta of the printed formula", min=1.0),
        parameter("published_decay", "1/s", REPAIRED["published_decay"], "Decay m of the printed formula", min=1e-6),
        parameter("published_sample_error", "m/s", 0.1, "Error norm stated for each sample", min=0.0),
    )
    estimator_events = (ODOMETER_SAMPLE,)
    stability_parameters = ("gain", "gain_schedule", "speed_max")
    presets = HELD_ODOMETER_PRESETS
    default_preset = "repaired"
    option_choices = {"missing": ("predicted", "held")}

    def __init__(self, missing: Missing = "predicted") -> None:
        require_chosen(self.name, self.option_choices, missing=missing)
        self.missing = missing
        super().__init__(missing=missing)

    # -- what a subclass writes -------------------------------------------------------------------------------------

    @abstractmethod
    def scheduling_speed(self, x: Any) -> Array:
        """Speed z that the first gain is scheduled with [m/s]."""

    @abstractmethod
    def largest_gain_level(self, x: Any, p: Any) -> Array:
        """Level of the gain K in the norm of `lyapunov_matrix`, at most [1/s]."""

    @abstractmethod
    def largest_gain_norm(self, x: Any, p: Any) -> Array:
        """Euclidean norm of the gain K, at most [1/s]."""

    # -- what follows -----------------------------------------------------------------------------------------------

    def estimator_flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        speed, rate, predicting = x.estimated_speed, x.estimated_disturbance_rate, x.predicting > 0.0
        residual = np.where(predicting, 0.0, x.held_speed - speed)
        traction = np.maximum(u.effort, 0.0)  # a negative effort is a brake: see friction
        free = (traction - rolling_drag(speed, p)) / p.mass - x.estimated_disturbance
        free = free + self._braking(x)  # what brakes: see friction
        acceleration = free + first_gain(self.scheduling_speed(x), p) * residual
        bound = self.error_bound(t, x, p)
        # Without a reading it is the error itself that K is missing: (A) e = (A - K C) e + K C e.
        driving = np.where(predicting, bound, self._since_reading(t, x, p))
        reading = self.largest_gain_level(x, p) * driving
        decay = np.where(predicting, rate / p.rate_decay_time, 0.0)
        # What holds an estimate at standstill, beyond what stops it, is no part of the equations of the error.
        holding = np.maximum(self.friction(t, x, u, p)[0] - acceleration, 0.0)
        # At standstill d and d' leave their equations, too: the carried bound is not reported there, nor carried on.
        standing = stands(speed, x.held_speed, x.held_error)
        drifts = rate + p.gain[1] * residual, p.gain[2] * residual - decay
        P = p.lyapunov_matrix
        own = np.sqrt(P[0, 0]) * np.where(speed > 0.0, 0.0, holding) + np.sqrt(P[2, 2]) * np.abs(decay)
        drift, rate_drift = held_disturbance(standing, *drifts, rate, 1.0 / p.rate_decay_time)
        return {
            "estimated_position": speed,
            "estimated_speed": acceleration,
            "estimated_disturbance": drift,
            "estimated_disturbance_rate": rate_drift,
            "bound_level": reading + _unknown_level(p) + own - p.bound_decay * x.bound_level,
            "integrated_bound": bound,
        }

    def friction(self, t: Array, x: Any, u: Any, p: Any) -> Array:
        """Davis constant, brake, and a disturbance that brakes [m/s2], shape (1,)."""
        return super().friction(t, x, u, p) + self._braking(x)

    def estimate(self, x: Any, u: Any, p: Any) -> Estimate:
        return Estimate(x.estimated_position, x.estimated_speed, u.effort, x.last_innovation)

    def own_bound(self, x: Any, p: Any) -> Array:
        """The bound of the position error [m]."""
        return x.integrated_bound

    def carried_bound(self, x: Any, p: Any) -> Array:
        """The level as a bound of the speed error [m/s]."""
        return first_component(p.lyapunov_matrix) * x.bound_level

    def error_bound(self, t: Array, x: Any, p: Any) -> Array:
        """The lesser of the carried bound, where the train surely moves, and of the bound by the reading [m/s]."""
        by_reading = np.abs(x.held_speed - x.estimated_speed) + self._since_reading(t, x, p)
        return np.where(self._moves(t, x, p) > 0.0, np.minimum(self.carried_bound(x, p), by_reading), by_reading)

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """The estimate with its slip, disturbance, residual and bounds."""
        age, norm = self._age(t, x), self.largest_gain_norm(x, p)
        printed = improved_dmo_bound(
            age, p.published_sample_error, p.published_beta, p.published_decay, norm, p.acceleration_max
        )
        return super().output(t, x, u, p) | {
            "disturbance": x.estimated_disturbance,
            "residual": x.held_speed - x.estimated_speed,
            "error_bound": self.error_bound(t, x, p),
            "carried_bound": self.carried_bound(x, p),
            "error_as_printed": printed,
            "position_bound": x.integrated_bound,
            "sample_age": age,
        }

    def update(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """A balise sets the position; a sample of the odometer that is no fault is held from now on."""
        if event == "balise":
            return {
                "estimated_position": u.balise_position,
                "integrated_bound": known_accuracy(u.balise_location_accuracy),
                "last_innovation": x.estimated_position - u.balise_position,
            }
        return self._at_sample(t, x, u, p)

    def _at_sample(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """What a sample of the odometer changes."""
        first, speed = 1.0 - x.sampled_once, x.estimated_speed
        d_now, rate_now = x.estimated_disturbance, x.estimated_disturbance_rate
        usable = np.where(u.odometer_fault > 0.5, 0.0, 1.0)
        taken = np.maximum(usable, first)
        # Without any reading the estimate stands for it, wrong by as much as is stated for the start.
        reading = np.where(usable > 0.0, u.odometer, speed)
        wrong = np.where(usable > 0.0, p.odometer_error, p.start_speed_error)
        box = (np.abs(d_now) + p.disturbance_max, np.abs(rate_now) + p.disturbance_rate_max)
        assumed = level_of_box(p.lyapunov_matrix, np.abs(reading - speed) + wrong, *box)
        carries = (1.0 - first) * self._moves(t, x, p)
        known = np.where(carries > 0.0, np.minimum(x.bound_level, assumed), assumed)
        held = {"held_speed": reading, "held_time": t, "held_error": wrong, "sampled_once": 1.0}
        predicts = (1.0 - usable) if self.missing == "predicted" else 0.0
        begins = predicts * x.sampled_once * (1.0 - x.predicting)
        last = np.clip(x.last_disturbance, -p.disturbance_max, p.disturbance_max)
        last_rate = np.clip(x.last_disturbance_rate, -p.disturbance_rate_max, p.disturbance_rate_max)
        d = np.where(begins > 0.0, last, d_now)
        rate = np.where(begins > 0.0, last_rate, rate_now)
        moved = level(p.lyapunov_matrix, 0.0, d - d_now, rate - rate_now)
        return {
            "estimated_disturbance": d,
            "estimated_disturbance_rate": rate,
            "bound_level": np.where(taken > 0.0, known, x.bound_level + moved),
            "integrated_bound": np.where(first > 0.0, p.start_position_error, x.integrated_bound),
            **{name: np.where(taken > 0.0, new, getattr(x, name)) for name, new in held.items()},
            "predicting": predicts,
            "last_disturbance": np.where(usable > 0.0, d, x.last_disturbance),
            "last_disturbance_rate": np.where(usable > 0.0, rate, x.last_disturbance_rate),
        }

    def requirements(self, p: Any) -> dict[str, Array]:
        """Bounds of the numbers that the bounds rest on, and the proof of the decay at both ends of the drag slopes."""
        slowest, fastest = _error_slopes(p)
        shown = [proven(a11, p) for a11 in (slowest, fastest)]
        limited = tuple(s for s in self.estimator_parameters if s.min is not None)
        return super().requirements(p) | within_bounds(limited, p) | {_PROOF: shown[0] * shown[1]}

    def gap_finding(self, gap: float, p: Any) -> Finding:
        """Certificate of ``de = (A - K C) e`` with the position behind it, for all drag slopes up to `speed_max`."""
        vertices = tuple(position_error(a11, p) for a11 in dict.fromkeys(map(float, _error_slopes(p))))
        model = (
            f"error of position, speed, disturbance and its rate over gaps between balises, drag slopes up to "
            f"{float(p.speed_max):g} m/s, constant over a gap; the motion since an odometer sample is an input to it, "
            f"so that its period ({float(p.odometer_period):g} s) decides the size of the error and not whether it is "
            "forgotten: see error_bound; standstill is left out"
        )
        return with_switching_noted(certify_sampled_error(vertices, gap, model), vertices, "drag slopes")

    def error_bounds(self, parameters: Mapping[str, Value] | None = None, preset: str | None = None) -> ErrorBounds:
        """What the bounds say with given parameters: at the period, over missing samples, largest gaps.

        Args:
            parameters: values by name that replace those of the preset, scalars or whole vectors.
            preset: preset to start from; None for the observer's default.

        Returns:
            The bounds with their numbers.

        Raises:
            ValueError: a parameter or the preset is unknown or not legal, or P does not prove the decay.
        """
        p = self.unpack_parameters(parameter_values(self, parameters, preset, "to bound its error"))
        return self._error_bounds(p, preset or self.default_preset or "")

    def _error_bounds(self, p: Any, preset: str) -> ErrorBounds:
        slopes = tuple(map(float, _error_slopes(p)))
        if not all(proven(a11, p) for a11 in slopes):
            gain = [float(k) for k in p.gain]
            raise ValueError(f"{self.name}: {_PROOF} (bound_decay = {float(p.bound_decay):g} 1/s, gain = {gain}).")
        gains = [np.array([float(first_gain(z, p)), *map(float, p.gain[1:])]) for z in (0.0, float(p.speed_max))]
        numbers = {name: float(getattr(p, of)) for name, of in _BOUND_NUMBERS.items()}
        unknown = (float(p.unknown_acceleration), float(p.unknown_jerk), float(p.unknown_jerk_rate))
        return ErrorBounds(
            observer=self.name,
            preset=preset,
            gain=max(sqrt(float(K @ K)) for K in gains),
            disturbances=unknown,
            P=p.lyapunov_matrix,
            drifts=[error_matrix(a11, p) for a11 in slopes],
            gains=gains,
            **numbers,
        )

    def limit_findings(self, values: np.ndarray) -> Iterator[Finding]:
        """The constant gap between balises, and the speed error just before the next sample of the odometer."""
        yield from super().limit_findings(values)
        p = self.unpack_parameters(values)
        if all(proven(a11, p) for a11 in map(float, _error_slopes(p))):
            yield from self._error_bounds(p, "").findings()

    # -- internals --------------------------------------------------------------------------------------------------

    @staticmethod
    def _braking(x: Any) -> Array:
        """The disturbance as far as it is dry friction [m/s2]: not where the wheel turns backwards, which it drives."""
        return np.where(x.held_speed < -x.held_error, 0.0, np.maximum(x.estimated_disturbance, 0.0))

    @staticmethod
    def _age(t: Array, x: Any) -> Array:
        return np.maximum(t - x.held_time, 0.0)

    def _since_reading(self, t: Array, x: Any, p: Any) -> Array:
        """By how much the speed may differ from the held reading [m/s]."""
        return x.held_error + p.acceleration_max * self._age(t, x)

    def _moves(self, t: Array, x: Any, p: Any) -> Array:
        """1 where the train cannot have stopped since the held reading."""
        return np.where(x.held_speed > p.bound_min_speed + self._since_reading(t, x, p), 1.0, 0.0)


def _error_slopes(p: Any) -> tuple[Array, Array]:
    """Smallest and largest entry 11 of the error matrix [1/s], over true, estimated and scheduling speeds from 0 to
    `speed_max`: ``-(b + c (v + v_estimated)) / m - first_gain(z)``.
    """
    fixed = -p.gain[0] - (1.0 + p.gain_schedule) * p.davis_b / p.mass
    drag, schedule = p.davis_c / p.mass * 2.0 * p.speed_max, p.gain_schedule * p.davis_c / p.mass * p.speed_max
    smallest = fixed - np.maximum(drag, 0.0) - np.maximum(schedule, 0.0)
    return smallest, fixed - np.minimum(drag, 0.0) - np.minimum(schedule, 0.0)


def _unknown_level(p: Any) -> Array:
    """Largest level of what the model does not know: an acceleration, its rate and the rate of that [m/s2]."""
    p11, p22, p33 = (p.lyapunov_matrix[i, i] for i in range(3))
    return np.sqrt(p11) * p.unknown_acceleration + np.sqrt(p22) * p.unknown_jerk + np.sqrt(p33) * p.unknown_jerk_rate
