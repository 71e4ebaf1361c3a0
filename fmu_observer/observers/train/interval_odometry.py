"""A set-valued observer: where the front end and the speed are for certain, within stated limits of everything."""

from __future__ import annotations

from math import inf
from typing import Any, Literal

import numpy as np

from fmu_observer.certificates.finding import Finding
from fmu_observer.certificates.gap_findings import gap_finding
from fmu_observer.detection.jam_detector import ODOMETER_SAMPLE
from fmu_observer.formulas.intervals import (
    Interval,
    chosen,
    intersection_or_hull,
    meet,
    possible_accelerations,
    relaxed_intersection,
    transmitted_effort,
    true_speeds,
)
from fmu_observer.observers.evaluated_observer import GapCertified
from fmu_observer.observers.gated_observer import GatedObserver
from fmu_observer.observers.innovation_gate import OFF
from fmu_observer.observers.train.standstill import ROLLS_BACK, rolls_back
from fmu_observer.observers.train.train_signals import (
    BALISE,
    INNOVATION_OUTPUT,
    LAST_INNOVATION,
    MOTION_OUTPUTS,
    ODOMETER,
    POSITION,
    TRAIN_PARAMETERS,
)
from plant_models.hybrid import (
    Array,
    discrete_output,
    input_signal,
    memory,
    output_signal,
    parameter,
    state,
    warning_output,
)
from plant_models.hybrid.option import require_chosen
from plant_models.hybrid.signal import within_bounds

WINDOW, HIDDEN = 12, 2
"""Readings that are kept, and how many of them may be lies that look possible."""
ODOMETER_BROKE, GROUP_BROKE = 1.0, 2.0
"""Values of the output `broken`, 0 for none: the assumption that was found broken last."""
_MARGIN = 1e-6
"""Added to the rates of all ends [m/s, m/s2]: far more than an internal step of 10 ms errs on these equations."""


