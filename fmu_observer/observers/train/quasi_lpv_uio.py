"""The quasi-LPV proportional-integral unknown-input observer, which stops following an odometer that lies."""

from __future__ import annotations

from math import inf
from typing import Any, Literal, NamedTuple

import numpy as np

from fmu_observer.certificates.finding import Finding
from fmu_observer.certificates.gap_error import first_unstable_gap, rows_of
from fmu_observer.certificates.gap_findings import gap_finding
from fmu_observer.certificates.impulsive_error import ImpulsiveError
from fmu_observer.certificates.periodic import PeriodicStability, periodic_stability
from fmu_observer.certificates.polytope import polytope_stability
from fmu_observer.design.jam_recovery import estimate_noise
from fmu_observer.design.quasi_lpv_published import (
    SECTION_3_3_4,
    SECTION_5_3_1,
    SEEN,
    QuasiLpvDesign,
    quasi_lpv_vertices,
)
from fmu_observer.detection.jam_detector import FAULT_OUTPUTS, RULES, RuleChoice, noise_warnings, stated_bounds, verdict
from fmu_observer.detection.jam_rules import SHARED_PARAMETERS, Passing, Reading
from fmu_observer.observers.evaluated_observer import GapCertified
from fmu_observer.observers.gated_observer import GatedObserver
from fmu_observer.observers.innovation_gate import known_accuracy
from fmu_observer.observers.train.standstill import held_disturbance, stands
from fmu_observer.observers.train.train_signals import (
    BALISE,
    BALISE_AND_ODOMETER,
    BALISES_USED,
    INNOVATION_OUTPUT,
    LAST_INNOVATION,
    MOTION_OUTPUTS,
    ODOMETER,
    POSITION,
)
from plant_models.hybrid import Array, Signal, input_signal, memory, output_signal, parameter, state, vector
from plant_models.hybrid.option import require_chosen

SPEEDS = 21  # between the vertices, for the certificate
HORIZON = 20.0  # [s] to which unstable periods of the odometer are searched for
_OPEN_BOUND = 1e3  # [m]: where the odometer is followed unconfirmed, no balise is doubted

_HoldChoice = Literal["innovation", "reading"]
HOLDS: tuple[_HoldChoice, ...] = ("innovation", "reading")

SPEED = state("estimated_speed", "m/s", 0.0, "Estimate of the train speed")
_OWN_MEMORY = (
    memory("held_odometer", "m/s", 0.0, "Last reading of the odometer"),
    memory("held_innovation", "m/s", 0.0, "Odometer minus estimate just after the last sample"),
    memory("last_disturbance", "m/s2", 0.0, "Disturbance at the sample before"),
    memory("last_disturbance_rate", "m/s3", 0.0, "Its rate then"),
    LAST_INNOVATION,
    memory("balise_stamp", "s", 0.0, "When the last balise was passed"),
    memory("balise_place", "m", 0.0, "Where it was"),
    memory("balise_reading", "m/s", 0.0, "Odometer then"),
    BALISES_USED,
    memory("onset_lead", "m", 0.0, "Position minus way of the odometer when the last fault began"),
)


def _preset(design: QuasiLpvDesign) -> dict[str, Any]:
    return {
        "davis_a": design.davis_a,
        "davis_b": design.davis_b,
        "davis_c": design.davis_c,
        "gain_low": design.gain_low,
        "gain_high": design.gain_high,
        "schedule_min": design.low,
        "schedule_max": design.high,
        "residual_gain": design.residual_gain,
        "threshold": design.threshold,
    }


