"""Train observer: extended Kalman filter of an odometer at its period and balises when they come."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import inf
from typing import Any, NamedTuple

import numpy as np

from fmu_observer.certificates.finding import Finding
from fmu_observer.certificates.gap_error import rows_of
from fmu_observer.certificates.gap_findings import gap_finding
from fmu_observer.formulas.filtering.kalman import correct, log_likelihood, normalised_square, predicted_covariance
from fmu_observer.observers.evaluated_observer import GapCertified
from fmu_observer.observers.gated_observer import GatedObserver
from fmu_observer.observers.generic.discrete.covariance_requirements import positive_matrix
from fmu_observer.observers.innovation_gate import place_deviation
from fmu_observer.observers.made_for import MadeFor
from fmu_observer.observers.model_signals import LAST_NIS, LOG_LIKELIHOOD
from fmu_observer.observers.train.balise_odometer_transition import CREEP, ORDER, P, V, fading, transition
from fmu_observer.observers.train.standstill import stands
from fmu_observer.observers.train.train_resistance import rolling_drag
from fmu_observer.observers.train.train_signals import (
    BALISE,
    BALISE_AND_ODOMETER,
    INNOVATION_OUTPUT,
    LAST_INNOVATION,
    MOTION,
    MOTION_OUTPUTS,
    ODOMETER,
    SPEED,
    TRAIN_PARAMETERS,
)
from plant_models.hybrid import Array, vector
from plant_models.hybrid.signal import Signal, discrete_output, input_signal, memory, output_signal, parameter, state

VARIANCES = [f"estimate_covariance[{k}]" for k in (1, 5, 8, 10)]  # of an upper triangle
FIRST_DEVIATIONS = (100.0, 2.0, 0.1, 0.1)  # before any measurement, [m], [m/s], [m/s2], [m/s] [ours]
ROUNDING = 1e-9  # of times that are sums of periods
SIGMAS = 3.0  # standard deviations of the position that the gate of balise telegrams grants [ours]
SETTLING = 400  # readings after which a certificate takes the covariance for settled, and four gaps at least
HORIZON = 60.0  # longest gap that a certificate examines unasked [s]
_CERTIFIED_AT = 20.0  # speed of the certificate [m/s]

ODOMETER_ROW = np.array([[0.0, 1.0, 0.0, 1.0]])
BALISE_ROW = np.array([[1.0, 0.0, 0.0, 0.0]])

TUNABLE = (
    parameter("acceleration_density", "m2/s3", 1e-4, "Spectral density of the noise of the acceleration", min=0.0),
    parameter("disturbance_density", "m2/s5", 1e-6, "Spectral density of the drift of the disturbance", min=1e-15),
    parameter("gradient_deviation", "1", 0.01, "Standard deviation of the gradient that is not told", min=0.0),
    parameter("gradient_length", "m", 500.0, "Way over which the gradient becomes another one", min=1.0),
    parameter("effort_share", "1", 0.2, "Standard deviation of effort over mass, a share of it", min=0.0),
    parameter("effort_time", "s", 10.0, "Time for which the effort stays about the same", min=1e-3),
    parameter("creep_share", "1", 0.01, "Standard deviation of the wheels' creep, a share of the speed", min=0.0),
    parameter("creep_effort", "m/s2", 0.3, "Effort over mass at which the wheels creep so; less with less", min=1e-6),
    parameter("creep_time", "s", 20.0, "Correlation time of the creep", min=1e-3),
    parameter("odometer_deviation", "m/s", 0.1, "Standard deviation of the noise of a reading", min=1e-6),
    parameter("balise_deviation", "m", 0.5, "Standard deviation of the place of a balise, at least", min=1e-6),
    parameter("odometer_gate", "1", 4.0, "Standard deviations beyond which a reading is not used", min=0.1),
    parameter("odometer_recover", "s", 15.0, "Time of refused readings after which they are believed", min=0.0),
)
OWN_PARAMETERS = (
    *TRAIN_PARAMETERS,
    parameter("odometer_period", "s", 0.1, "Time between two readings of the odometer", min=1e-4),
    parameter("reading_age", "s", 0.0, "Age of a reading when it is sampled", min=0.0),
    *TUNABLE,
)


class BaliseOdometerEkf(GatedObserver, GapCertified):
    """Extended Kalman filter of a train with its covariance exact between events: equations of Allaoui 2024, section
    II.5; the train case is ours.

    ``dp = v``, ``dv = (F - a sgn(v) - b v - c v|v|)/M + d``, ``dd = w_d``, ``dz = -z / creep_time + w_z``: position,
    speed, an unknown acceleration and the creep of the wheel that carries the odometer, whose stationary deviation is
    `creep_share` of the speed. The odometer reads ``v + z`` every `odometer_period`, a balise p at its own stamp.
    Estimates flow; the covariance moves at events, by the transition over the time since the last one (drag slope held,
    series to the third order of its product with that time; noise as if there were no drag), and is corrected in Joseph
    form.

    What it believes of its model follows from what can be known of a train: d drifts as gradients do that are not known
    (`gradient_deviation` over `gradient_length`) and as an effort that acts on another mass than is stated does
    (`effort_share` of it, for `effort_time`); a wheel creeps as much as it transmits, `creep_share` of the speed from
    `creep_effort` on and nothing while it rolls freely. So where the odometer is right it is followed, and a model that
    is wrong is no reason to doubt it. A train that stands is held by dry friction, and its readings say nothing of
    position, disturbance and creep.

    A reading whose innovation is beyond `odometer_gate` of its own standard deviations is not used: a wheel that locks
    or spins. After `odometer_recover` without a reading that was used the next one is believed: the speed is set to
    it, and the position may be off by what that makes. A balise passes the common gate, which is granted three standard
    deviations of the position, and has the variance of its stated location accuracy, at least that of
    `balise_deviation`.

    It knows wheels that creep for about `creep_time`. A creep that lasts the whole gap between two balises, or a jam
    that holds a wheel for long, it follows more than the observers with rules for jams.

    Presets: `tuned` [ours], for the line Amsterdam - Utrecht, where wheels creep by up to a tenth of the speed on wet
    rail: what a wrong mass does it takes for such a creep.
    """

    name = "balise_odometer_ekf"
    description = "Extended Kalman filter of odometer and balises, with disturbance and creep"
    source = "Allaoui 2024, section II.5; the train case is ours"
    internal_step = 1e-2
    frictions = (SPEED.name,)
    weighing = "itself"
    bounded_parameters: tuple[Signal, ...] = TUNABLE
    inputs: tuple[Signal, ...] = (
        input_signal("effort", "N", 0.0, "Applied effort at the wheel rim: traction positive, brake negative"),
        ODOMETER,
    )
    outputs: tuple[Signal, ...] = (
        *MOTION_OUTPUTS,
        output_signal("disturbance", "m/s2", "Estimated acceleration that effort and resistance do not explain"),
        output_signal("creep", "m/s", "Estimated creep of the wheel, odometer minus speed"),
        INNOVATION_OUTPUT,
        output_signal("position_std", "m", "Standard deviation of the position's error"),
        output_signal("speed_std", "m/s", "Standard deviation of the speed's error"),
        discrete_output("nis", "1", "Normalised innovation squared of the last measurement used"),
        discrete_output("innovation_likelihood", "1", "Logarithm of the likelihood of all innovations"),
        discrete_output("odometer_fault", "1", "1 while the last reading was not used"),
    )
    events = BALISE_AND_ODOMETER
    parameters: tuple[Signal, ...] = OWN_PARAMETERS
    presets = {
        # ours: for the position error, line Amsterdam - Utrecht with drawn faults: docs/theses/tuning_the_train.md
        "tuned": {
            "acceleration_density": 6.15e-6,
            "disturbance_density": 9.83e-8,
            "creep_share": 0.0902,
            "creep_time": 12.4,
            "odometer_deviation": 0.387,
        },
    }

    made_for: Mapping[str, MadeFor] = {
        "tuned": MadeFor(
            "the 900 t train of the line Amsterdam - Utrecht, whose wheels creep by up to a tenth of the speed",
            {"mass": (600e3, 1200e3)},
            "take the defaults, or search for your own train",
        )
    }

    def __init__(self) -> None:
        self.states = self.own_states()
        super().__init__()

    def own_states(self) -> tuple[Signal, ...]:
        """States of the observer itself, estimates first."""
        start, text = np.diag([d**2 for d in FIRST_DEVIATIONS]), "Covariance at the last event, upper triangle"
        return (
            *MOTION,
            state("estimated_disturbance", "m/s2", 0.0, "Unknown acceleration d"),
            state("estimated_creep", "m/s", 0.0, "Creep z of the wheel"),
            memory("estimate_covariance", "1", start, text, shape=(ORDER, ORDER), symmetric=True),
            memory("last_time", "s", 0.0, "Time of the last event"),
            LAST_INNOVATION,
            LAST_NIS,
            LOG_LIKELIHOOD,
            memory("refused_time", "s", 0.0, "Time for which readings have not been used"),
        )

    def start_requirements(self, x: Any, p: Any) -> dict[str, Array]:
        """The covariance of the first estimate is one."""
        return positive_matrix("estimate_covariance", x.estimate_covariance, VARIANCES)

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return {
            "estimated_position": x.estimated_speed,
            "estimated_speed": _free_acceleration(x, u, p),
            "estimated_disturbance": 0.0,
            "estimated_creep": -x.estimated_creep * fading(x.estimated_speed, p),
        }

    def friction(self, t: Array, x: Array, u: Any, p: Any) -> Array:
        """Constant resistance and brake [m/s2], shape (1,)."""
        return vector((p.davis_a + np.maximum(-u.effort, 0.0)) / p.mass)

    def update(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """Covariance over the time since the last event, then correction by the reading or the balise."""
        return self.corrected(event, t, x, u, p)[0]

    def corrected(self, event: str, t: Array, x: Any, u: Any, p: Any) -> tuple[dict[str, Array], Array]:
        """What an event makes of the states, and 1 where the speed begins anew after refused readings, else 0.

        Args:
            event, t, x, u, p: as for `update`.
        """
        is_balise = event == BALISE.name
        before, estimate = self.covariance_now(t, x, u, p), estimate_of(x)
        if is_balise:
            error, row = u.balise_position - x.estimated_position, BALISE_ROW
            deviation = place_deviation(u.balise_location_accuracy, p.balise_deviation)
        else:
            error = self.reading(t, x, u, p) - x.estimated_speed - x.estimated_creep
            row, deviation = ODOMETER_ROW, p.odometer_deviation
        innovation = vector(error)
        after = correct(estimate, before, innovation, row, np.reshape(deviation**2, (1, 1)))
        nis = normalised_square(innovation, after.innovation_covariance)
        likelihood = log_likelihood(innovation, after.innovation_covariance)
        refused = 0.0 * nis if is_balise else np.where(nis > p.odometer_gate**2, 1.0, 0.0)
        kept = [np.where(refused > 0.0, estimate[i], after.estimate[i]) for i in range(ORDER)]
        kept[V] = moving_speed(kept[V], x.estimated_speed, u, p)
        covariance = np.where(refused > 0.0, before, after.covariance)
        refused_time = x.refused_time if is_balise else refused * (x.refused_time + p.odometer_period)
        anew = refused * np.where(refused_time + ROUNDING >= p.odometer_recover, 1.0, 0.0)
        new = _anew(estimate, before, error, refused_time)
        values = {
            **estimates(np.where(anew > 0.0, new[0][i], kept[i]) for i in range(ORDER)),
            "estimate_covariance": np.where(anew > 0.0, new[1], covariance),
            "last_time": t,
            "last_innovation": -error if is_balise else x.last_innovation,
            "last_nis": np.where(refused > 0.0, x.last_nis, nis),
            "log_likelihood": x.log_likelihood + np.where(refused > 0.0, 0.0, likelihood),
            "refused_time": refused_time * (1.0 - anew),
        }
        return values, anew

    def covariance_now(self, t: Array, x: Any, u: Any, p: Any) -> Array:
        """The covariance a time after the last event, shape (4, 4)."""
        moved = transition(t - x.last_time, x.estimated_speed, u.effort, p)
        return predicted_covariance(x.estimate_covariance, moved.F, moved.QN)

    def reading(self, t: Array, x: Any, u: Any, p: Any) -> Array:
        """The reading of the odometer, brought from its age to now [m/s]."""
        rate = _free_acceleration(x, u, p) - self.friction(t, x, u, p)[0]
        return u.odometer + p.reading_age * np.where(x.estimated_speed > 0.0, rate, 0.0)

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        now = self.covariance_now(t, x, u, p)
        return {
            "position": x.estimated_position,
            "speed": x.estimated_speed,
            "disturbance": x.estimated_disturbance,
            "creep": x.estimated_creep,
            "innovation": x.last_innovation,
            "position_std": np.sqrt(np.maximum(now[P, P], 0.0)),
            "speed_std": np.sqrt(np.maximum(now[V, V], 0.0)),
            "nis": x.last_nis,
            "innovation_likelihood": x.log_likelihood,
            "odometer_fault": np.where(x.refused_time > 0.0, 1.0, 0.0),
        }

    def own_bound(self, x: Any, p: Any) -> Array:
        """Three standard deviations of the position at the last event [m]."""
        return SIGMAS * np.sqrt(np.maximum(x.estimate_covariance[0, 0], 0.0))

    def gap_finding(self, gap: float, p: Any) -> Finding:
        """Certificate by the filter's own function ``e' inv(P) e``, which falls over every sequence of gaps.

        Judged is the settled filter at the gap and at the horizon, at 20 m/s: how much the error and that function
        fall from balise to balise.
        """
        horizon = max(HORIZON, gap)
        asked, longest = _settled(gap, p), _settled(horizon, p)
        stable = longest.spectral_radius < 1.0 and longest.margin > 0.0
        return gap_finding(
            gap,
            horizon,
            constant_limit=inf if stable else 0.0,
            mixed_limit=inf if stable else 0.0,
            growth=asked.spectral_radius,
            decrease=asked.margin,
            holds=stable and asked.spectral_radius < 1.0 and asked.margin > 0.0,
            error_model="error of position, speed, disturbance and creep of the linear train at 20 m/s, the wheels "
            "creeping as much as they may, readings at their period and a balise at the end of each gap; readings that "
            "are refused, and standstill, are left out",
            remarks=("the filter's own function e' inv(P) e grows over no sequence of gaps, whatever they are",),
            matrix=rows_of(np.linalg.inv(asked.covariance)),
        )

    def deciding_parameters(self) -> tuple[Signal, ...]:
        """Noises and the odometer's period."""
        return tuple(s for s in self.parameters if s in TUNABLE or s.name == "odometer_period")


