"""The unknown-input observer of the fault-tolerant stopping control, with its fault detector inside.

Speed, one disturbance acceleration and its rate from a quasi-continuous speed. Knows the gate of balises, the rules of
the detector, and no controller.
"""

from __future__ import annotations

from math import inf, log
from typing import Any

import numpy as np
import scipy

from fmu_observer.certificates.finding import Finding
from fmu_observer.certificates.gap_error import rows_of
from fmu_observer.certificates.gap_findings import gap_finding
from fmu_observer.detection.threshold_detector import (
    NEVER,
    THRESHOLD_MEMORY,
    THRESHOLD_PARAMETERS,
    evaluate,
    threshold_requirements,
)
from fmu_observer.observers.evaluated_observer import GapCertified
from fmu_observer.observers.gated_observer import GatedObserver
from fmu_observer.observers.train.train_signals import (
    BALISE,
    BALISES_USED,
    INNOVATION_OUTPUT,
    LAST_INNOVATION,
    MOTION_OUTPUTS,
    POSITION,
)
from plant_models.hybrid import Array, PeriodicEvent
from plant_models.hybrid.signal import (
    Signal,
    discrete_output,
    input_signal,
    memory,
    output_signal,
    parameter,
    state,
    warning_output,
)

PRINTED_GAIN = (101.4, 2650.0, 3750.0)
_PRINTED_START = {"estimated_speed": 30.0, "disturbance_estimate": -0.91, "disturbance_rate": 0.13}