class IntervalOdometry(GatedObserver, GapCertified):
    """Intervals of front end and speed that hold for every disturbance within stated limits [ours].

    **Between readings** each end of the speed moves with the least or greatest acceleration that is possible (Müller's
    theorem): mass, running resistance and gradient within their errors, of the effort any part from nothing (the wheels
    slip) to all of it. The ends of the position move with those of the speed. Brakes and resistance stop a train and do
    not push it back.

    **A reading** of the odometer means speeds of a width that follows from `wheel_error`, `creep` (by the sign of the
    effort) and `odometer_error`. It is *possible* where they meet the interval and those of the reading before, carried
    on by the accelerations. A lie that is just beginning or ending may be possible by accident. So the last 12 readings
    are kept, and what all possible ones but 2 of them have in common, carried on to now, is what the speed is cut with
    (the q-relaxed intersection, Jaulin 2009). Of lies is assumed that no more than 2 of 12 readings look possible and
    lie, and that they last `longest_lie` at most. A wheel that slides for seconds at a speed that creep would explain
    breaks this. A train stands whose readings have all been within `standstill_reading`, where that is possible.

    **A group** means places within its location accuracy and `map_error`; the intersection of both is what is left.

    Where an intersection is empty an assumption is broken, and it is not known which: the interval goes on with all
    that lies in or between both, and `broken` says where: 1 the odometer (nothing was believed for `longest_lie`), 2 a
    group.

    Args:
        effort: ``known``, the input `effort` is what is demanded of the wheels; ``unknown``, it lies between
            `brake_max` and `traction_max`, and creep may have either sign.

    Raises:
        ValueError: another word for `effort`.
    """

    name = "interval_odometry"
    description = "Intervals of position and speed that hold within stated limits"
    source = "ours, with Müller 1927 for the ends and Jaulin 2009 for lies; compare Goffaux, Remy and Vande Wouwer 2013"
    internal_step = 1e-2
    gate_start = OFF
    weighing = "itself"
    states = (
        POSITION,
        state("position_half", "m", 0.0, "Half-width of the position's interval"),
        state("speed_low", "m/s", 0.0, "Lower end of the speed"),
        state("speed_high", "m/s", 0.0, "Upper end of the speed"),
        state("least_change", "m/s", 0.0, "Least change of the speed since the start"),
        state("greatest_change", "m/s", 0.0, "Greatest change of the speed since the start"),
        LAST_INNOVATION,
        memory("readings_low", "m/s", 0.0, "Lower ends of the last readings, less the least change", size=WINDOW),
        memory("readings_high", "m/s", 0.0, "Upper ends, less the greatest change", size=WINDOW),
        memory("readings_possible", "1", 0.0, "1 where the reading was possible", size=WINDOW),
        memory("impossible_for", "s", 0.0, "Time without a reading that is possible"),
        memory("standing_for", "s", 0.0, "Time for which readings showed no motion"),
        memory("standing_place", "m", 0.0, "Position at the last reading"),
        memory("standing_half", "m", 0.0, "Half-width of its interval then"),
        memory("begun", "1", 0.0, "1 after the first reading"),
        memory("last_broken", "1", 0.0, "Assumption that was found broken last"),
        memory("times_broken", "1", 0.0, "How often one was"),
    )
    inputs = (
        input_signal("effort", "N", 0.0, "Applied effort at the wheel rim: traction positive, brake negative"),
        ODOMETER,
    )
    outputs = (
        *MOTION_OUTPUTS,
        output_signal("min_safe_front_end", "m", "Rearmost place where the front end can be"),
        output_signal("max_safe_front_end", "m", "Foremost place where the front end can be"),
        output_signal("min_speed", "m/s", "Least speed that is possible", display_unit="km/h"),
        output_signal("max_speed", "m/s", "Greatest speed that is possible", display_unit="km/h"),
        discrete_output("odometer_possible", "1", "1 where the last reading can be true"),
        warning_output(
            "broken",
            "Assumption found broken last: 0 none, 1 the odometer's, 2 a group's",
            "what is known of the train contradicts itself, so one of the stated limits is broken (1: of odometer or "
            "motion, 2: of a group or of the position before it); the interval went on with all that it might be",
            ("min_safe_front_end", "max_safe_front_end"),
        ),
        discrete_output("broken_count", "1", "How often one was found broken"),
        INNOVATION_OUTPUT,
        ROLLS_BACK,
    )
    parameters = (
        *TRAIN_PARAMETERS,
        parameter("odometer_period", "s", 0.2, "Time between two readings of the odometer", min=1e-4),
        parameter("mass_error", "1", 0.03, "Largest error of the mass, as a share", min=0.0, max=0.9),
        parameter("effort_error", "1", 0.03, "Largest error of the effort, as a share", min=0.0),
        parameter(
            "resistance_error", "1", 0.2, "Largest error of the running resistance, as a share", min=0.0, max=1.0
        ),
        parameter("gradient_max", "1", 0.005, "Steepest gradient, either way", min=0.0),
        parameter("wheel_error", "1", 0.01, "Largest error of the wheel's radius, as a share", min=0.0, max=0.5),
        parameter("creep", "1", 0.01, "Largest creep of a wheel that does not slip", min=0.0, max=0.5),
        parameter("odometer_error", "m/s", 0.05, "Largest noise and quantisation of a reading", min=0.0),
        parameter("standstill_reading", "m/s", 0.0, "A train stands that reads no more for 12 readings", min=0.0),
        parameter("longest_lie", "s", 10.0, "Longest time for which a lie lasts", min=0.0),
        parameter("default_accuracy", "m", 1.0, "Location accuracy of a group that tells none", min=0.0),
        parameter("map_error", "m", 0.0, "Largest error of the map", min=0.0),
        parameter("start_position_error", "m", 0.0, "Largest position error at the start", min=0.0),
        parameter("start_speed_error", "m/s", 50.0, "Largest speed at the start, either way", min=0.0),
        parameter("traction_max", "N", 4e5, "Largest traction where the effort is not known", min=0.0),
        parameter("brake_max", "N", 1.2e6, "Largest brake force where the effort is not known", min=0.0),
    )
    events = (BALISE, ODOMETER_SAMPLE)
    option_choices = {"effort": ("known", "unknown")}

    def __init__(self, effort: Literal["known", "unknown"] = "known") -> None:
        require_chosen(self.name, self.option_choices, effort=effort)
        self.effort = effort
        super().__init__(effort=effort)

    # -- between readings -------------------------------------------------------------------------------------------

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """Each end by the acceleration that carries it outwards."""
        force, (low, high) = self._force(u, p), _known_speeds(x)
        ends = possible_accelerations(low, high, force, p)
        # of what a reading becomes, whichever of the speeds is the true one
        fast, slow = possible_accelerations(high, high, force, p), possible_accelerations(low, low, force, p)
        speeds, begun = _speeds(x, p), x.begun
        return {
            POSITION.name: 0.5 * (speeds.low + speeds.high),
            "position_half": 0.5 * (speeds.high - speeds.low) + _MARGIN,
            "speed_low": begun * (ends.low - _MARGIN),
            "speed_high": begun * (ends.high + _MARGIN),
            "least_change": np.minimum(fast.low, slow.low) - _MARGIN,
            "greatest_change": np.maximum(fast.high, slow.high) + _MARGIN,
        }

    def _force(self, u: Any, p: Any) -> Interval:
        if self.effort == "known":
            return transmitted_effort(u.effort, p)
        return Interval(-p.brake_max, p.traction_max)

    # -- at readings and groups -------------------------------------------------------------------------------------

    def update(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return self._at_group(x, u, p) if event == BALISE.name else self._at_reading(x, u, p)

    def _at_group(self, x: Any, u: Any, p: Any) -> dict[str, Array]:
        told = u.balise_location_accuracy
        error = np.where(told > 0.0, told, p.default_accuracy) + p.map_error
        group = Interval(u.balise_position - error, u.balise_position + error)
        before = _places(x, p)
        after, broke = intersection_or_hull(before, group), 1.0 - meet(before, group)
        middle, half = 0.5 * (after.low + after.high), 0.5 * (after.high - after.low) - _start_error(x, p)
        return {
            POSITION.name: middle,
            "position_half": half,
            "standing_place": middle,
            "standing_half": half,
            "last_innovation": x.estimated_position - u.balise_position,
            **_broken(x, broke, GROUP_BROKE),
        }

    def _at_reading(self, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """The reading joins those that are kept; what they have in common cuts the speed."""
        means, speeds = true_speeds(u.odometer, self._force(u, p), p), _speeds(x, p)
        last = Interval(x.readings_low[-1] + x.least_change, x.readings_high[-1] + x.greatest_change)
        possible = meet(means, speeds) * np.maximum(meet(means, last), 1.0 - x.begun)
        lows = np.hstack([x.readings_low[1:], means.low - x.least_change])
        highs = np.hstack([x.readings_high[1:], means.high - x.greatest_change])
        flags = np.hstack([x.readings_possible[1:], possible])
        carried = Interval(lows + x.least_change, highs + x.greatest_change)
        common = relaxed_intersection(carried, flags, HIDDEN)
        believed = meet(common, common) * meet(common, speeds)
        waited = np.where(possible * believed > 0.0, 0.0, x.impossible_for + p.odometer_period)
        broke = np.where(waited > p.longest_lie, 1.0, 0.0)
        cut = chosen(believed, intersection_or_hull(speeds, common), speeds)
        found = chosen(broke, intersection_or_hull(cut, means), cut)
        standing = np.where(
            np.abs(u.odometer) <= p.standstill_reading, possible * (x.standing_for + p.odometer_period), 0.0
        )
        stays = np.where(standing > (WINDOW - 0.5) * p.odometer_period, 1.0, 0.0)
        after = chosen(stays, Interval(0.0, 0.0), found)
        stood = stays * _stands(x, p)  # since the reading before, so that nothing of the way between is true
        place = np.where(stood > 0.0, x.standing_place, x.estimated_position)
        half = np.where(stood > 0.0, x.standing_half, x.position_half + (1.0 - x.begun) * p.start_position_error)
        return {
            "speed_low": after.low,
            "speed_high": after.high,
            "readings_low": lows,
            "readings_high": highs,
            "readings_possible": flags,
            "impossible_for": np.where(broke > 0.0, 0.0, waited),
            POSITION.name: place,
            "position_half": half,
            "standing_place": place,
            "standing_half": half,
            "standing_for": standing,
            "begun": 1.0,
            **_broken(x, broke, ODOMETER_BROKE),
        }

    # -- what is known of it ----------------------------------------------------------------------------------------

    def gap_finding(self, gap: float, p: Any) -> Finding:
        """The interval holds for every gap; how wide it becomes in one is what it says."""
        model = "the interval holds whatever the gap; its width grows in a gap, and each group sets it anew"
        return gap_finding(gap, inf, inf, inf, growth=0.0, decrease=1.0, holds=True, error_model=model)

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """Middles and ends."""
        places, speeds = _places(x, p), _speeds(x, p)
        return {
            "position": x.estimated_position,
            "speed": 0.5 * (speeds.low + speeds.high),
            "min_safe_front_end": places.low,
            "max_safe_front_end": places.high,
            "min_speed": speeds.low,
            "max_speed": speeds.high,
            "odometer_possible": x.readings_possible[-1],
            "broken": x.last_broken,
            "broken_count": x.times_broken,
            "innovation": x.last_innovation,
            "rolls_back": rolls_back(u.odometer),
        }

    def requirements(self, p: Any) -> dict[str, Array]:
        """Bounds of the limits."""
        return super().requirements(p) | within_bounds(self.parameters, p)


def _start_error(x: Any, p: Any) -> Array:
    """Of the position, until the first reading takes it into the half-width [m]."""
    return np.where(x.begun > 0.0, 0.0, p.start_position_error)


def _places(x: Any, p: Any) -> Interval:
    half = x.position_half + _start_error(x, p)
    return Interval(x.estimated_position - half, x.estimated_position + half)


def _speeds(x: Any, p: Any) -> Interval:
    """Possible ones; before the first reading all that are stated for the start [m/s]."""
    return chosen(x.begun, _known_speeds(x), Interval(-p.start_speed_error, p.start_speed_error))


def _known_speeds(x: Any) -> Interval:
    """Possible ones [m/s]. A train that was stopped is not driven backwards by the rounding of its stop, unless its
    odometer says that it rolls back.
    """
    return Interval(x.speed_low, np.maximum(x.speed_high, np.minimum(x.readings_high[-1] + x.greatest_change, 0.0)))


def _stands(x: Any, p: Any) -> Array:
    """1 where all readings that are kept show no motion, and standstill is possible."""
    known = x.standing_for > (WINDOW - 0.5) * p.odometer_period
    return np.where(known, 1.0, 0.0)


def _broken(x: Any, broke: Array, which: float) -> dict[str, Array]:
    """What is remembered of an assumption that was found broken."""
    return {"last_broken": np.where(broke > 0.0, which, x.last_broken), "times_broken": x.times_broken + broke}