def _free_acceleration(x: Any, u: Any, p: Any) -> Array:
    """Acceleration without dry friction [m/s2]."""
    return (np.maximum(u.effort, 0.0) - rolling_drag(x.estimated_speed, p)) / p.mass + x.estimated_disturbance


def _anew(estimate: Array, P: Array, error: Array, refused_time: Array) -> tuple[list[Array], Array]:
    """Estimate and covariance where readings are believed again that were refused for long.

    The speed is the reading's, what explained another speed is forgotten, and the position may be wrong by what the
    speed was wrong for that time.

    Args:
        estimate: shape (4,). P: covariance, shape (4, 4). error: reading minus what was expected [m/s]. refused_time:
            [s].
    """
    variances = [P[0, 0] + np.square(error * refused_time), *(d**2 + 0.0 * error for d in FIRST_DEVIATIONS[1:])]
    reading = estimate[V] + estimate[CREEP] + error
    found = [estimate[0], np.maximum(reading, 0.0), 0.0 * error, 0.0 * error]
    rows = [np.hstack([variances[i] if i == j else 0.0 * error for j in range(ORDER)]) for i in range(ORDER)]
    return found, np.vstack(rows)


def estimate_of(x: Any) -> Array:
    """The estimates, shape (4,)."""
    return vector(x.estimated_position, x.estimated_speed, x.estimated_disturbance, x.estimated_creep)