class StoppingUio(GatedObserver, GapCertified):
    """Proportional-integral observer of ``v' = -w1 v + b u + d``, ``d'' = 0``, that detects a lost brake.

    ``z' = A_o z + B_o u + K (v - vhat)`` for ``z = (v, d, d')``, and the position integrates vhat. The disturbance
    takes up the constant and quadratic drag, the gradient, and whatever else the model does not know. Where the wheels
    jam the brake is lost, and the residual ``v - vhat`` shows it for some milliseconds only: the integrators absorb a
    lasting fault. Its begin and its end are found by the rules of `threshold_detector`; while a fault is detected the
    observer takes the effort as zero, so that the end shows as well.

    **It needs a quasi-continuous speed**: a new value at every sample, each `sample_period` of 1 to 2 ms. The printed
    gain has poles at -50, -50 and -1.5 1/s, and the thresholds are 5 mm/s, which a train under brake passes in 2 ms: a
    reading that is held for 200 ms looks like a fault at every sample, one that is held for two samples at some (a
    limit of the thesis' own design). Fed so, `held_odometer` becomes 1 and stays, as soon as a reading has stood for a
    sample and then jumped by `threshold_start`. The innovation is taken every `sample_period` and held until the next.

    The speed is believed: the fault of this chapter is of the brake, not of the sensor. For an odometer that lies while
    the wheels jam use `quasi_lpv_uio`.

    Presets: `repaired` (default; true initial rate of the disturbance in the thesis' scenario, a fault is given up
    after 1 s, nothing is judged below 0.2 m/s), `as_published` (initial rate 0.13 as printed, which is not the true
    one, and no fault is given up).

    Source: Aguiar Cota 2019, (3.15)-(3.18), 3.2.2.3, 3.2.3; sampling, time-out and standstill are ours.
    """

    name = "stopping_uio"
    description = (
        "Unknown-input observer for fault-tolerant stopping: speed, disturbance, and detection of a lost brake"
    )
    source = "Aguiar Cota 2019, (3.15)-(3.18) and 3.2.3"
    weighing = "position"
    states = (
        POSITION,
        state("estimated_speed", "m/s", 30.0, "Estimate of the train speed"),
        state("disturbance_estimate", "m/s2", -0.91, "Estimate of all accelerations that the model does not know"),
        state("disturbance_rate", "m/s3", 0.337, "Estimate of the rate of the disturbance"),
        memory("held_innovation", "m/s", 0.0, "Odometer minus estimate at the last sample"),
        LAST_INNOVATION,
        BALISES_USED,
        *THRESHOLD_MEMORY,
        memory("last_reading", "m/s", 0.0, "Odometer at the last sample"),
        memory("unchanged_time", "s", 0.0, "Time for which the odometer has not changed"),
        memory("held_seen", "1", 0.0, "1 once the odometer has stood and then jumped"),
    )
    inputs = (
        input_signal("effort", "N", 0.0, "Effort that is commanded: traction positive, brake negative"),
        input_signal("odometer", "m/s", 0.0, "Speed, new every 1 to 2 ms"),
    )
    outputs = (
        *MOTION_OUTPUTS,
        output_signal("disturbance", "m/s2", "Estimated acceleration that the model does not know, forward > 0"),
        INNOVATION_OUTPUT,
        discrete_output("balises", "1", "Number of balises used so far"),
        discrete_output("residual", "m/s", "Odometer minus estimate at the last sample"),
        discrete_output("residual_level", "m/s", "Its magnitude as the detector judges it"),
        discrete_output("odometer_fault", "1", "1 while a jam is detected"),
        discrete_output("recovering", "1", "1 while the end of a jam is awaited"),
        warning_output(
            "held_odometer",
            "1 once the odometer was seen to be held: not for this observer",
            "the odometer stands still and then jumps: held data look like a fault at every sample. Give it one "
            "that is new at every sample_period, by a step that is no longer, or use quasi_lpv_uio",
            ("speed", "residual"),
        ),
    )
    parameters = (
        parameter("mass", "kg", 1.0, "Train mass; 1 for numbers per unit mass", min=1e-6),
        parameter("davis_b", "N.s/m", 0.1, "Running resistance, linear term", min=0.0),
        parameter("brake_coefficient", "1", 0.1, "Force per effort, b", min=1e-9),
        parameter("observer_gain", "1", PRINTED_GAIN, "K in 1/s, 1/s2, 1/s3: poles -50, -50, -1.5", size=3),
        *THRESHOLD_PARAMETERS,
        parameter(
            "switches_effort", "1", 1.0, "1: the effort counts as zero while a jam is detected", min=0.0, max=1.0
        ),
        parameter("min_speed", "m/s", 0.2, "Speed below which nothing is judged", min=0.0, display_unit="km/h"),
        parameter("sample_period", "s", 1e-3, "Time between two innovations", min=1e-5, max=2e-3),
    )
    events = (
        PeriodicEvent(
            "odometer_sample",
            "sample_period",
            description="The odometer is compared with the estimate",
            samples=("odometer",),
        ),
        BALISE,
    )
    presets = {
        "repaired": {**_PRINTED_START, "disturbance_rate": 0.337},
        "as_published": {**_PRINTED_START, "longest_fault": NEVER, "min_speed": 0.0},
    }
    default_preset = "repaired"

    def requirements(self, p: Any) -> dict[str, Array]:
        """Order of the thresholds, and a sampling that can be called quasi-continuous."""
        return super().requirements(p) | threshold_requirements(p)

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        innovation = x.held_innovation
        effort = u.effort * (1.0 - x.detected_fault * p.switches_effort)
        acceleration = (p.brake_coefficient * effort - p.davis_b * x.estimated_speed) / p.mass + x.disturbance_estimate
        return {
            "estimated_position": x.estimated_speed,
            "estimated_speed": acceleration + p.observer_gain[0] * innovation,
            "disturbance_estimate": x.disturbance_rate + p.observer_gain[1] * innovation,
            "disturbance_rate": p.observer_gain[2] * innovation,
        }

    def update(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """A sample: innovation, verdict, and whether the odometer is held; a balise: its position."""
        if event == BALISE.name:
            return {
                "estimated_position": u.balise_position,
                "last_innovation": x.estimated_position - u.balise_position,
                "balises_used": x.balises_used + 1.0,
            }
        innovation = u.odometer - x.estimated_speed
        evaluated = evaluate(x, innovation, p.sample_period, p)
        moves = np.maximum(u.odometer, x.estimated_speed) >= p.min_speed
        jump = np.abs(u.odometer - x.last_reading)
        # One sample without a change is enough: a jump after it looks like a fault as soon as it is as large as one.
        stood = np.where(x.unchanged_time > 0.5 * p.sample_period, np.where(jump > p.threshold_start, 1.0, 0.0), 0.0)
        return {
            "held_innovation": innovation,
            **{name: np.where(moves, new, getattr(x, name)) for name, new in evaluated.items()},
            "last_reading": u.odometer,
            "unchanged_time": np.where(jump > 0.0, 0.0, x.unchanged_time + p.sample_period),
            "held_seen": np.maximum(x.held_seen, stood),
        }

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return {
            "position": x.estimated_position,
            "speed": x.estimated_speed,
            "disturbance": x.disturbance_estimate,
            "innovation": x.last_innovation,
            "balises": x.balises_used,
            "residual": x.held_innovation,
            "residual_level": x.filtered_residual,
            "odometer_fault": x.detected_fault,
            "recovering": x.detected_fault * x.armed,
            "held_odometer": x.held_seen,
        }

    def gap_finding(self, gap: float, p: Any) -> Finding:
        """Certificate of the error of speed, disturbance and its rate, exact for an innovation held between samples.

        Args:
            gap: longest gap between two balises [s]; they end the position error and act on nothing else.
        """
        period = float(p.sample_period)
        transition = sampled_error(float(p.davis_b) / float(p.mass), np.asarray(p.observer_gain, dtype=float), period)
        radius = float(np.abs(np.linalg.eigvals(transition)).max())
        stable = radius < 1.0
        margin = -inf
        rows: tuple[tuple[float, ...], ...] = ()
        if stable:
            rate = np.diag([1.0, 1.0 / 50.0, 1.0 / 2500.0])  # the disturbances in units of the speed
            scaled = rate @ transition @ np.linalg.inv(rate)
            form = scipy.linalg.solve_discrete_lyapunov(scaled.T, np.eye(3))
            margin = float(np.linalg.eigvalsh(form - scaled.T @ form @ scaled).min() / np.linalg.eigvalsh(form).max())
            rows = rows_of(rate @ form @ rate)
        return gap_finding(
            gap,
            inf,
            constant_limit=inf if stable else 0.0,
            mixed_limit=inf if margin > 0.0 else 0.0,
            growth=radius ** (gap / period),
            decrease=margin,
            holds=margin > 0.0,
            error_model=(
                f"error of speed, disturbance and its rate with the innovation held for {period:g} s; a balise ends "
                f"the position error and acts on nothing else. Detected jams and standstill are left out"
            ),
            remarks=(f"in the long run the error falls as exp(-{-log(radius) / period:.4g} t)",) if stable else (),
            matrix=rows,
        )

    def deciding_parameters(self) -> tuple[Signal, ...]:
        """Gain, drag, mass and sampling."""
        deciding = ("observer_gain", "davis_b", "mass", "sample_period")
        return tuple(s for s in self.parameter_signals if s.name in deciding)


def observer_matrix(drag_rate: float) -> np.ndarray:
    """A_o of (3.15), ``z = (v, d, d')``, shape (3, 3).

    Args:
        drag_rate: w_1 [1/s].
    """
    return np.array([[-drag_rate, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]])


def sampled_error(drag_rate: float, gain: np.ndarray, period: float) -> np.ndarray:
    """Error of ``(v, d, d')`` from sample to sample with a held innovation, shape (3, 3).

    ``exp(A_o T) - (integral of exp(A_o s) ds from 0 to T) K C``.

    Args:
        drag_rate: w_1 [1/s]. gain: K, shape (3,). period: T [s].
    """
    generator = np.zeros((4, 4))
    generator[:3, :3], generator[:3, 3] = observer_matrix(drag_rate), gain
    moved = np.asarray(scipy.linalg.expm(generator * period))
    return moved[:3, :3] - np.outer(moved[:3, 3], [1.0, 0.0, 0.0])
