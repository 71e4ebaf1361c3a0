"""The odometry of an ETCS on-board: the position since the last balise group, and where the front end can be."""

from __future__ import annotations

from math import inf
from typing import Any

import numpy as np

from fmu_observer.certificates.finding import Finding
from fmu_observer.certificates.gap_findings import gap_finding
from fmu_observer.formulas.train_position import allowed_speed_error, reading_amount, safe_front_end
from fmu_observer.observers.evaluated_observer import GapCertified
from fmu_observer.observers.gated_observer import GatedObserver
from fmu_observer.observers.innovation_gate import WARN
from fmu_observer.observers.train.train_signals import (
    BALISE,
    INNOVATION_OUTPUT,
    LAST_INNOVATION,
    MOTION_OUTPUTS,
    ODOMETER,
    POSITION,
)
from plant_models.hybrid import Array, input_signal, memory, output_signal, parameter, state
from plant_models.hybrid.signal import within_bounds


class EtcsOdometry(GatedObserver, GapCertified):
    """Position relative to the last balise group with its confidence interval: SUBSET-026, 3.6.4.1.

    ``d d_est = y``, ``d s = |y|``: the estimated front end and the distance travelled since the reference group. At a
    group ``d_est`` is its position plus `antenna_offset`, s begins at zero, and Q is its location accuracy.

    1. ``over = over_fixed + over_share s + w``, likewise ``under``; min safe front end ``d_est - (Q + over)``, max safe
       front end ``d_est + (Q + under)``. Preset ``subset_041``: 5 m + 5 %, the detection of the group in the 5 m.
    2. What the odometer cannot have counted, w, grows by `least_speed` while it reads no more than that, and by
       `suspected_speed_error` while `slip_suspected` is 1 [both ours, zero in the presets].
    3. A group of which no accuracy is told has the national value. Before the first group Q is `start_position_error`.
    4. The speed lies within what SUBSET-041 allows, plus what 2. adds.

    The front end lies between both ends as long as the odometer keeps its amounts and the group lies within Q of where
    it is said to be. Nothing is known of linking: every group is taken, one that its gate doubts too, which is counted.
    """

    name = "etcs_odometry"
    description = "Position since the last balise group, min and max safe front end as ETCS has them"
    source = "SUBSET-026, 3.6.4.1 and 3.6.4.2; SUBSET-041"
    internal_step = 1e-2  # the flow is exact for a held input, whatever the step
    gate_start = WARN
    weighing = "itself"
    states = (
        POSITION,
        state("travelled", "m", 0.0, "Distance travelled since the reference group, either way"),
        state("unread", "m", 0.0, "Way since then that the odometer cannot have counted"),
        LAST_INNOVATION,
        memory("reference_position", "m", 0.0, "Position of the reference group"),
        memory("reference_accuracy", "m", 0.0, "Location accuracy of the reference group"),
        memory("located", "1", 0.0, "1 after the first group"),
    )
    inputs = (
        ODOMETER,
        input_signal("slip_suspected", "1", 0.0, "1 while a detector says that wheels slip or slide", optional=True),
    )
    outputs = (
        *MOTION_OUTPUTS,
        output_signal("min_safe_front_end", "m", "Rearmost place where the front end can be"),
        output_signal("max_safe_front_end", "m", "Foremost place where the front end can be"),
        output_signal("rear_end", "m", "Estimated rear end"),
        output_signal("min_safe_rear_end", "m", "Rearmost place where the rear end can be"),
        output_signal("over_reading_amount", "m", "What the odometer may have counted too much since the group"),
        output_signal("under_reading_amount", "m", "What the odometer may have counted too little since the group"),
        output_signal("allowed_speed_error", "m/s", "By how much the speed may be wrong, as SUBSET-041 allows"),
        output_signal("lrbg_position", "m", "Position of the reference group, the last relevant one"),
        output_signal("lrbg_distance", "m", "Distance travelled since the reference group, either way"),
        INNOVATION_OUTPUT,
    )
    parameters = (
        parameter("over_fixed", "m", 5.0, "Over-reading amount at the group", min=0.0),
        parameter("over_share", "1", 0.05, "Over-reading amount as a share of the distance since", min=0.0),
        parameter("under_fixed", "m", 5.0, "Under-reading amount at the group", min=0.0),
        parameter("under_share", "1", 0.05, "Under-reading amount as a share of the distance since", min=0.0),
        parameter("national_accuracy", "m", 12.0, "Location accuracy of a group that tells none", min=0.0, max=63.0),
        parameter("start_position_error", "m", 0.0, "Largest position error at the start", min=0.0),
        parameter("antenna_offset", "m", 0.0, "The antenna lies so far behind the front end"),
        parameter("train_length", "m", 0.0, "Estimated length of the train", min=0.0),
        parameter("safe_train_length", "m", 0.0, "Largest length of the train", min=0.0),
        parameter("least_speed", "m/s", 0.0, "Speed up to which the odometer may read zero", min=0.0),
        parameter("suspected_speed_error", "m/s", 0.0, "Error of the speed while slip is suspected", min=0.0),
    )
    events = (BALISE,)
    presets = {"subset_041": {}}
    default_preset = "subset_041"

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        speed = np.abs(u.odometer)
        return {POSITION.name: u.odometer, "travelled": speed, "unread": _unread_speed(u, p)}

    def update(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """The group is the reference from now on."""
        front = u.balise_position + p.antenna_offset
        told = u.balise_location_accuracy
        return {
            POSITION.name: front,
            "travelled": 0.0,
            "unread": 0.0,
            "last_innovation": x.estimated_position - front,
            "reference_position": u.balise_position,
            "reference_accuracy": np.where(told > 0.0, told, p.national_accuracy),
            "located": 1.0,
        }

    def gap_finding(self, gap: float, p: Any) -> Finding:
        """Nothing of an error is left behind a group, whatever the gap."""
        model = "error of the position, which each group sets; how far it grows in a gap is what the interval says"
        return gap_finding(gap, inf, inf, inf, growth=0.0, decrease=1.0, holds=True, error_model=model)

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """The estimate between both ends."""
        over, under = _amounts(x, p)
        front = safe_front_end(x.estimated_position, _location_accuracy(x, p), over, under)
        return {
            "position": x.estimated_position,
            "speed": u.odometer,
            "min_safe_front_end": front.low,
            "max_safe_front_end": front.high,
            "rear_end": x.estimated_position - p.train_length,
            "min_safe_rear_end": front.low - p.safe_train_length,
            "over_reading_amount": over,
            "under_reading_amount": under,
            "allowed_speed_error": allowed_speed_error(u.odometer) + _unread_speed(u, p),
            "lrbg_position": x.reference_position,
            "lrbg_distance": x.travelled,
            "innovation": x.last_innovation,
        }

    def requirements(self, p: Any) -> dict[str, Array]:
        """Bounds of the amounts, and that the train is no longer than it can be."""
        longest = "safe_train_length must not be below train_length"
        lengths = {longest: np.where(p.safe_train_length >= p.train_length, 1.0, 0.0)}
        return super().requirements(p) | within_bounds(self.parameters, p) | lengths


def _amounts(x: Any, p: Any) -> tuple[Array, Array]:
    """Over- and under-reading amount [m]."""
    return (
        reading_amount(p.over_fixed, p.over_share, x.travelled, x.unread),
        reading_amount(p.under_fixed, p.under_share, x.travelled, x.unread),
    )


def _location_accuracy(x: Any, p: Any) -> Array:
    """Of the reference, or of the start where there has been no group [m]."""
    return np.where(x.located > 0.0, x.reference_accuracy, p.start_position_error)


def _unread_speed(u: Any, p: Any) -> Array:
    """Speed that the odometer may miss now [m/s]."""
    creeping = np.where(np.abs(u.odometer) <= p.least_speed, p.least_speed, 0.0)
    return creeping + np.where(u.slip_suspected > 0.5, p.suspected_speed_error, 0.0)