def estimates(values: Iterable[Array]) -> dict[str, Array]:
    """The estimates by name.

    Args:
        values: four, in the order of `estimate_of`.
    """
    names = ("estimated_position", "estimated_speed", "estimated_disturbance", "estimated_creep")
    return dict(zip(names, values, strict=True))


def moving_speed(speed: Array, before: Array, u: Any, p: Any) -> Array:
    """A corrected speed, zero where the train stands before and after it, and below zero only where the wheel turns
    backwards by more than its noise [m/s].

    A speed above zero, however small, would be friction's to stop, and would move the position on the way.

    Args:
        speed: after a correction [m/s]. before: the one before it [m/s].
    """
    noise = SIGMAS * p.odometer_deviation
    forward = np.where(u.odometer < -noise, speed, np.maximum(speed, 0.0))
    return np.where(stands(before, u.odometer, noise) > 0.0, 0.0, forward)


class _Settled(NamedTuple):
    """The filter where every gap is the same.

    Attributes:
        covariance: after a balise, shape (4, 4). spectral_radius: of the error from balise to balise [1]. margin: share
            by which ``e' inv(P) e`` falls at least [1].
    """

    covariance: np.ndarray
    spectral_radius: float
    margin: float


def _settled(gap: float, p: Any) -> _Settled:
    """The settled filter at a constant gap [s], readings at their period."""
    readings = max(round(gap / float(p.odometer_period)), 1)
    moved = transition(gap / readings, _CERTIFIED_AT, p.creep_effort * p.mass, p)
    F, QN = np.asarray(moved.F, dtype=float), np.asarray(moved.QN, dtype=float)
    reading, balise = float(p.odometer_deviation) ** 2, float(p.balise_deviation) ** 2
    first, after = np.eye(ORDER), np.diag(np.square(FIRST_DEVIATIONS))
    monodromy = np.eye(ORDER)
    for _ in range(max(SETTLING // readings, 4)):
        first, monodromy = after, np.eye(ORDER)
        for _ in range(readings):
            after, monodromy = _corrected(F @ after @ F.T + QN, F @ monodromy, ODOMETER_ROW, reading)
        after, monodromy = _corrected(after, monodromy, BALISE_ROW, balise)
    shrunk = np.linalg.solve(np.linalg.cholesky(after), monodromy @ np.linalg.cholesky(first))
    radius = float(np.abs(np.linalg.eigvals(monodromy)).max())
    return _Settled(after, radius, 1.0 - float(np.linalg.norm(shrunk, 2)) ** 2)


def _corrected(P: np.ndarray, M: np.ndarray, row: np.ndarray, variance: float) -> tuple[np.ndarray, np.ndarray]:
    """Covariance and transition of the error after a measurement, shapes (4, 4)."""
    after = correct(np.zeros(ORDER), P, np.zeros(1), row, np.array([[variance]]))
    return np.asarray(after.covariance), M - np.asarray(after.gain) @ (row @ M)