class QuasiLpvUio(GatedObserver, GapCertified):
    """Speed, position and unknown resistance from an odometer that may lie: Aguiar Cota 2019, (3.36)-(3.45), section
    3.3.2.

    ``dp = v``, ``dv = F/M - a/M - (b + c z) v / M - d + K_1 i``, ``dd = d' + K_2 i``, ``dd' = K_3 i`` with the
    innovation i and the speed z of the scheduling, y_k, the last sample of the odometer. The gain is
    ``h_1 K(low) + h_2 K(high)``, ``h_1 = (high - z) / (high - low)``, within [0, 1]. d is a deceleration by all that
    the model does not know: gradient, missing brake effort, wrong coefficients. At a balise ``p = p_B``.

    What is held between samples: the reading, ``i = y_k - v`` as published; then the estimate of a train that brakes
    with a lags by half a period, ``a period / 2``, and so does the residual, which alone is half of the threshold of
    chapter 5. Or the innovation [ours], ``i = y_k - v(t_k)``, which has no such lag. `reading_age` is how old a reading
    is when it is sampled, half the period for one that was aggregated over it; it is made up for with the estimated
    acceleration.

    The residual ``M (y_k - v)`` is judged at each odometer sample by the rules of the jam detector. While they say that
    the odometer lies, i = 0.

    * ``rules="printed"``: Algorithm 3-3, with its latch-up (`PrintedRules`); d goes on with its rate d'.
    * ``rules="repaired"`` [ours]: recovery from every state (`RepairedRules`). With the onset of a fault d and d' are
      set back to the sample before, which may have been spoilt already; then d is held, and z is the estimate. When the
      odometer is believed again the speed is set to it, and d is kept. From one balise to the next the ways of odometer
      and estimate are compared with the distance.

    The resistance and a brake are dry friction on the estimated speed: they stop the train and never push it back. A
    disturbance does: where it is larger the estimate rolls back with the odometer, whose reading has a sign.

    Args:
        rules: ``repaired`` or ``printed``.
        hold: what is held between samples, ``innovation`` or ``reading``.

    Raises:
        ValueError: an unknown option.

    Presets, per unit mass, so that efforts are m/s2: `as_published` (default), the gains of section 3.3.4, whose
    coefficients are 20 % below those of the train; `as_published_5_3_1`, those of the validation. Nothing printed is
    unstable; what is repaired are options, the rules and what is held. The arming delay of 6 s is ours.
    """

    name = "quasi_lpv_uio"
    description = "Quasi-LPV unknown-input observer with jam detection and balise reset"
    source = "Aguiar Cota 2019, (3.36)-(3.45), Algorithm 3-3, section 3.3.2; the repaired rules ours"
    internal_step = 1e-2
    frictions = (SPEED.name,)
    weighing = "position"
    events = BALISE_AND_ODOMETER
    inputs: tuple[Signal, ...] = (
        input_signal("effort", "N", 0.0, "Effort as commanded: traction positive, brake negative"),
        ODOMETER,
    )
    outputs = (
        *MOTION_OUTPUTS,
        INNOVATION_OUTPUT,
        output_signal("disturbance", "m/s2", "Estimated deceleration by what the model does not know"),
        output_signal("residual", "m/s", "M times odometer minus estimated speed"),
        *FAULT_OUTPUTS,
    )
    presets = {
        "as_published": _preset(SECTION_3_3_4),
        "as_published_5_3_1": _preset(SECTION_5_3_1),
    }
    default_preset = "as_published"
    option_choices = {"rules": tuple(RULES), "hold": HOLDS}

    def __init__(self, rules: RuleChoice = "repaired", hold: _HoldChoice = "innovation") -> None:
        require_chosen(self.name, self.option_choices, rules=rules, hold=hold)
        self.rules = RULES[rules]
        self.stated_bounds = stated_bounds(self.rules)
        self.hold = hold
        self.repaired = rules == "repaired"
        self.states = (
            POSITION,
            SPEED,
            state("unknown_deceleration", "m/s2", 0.0, "Deceleration by what the model does not know, d"),
            state("unknown_deceleration_rate", "m/s3", 0.0, "Its rate d'"),
            state("odometer_way", "m", 0.0, "Way of the odometer since the last balise"),
            *_OWN_MEMORY,
            *self.rules.memory,
        )
        low, high = SECTION_3_3_4.gain_low, SECTION_3_3_4.gain_high
        self.parameters = (
            parameter("mass", "kg", 1.0, "Train mass; 1 for efforts per unit mass", min=1e-6),
            parameter("davis_a", "N", SECTION_3_3_4.davis_a, "Running resistance, constant term", min=0.0),
            parameter("davis_b", "N.s/m", SECTION_3_3_4.davis_b, "Running resistance, linear term"),
            parameter("davis_c", "N.s2/m2", SECTION_3_3_4.davis_c, "Running resistance, quadratic term"),
            parameter("gain_low", "1", low, "Gain at schedule_min, in 1/s, 1/s2 and 1/s3", size=3),
            parameter("gain_high", "1", high, "Gain at schedule_max, in 1/s, 1/s2 and 1/s3", size=3),
            parameter("schedule_min", "m/s", 0.0, "Speed of the lower vertex"),
            parameter("schedule_max", "m/s", 50.0, "Speed of the upper vertex"),
            parameter("reading_age", "s", 0.0, "Age of a reading when it is sampled", min=0.0),
            *SHARED_PARAMETERS,
            *self.rules.parameters,
        )
        super().__init__(rules=rules, hold=hold)

    def requirements(self, p: Any) -> dict[str, Array]:
        """The vertices are apart."""
        apart = {"schedule_max must be above schedule_min": np.where(p.schedule_max > p.schedule_min, 1.0, 0.0)}
        return super().requirements(p) | apart

    # -- equations --------------------------------------------------------------------------------------------------

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        lies = self.rules.discarded(x)
        z = self._scheduling(x)
        h = np.clip((p.schedule_max - z) / (p.schedule_max - p.schedule_min), 0.0, 1.0)
        gain = [h * p.gain_low[i] + (1.0 - h) * p.gain_high[i] for i in range(3)]
        innovation = (1.0 - lies) * self._difference(x)
        acceleration = self._free_acceleration(x, u, p) + gain[0] * innovation
        runs_on = 1.0 - lies if self.repaired else 1.0
        drifts = runs_on * x.unknown_deceleration_rate + gain[1] * innovation, gain[2] * innovation
        standing = stands(x.estimated_speed, x.held_odometer, p.odometer_noise if self.repaired else 0.0)
        disturbance, rate = held_disturbance(standing, *drifts, x.unknown_deceleration_rate)
        return {
            "estimated_position": x.estimated_speed,
            "estimated_speed": acceleration,
            "unknown_deceleration": disturbance,
            "unknown_deceleration_rate": rate,
            "odometer_way": x.held_odometer,
        }

    def friction(self, t: Array, x: Any, u: Any, p: Any) -> Array:
        """Constant resistance and brake [m/s2], shape (1,)."""
        return vector((p.davis_a + np.maximum(-u.effort, 0.0)) / p.mass)

    def update(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """An odometer sample is judged and held; a balise gives the position and a judgement of the way."""
        return self._at_balise(t, x, u, p) if event == BALISE.name else self._at_sample(x, u, p)

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return {
            "position": x.estimated_position,
            "speed": x.estimated_speed,
            "innovation": x.last_innovation,
            "disturbance": x.unknown_deceleration,
            "residual": p.residual_gain * self._difference(x),
        } | verdict(self.rules, x, p)

    def own_bound(self, x: Any, p: Any) -> Array:
        """While the odometer is not believed no balise is to be doubted: it is what the speed is corrected by."""
        return _OPEN_BOUND * self.rules.fault(x)

    def gap_finding(self, gap: float, p: Any) -> Finding:
        """Certificate of the error ``[p, v, d, d']`` at both vertices, changing between them at any time."""
        errors, gains = speed_errors(p)
        period = f"{float(p.odometer_period):g} s"
        if self.hold == "innovation":
            found, between = (
                _held_stability(errors, gains, float(p.odometer_period)),
                f"the innovation held for {period}",
            )
        else:
            found = _read_stability(errors, gains, gap)
            between = f"what the speed changes while a reading is held, {period}, an input to it, whatever the period"
        model = (
            f"error of speed, disturbance and its rate at both vertices ({float(p.schedule_min):g} and "
            f"{float(p.schedule_max):g} m/s), changing between them at any time, {between}; a balise ends the position "
            "error; times at which the odometer is not believed, and standstill, are left out"
        )
        return gap_finding(
            gap,
            inf,
            constant_limit=inf if found.constant else 0.0,
            mixed_limit=inf if found.holds else 0.0,
            growth=found.radius,
            decrease=found.margin,
            holds=found.holds,
            error_model=model,
            remarks=(found.note,),
            matrix=rows_of(found.P),
        )

    def working_point(self, p: Any) -> list[str]:
        """What to know of noise before a run, in words: faults that it hides, gains that make more of it."""
        noise = estimate_noise(*speed_errors(p), p)
        noisy = f"its gains make the estimate {noise:.3g} times as noisy as a reading; its rules take 1 for the most."
        return [*noise_warnings(p), *([noisy] if noise > 1.0 else [])]

    def deciding_parameters(self) -> tuple[Signal, ...]:
        """Gains, vertices and coefficients."""
        deciding = ("gain_low", "gain_high", "schedule_min", "schedule_max", "davis_b", "davis_c", "mass")
        return tuple(s for s in self.parameter_signals if s.name in deciding)

    # -- internals --------------------------------------------------------------------------------------------------

    def _at_sample(self, x: Any, u: Any, p: Any) -> dict[str, Array]:
        speed = x.estimated_speed
        acceleration = self._free_acceleration(x, u, p) - self.friction(0.0, x, u, p)[0]
        now = u.odometer + p.reading_age * np.where(speed > 0.0, acceleration, 0.0)
        evaluated = self.rules.at_sample(x, Reading(u.odometer, speed, p.residual_gain * (now - speed), u.effort), p)
        after, begins = np.where(evaluated.restart > 0.0, now, speed), evaluated.onset > 0.0
        disturbance = np.where(begins, x.last_disturbance, x.unknown_deceleration)
        rate = np.where(begins, x.last_disturbance_rate, x.unknown_deceleration_rate)
        # What may have been the estimate's mistake costs no more than the odometer would have.
        position = np.where(evaluated.withdrawn > 0.0, x.odometer_way + x.onset_lead, x.estimated_position)
        return {
            "estimated_position": position,
            "estimated_speed": after,
            "unknown_deceleration": disturbance,
            "unknown_deceleration_rate": rate,
            "held_odometer": now,
            "held_innovation": now - after,
            "last_disturbance": disturbance,
            "last_disturbance_rate": rate,
            "onset_lead": np.where(begins, x.estimated_position - x.odometer_way, x.onset_lead),
            **evaluated.memory,
        }

    def _at_balise(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        position, place = x.estimated_position, u.balise_position
        passing = Passing(
            t - x.balise_stamp,
            place - x.balise_place,
            x.odometer_way,
            position - x.balise_place,
            x.held_odometer - x.balise_reading,
            2.0 * known_accuracy(u.balise_location_accuracy),
            # Exactly on the balise: the gate has restarted the position there, and the way before it says nothing.
            np.where(x.balises_used > 0.0, np.where(position == place, 0.0, 1.0), 0.0),
        )
        evaluated = self.rules.at_balise(x, passing, p)
        restarts = evaluated.restart > 0.0
        return {
            "estimated_position": place,
            "estimated_speed": np.where(restarts, x.held_odometer, x.estimated_speed) + evaluated.shift,
            "odometer_way": 0.0,
            "held_innovation": np.where(restarts, 0.0, x.held_innovation),
            "last_innovation": position - place,
            "balise_stamp": t,
            "balise_place": place,
            "balise_reading": x.held_odometer,
            "balises_used": x.balises_used + 1.0,
            "onset_lead": place,
            **evaluated.memory,
        }

    def _difference(self, x: Any) -> Array:
        """Odometer minus estimate, as held [m/s]."""
        return x.held_innovation if self.hold == "innovation" else x.held_odometer - x.estimated_speed

    def _scheduling(self, x: Any) -> Array:
        """Speed of the scheduling [m/s]."""
        if not self.repaired:
            return x.held_odometer
        return np.where(self.rules.discarded(x) > 0.0, x.estimated_speed, x.held_odometer)

    def _free_acceleration(self, x: Any, u: Any, p: Any) -> Array:
        """Acceleration without innovation and dry friction [m/s2]."""
        drag = (p.davis_b + p.davis_c * np.abs(self._scheduling(x))) * x.estimated_speed
        return (np.maximum(u.effort, 0.0) - drag) / p.mass - x.unknown_deceleration


def speed_errors(p: Any) -> tuple[np.ndarray, np.ndarray]:
    """``A_i`` of speed, disturbance and its rate at both vertices, shape (2, 3, 3), and ``K_i``, shape (2, 3, 1):
    (3.45).
    """
    mass = float(p.mass)
    drifts = quasi_lpv_vertices(
        float(p.davis_b) / mass, float(p.davis_c) / mass, float(p.schedule_min), float(p.schedule_max)
    )
    return drifts, np.stack([np.asarray(p.gain_low, float), np.asarray(p.gain_high, float)])[:, :, None]


class _Stability(NamedTuple):
    """Of the speed error: for mixed and for constant gaps, radius [1], margin [1], Lyapunov matrix, and in words."""

    holds: bool
    constant: bool
    radius: float
    margin: float
    P: np.ndarray
    note: str


def _read_stability(errors: np.ndarray, gains: np.ndarray, max_gap: float) -> _Stability:
    """With a reading that counts all the time, over a gap [s]."""
    found = polytope_stability(errors - gains @ SEEN)
    note = f"the speed error falls at least as exp(-{max(found.decay, 0.0):.3g} t)"
    radius = float(np.exp(found.abscissa * max_gap))
    return _Stability(found.holds, found.abscissa < 0.0, radius, found.margin, found.lyapunov_matrix, note)


def _held_stability(errors: np.ndarray, gains: np.ndarray, period: float) -> _Stability:
    """With the innovation held for a period [s]."""
    found, longest = _sampled(errors, gains, period)
    reach = f"may be up to {longest:.3g} s" if longest < inf else f"may be any examined, up to {HORIZON:g} s,"
    note, radius = f"the odometer's period {reach} at a steady speed", found.spectral_radius
    return _Stability(found.holds, radius < 1.0, radius, found.margin, found.lyapunov_matrix, note)


def _sampled(drifts: np.ndarray, gains: np.ndarray, period: float) -> tuple[PeriodicStability, float]:
    """Stability over a period with the innovation held, at speeds between the vertices, and the first unstable
    period [s].
    """
    shares = np.linspace(0.0, 1.0, SPEEDS)[:, None, None]
    blended = zip(*((1.0 - shares) * pair[0] + shares * pair[1] for pair in (drifts, gains)), strict=True)
    errors = [ImpulsiveError.with_innovation(A, K, np.zeros((1, 1)), SEEN) for A, K in blended]
    found = periodic_stability(np.stack([error.transition(period) for error in errors]))
    return found, first_unstable_gap((errors[0], errors[-1]), HORIZON)
