"""From residuals to fault codes: alarms, the table of isolation, and whether wheel or sensor is at fault. Pure
functions that trace.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from fmu_observer.detection.train_isolation import (
    BRAKE,
    FAULTS,
    LOSS,
    MOTION,
    MOVED_SOURCES,
    RESIDUALS,
    SENSOR,
    STUCK,
    SUSPECTED,
    TRACTION,
    WHEEL,
)
from fmu_observer.detection.train_residuals import Readings, tolerance
from fmu_observer.formulas.diagnosis.isolation_table import IsolationTable, IsolationVerdict, largest
from fmu_observer.formulas.diagnosis.window_inversion import Alarm, evaluate
from plant_models.hybrid import Array, vector

_GROUPS = (MOTION, BRAKE, TRACTION)
_UNPROVED = 3.0  # telegrams
_OF_ODOMETER = (
    ("odometers", "odometer_1_radar", "odometer_1_gps"),
    ("odometers", "odometer_2_radar", "odometer_2_gps"),
)


class _Availability(NamedTuple):
    """Which residuals and which faults there can be, 1 or 0, in the order of `RESIDUALS` and `FAULTS`.

    Attributes:
        residuals: one for each. faults: one for each. apart: by residual and fault, 1 where the residual was made
            without what the fault moves.
    """

    residuals: list[Array]
    faults: list[Array]
    apart: dict[str, dict[str, Array]]


class _Wheels(NamedTuple):
    """What a wheel may do.

    Attributes:
        slow: 1 while it may turn too slowly, else 0. fast: 1 while it may turn too fast, else 0.
    """

    slow: Array
    fast: Array


def availability(read: Readings, gps_full: Array, telegrams: Array, disagree: Array) -> _Availability:
    """Which residuals can be computed, what can fail, and which residuals were made without it.

    Args:
        read: of the sensors. gps_full: 1 where the window of satellite positions is full. telegrams: balises so far.
        disagree: 1 for each source of speed whose way the last balise contradicts, shape (3,).
    """
    first, second, radar = read.fitted
    gps, some, two = gps_full, np.where(telegrams > 0.5, 1.0, 0.0), np.where(telegrams > 1.5, 1.0, 0.0)
    source = largest([first, second, radar])
    motion = [
        first * second,
        first * radar,
        second * radar,
        first * gps,
        second * gps,
        radar * gps,
        gps * some,
        first * two * largest([second, radar]),
        second * two,
        radar * two,
        source * two,
    ]
    faults = [first, second, radar, read.has_gps, some, first]
    brake = [read.has_pressure, read.has_pressure * source, source]
    apart = {
        residual: {
            fault: largest([used for k, used in enumerate(asked) if k not in moved])
            for fault, moved in MOVED_SOURCES.items()
        }
        for residual, asked in (("gps_position", read.fitted), ("balise", disagree))
    }
    # A first balise that is false misplaces the train until two others have said so.
    apart["gps_position"]["balise"] = np.where(telegrams > _UNPROVED + 0.5, 1.0, 0.0)
    return _Availability([*motion, *brake, source], [*faults, read.has_pressure, source, source, source], apart)


def alarms_after(x: Any, t: Array, ratios: Sequence[Array], p: Any) -> dict[str, Array]:
    """Raise and clear the alarms of a sample; those of balises and shares follow at once.

    Args:
        ratios: of all residuals.

    Returns:
        New values of states by name.
    """
    alarms: list[Alarm] = []
    for name, ratio, *before in zip(RESIDUALS, ratios, x.raised, x.contrary, x.since, strict=True):
        slow = name.startswith(("odometer", "radar", "gps", "pressure"))
        exceeds = np.where(ratio > 1.0, 1.0, 0.0)
        counts = (p.raise_samples, p.clear_samples) if slow else (1.0, 1.0)
        alarms.append(evaluate(Alarm(*before), t, exceeds, *counts))
    after = zip(Alarm._fields, zip(*alarms, strict=True), strict=True)
    return {"ratio": vector(*ratios), **{name: vector(*values) for name, values in after}}


def wheels(x: Any, u: Any, brake_force: Array, p: Any) -> tuple[_Wheels, dict[str, Array]]:
    """Whether an effort acts, or acted until `release_time` ago, that can jam or spin a wheel.

    Args:
        brake_force: of the whole train [N].

    Returns:
        What a wheel may do, and new values of states by name.
    """
    pulls = np.where(u.effort > p.slip_effort, 1.0, 0.0)
    brakes = np.where(np.maximum(-u.effort, brake_force) > p.slip_effort, 1.0, 0.0)
    since_pull = np.where(pulls > 0.0, 0.0, x.since_pull + p.sample_period)
    since_brake = np.where(brakes > 0.0, 0.0, x.since_brake + p.sample_period)
    slow, fast = (np.where(since <= p.release_time, 1.0, 0.0) for since in (since_brake, since_pull))
    return _Wheels(slow, fast), {"since_pull": since_pull, "since_brake": since_brake}


def contradicted_wheels(x: Any, read: Readings, wheel: _Wheels, p: Any) -> tuple[list[Array], dict[str, Array]]:
    """For each odometer 1 where it is off for so long that no wheel explains it: the sensor is at fault.

    Args:
        read: of the sensors. wheel: what wheels may do.

    Returns:
        One for each, and new values of states by name.
    """
    times, wrong = [], []
    raised = dict(zip(RESIDUALS, x.raised, strict=True))
    for k, before in enumerate(x.against_wheel):
        ahead = read.speeds[k] - x.voted_speed
        may_be: Array = np.where(ahead < 0.0, wheel.slow, wheel.fast)
        quick, way = largest([raised[name] for name in _OF_ODOMETER[k]]), raised[f"way_{k + 1}"]
        off = np.where(np.maximum(quick, way) > 0.0, read.fitted[k], 0.0)
        now: Array = np.where(np.abs(ahead) > tolerance(x.voted_speed, p), 1.0 - may_be, 0.0)
        # Once a wheel cannot explain it the verdict stays until the alarm ends: the same fault goes on under effort.
        known = np.where(before >= p.contrary_time - 1e-9, p.contrary_time, before + p.sample_period * now)
        # What only a way between balises shows is small and lasts: a scale, no slip.
        small = np.where(quick > 0.0, 0.0, np.where(x.code[k] > 0.0, 0.0, way))
        known = np.where(small > 0.0, p.contrary_time, known)
        times.append(np.where(off > 0.0, known, 0.0))
        wrong.append(np.where(times[k] >= p.contrary_time - 1e-9, 1.0, 0.0))
    return wrong, {"against_wheel": vector(*times)}


def stuck_sensors(x: Any, read: Readings, wheel: _Wheels, p: Any) -> tuple[list[Array], dict[str, Array]]:
    """For odometers, radar, satellites and pressure 1 where a reading has not changed although it should have.

    A wheel that is locked reads zero: that is no sensor that stands still while the brake may lock it.

    Args:
        read: of the sensors. wheel: what wheels may do.

    Returns:
        One for each, and new values of states by name.
    """
    values = [*read.speeds, read.gps, read.pressure]
    believed = [x.voted_speed] * 3 + [x.estimated_position, x.modelled_pressure]
    limits = [p.stuck_speed] * 3 + [p.stuck_way, p.stuck_pressure]
    fitted = [*read.fitted, read.has_gps, read.has_pressure]
    then, stuck = [], []
    last = zip(values, x.last_reading, x.then, believed, limits, fitted, strict=True)
    for k, (value, before, reference, now, limit, there) in enumerate(last):
        unchanged = np.where(value == before, there, 0.0)
        then.append(np.where(unchanged > 0.0, reference, now))
        locked = np.where(np.abs(value) < p.least_speed, wheel.slow, 0.0) if k < 2 else 0.0
        stuck.append(np.where(np.abs(now - then[k]) > limit, unchanged * (1.0 - locked), 0.0))
    return stuck, {"last_reading": vector(*values), "then": vector(*then)}


def codes_after(
    x: Any, t: Array, can: _Availability, wrong: list[Array], stuck: list[Array], before: Array, p: Any
) -> dict[str, Array]:
    """Fault codes, instant of the detection, confidence.

    Until `isolation_delay` after the first alarm of a group a fault is suspected only: residuals are not equally quick.
    Nor are they to clear: an isolated fault is kept while alarms only go. It is kept, too, where further alarms come
    beside its own that it does not explain: there are several. Wheels that turn against what the efforts can do are no
    slip of all wheels.

    Args:
        can: what there can be. wrong: odometers that no wheel explains.
        stuck: sensors that stand still. before: alarms of the sample before.

    Returns:
        New values of states by name.
    """
    found = _verdicts(x, t, can, wrong, before, p)
    codes = _with_stuck([code for verdict in found for code in verdict.codes], stuck)
    newest = x.detected_at
    for old, verdict in zip(x.group_since, found, strict=True):
        newest = np.where(verdict.since >= 0.0, np.where(old < 0.0, verdict.since, newest), newest)
    return {
        "faulty": _faulty_speeds(x, codes),
        "code": vector(*codes),
        "group_since": vector(*(verdict.since for verdict in found)),
        "several": largest([verdict.several for verdict in found]),
        "trust": _confidence(x, found),
        "detected_at": newest,
    }


def _with_stuck(codes: list[Array], stuck: list[Array]) -> list[Array]:
    """The codes, with those of sensors that stand still."""
    for fault, still in zip(("odometer_1", "odometer_2", "radar", "gps", "pressure_sensor"), stuck, strict=True):
        k = FAULTS.index(fault)
        codes[k] = np.where(still > 0.0, STUCK, codes[k])
    return codes


class _GroupVerdict(NamedTuple):
    """What follows for a group of faults.

    Attributes:
        codes: of its faults. named: 1 for each that is isolated or suspected. margins: of their weakest alarm.
        seen: 1 for each whose residual is above its threshold. since: when its alarms began [s], -1 without any.
        several: 1 where no single fault explains them.
    """

    codes: list[Array]
    named: list[Array]
    margins: list[Array]
    seen: list[Array]
    since: Array
    several: Array


def _verdicts(x: Any, t: Array, can: _Availability, wrong: list[Array], before: Array, p: Any) -> list[_GroupVerdict]:
    """What follows for each group, see `codes_after`."""
    there = dict(zip(FAULTS, can.faults, strict=True))
    there["adhesion"] = there["adhesion"] * (1.0 - largest(wrong))
    found: list[_GroupVerdict] = []
    place = first = 0
    for group, since in zip(_GROUPS, x.group_since, strict=True):
        places = slice(place, place + len(group.residuals)), slice(first, first + len(group.faults))
        possible = [there[fault] for fault in group.faults]
        found.append(_group_verdict(group, x, t, can, places, possible, since, wrong, before, p))
        place, first = places[0].stop, places[1].stop
    return found


def _group_verdict(
    group: IsolationTable,
    x: Any,
    t: Array,
    can: _Availability,
    places: tuple[slice, slice],
    possible: list[Array],
    since: Array,
    wrong: list[Array],
    before: Array,
    p: Any,
) -> _GroupVerdict:
    """The verdict of a group; `places` are those of its residuals and of its faults among all."""
    own, faults = places
    raised, available = x.raised[own], can.residuals[own]
    any_alarm = largest([a * b for a, b in zip(raised, available, strict=True)])
    start = np.where(any_alarm > 0.0, np.where(since < 0.0, t, since), -1.0)
    evaluated = group.evaluate(raised, available, possible, can.apart)
    sure = np.where(t - start >= p.isolation_delay - 1e-9, 1.0, 0.0)
    fresh = largest([now * (1.0 - old) for now, old in zip(raised, before[own], strict=True)])
    stays, several = _stays(group, x.code[faults], evaluated, raised, possible, fresh)
    kept = largest(stays)
    found = _GroupVerdict([], [], [], [], start, several)
    for fault, isolated, suspected, stay in zip(
        group.faults, evaluated.isolated, evaluated.suspected, stays, strict=True
    ):
        certain = np.where(kept > 0.0, stay, isolated * sure)
        maybe = (1.0 - kept) * (suspected + isolated * (1.0 - sure))
        margin, seen = _margin(group, fault, x.ratio[own], available)
        found.codes.append(certain * _isolated_code(fault, wrong) + SUSPECTED * maybe)
        found.named.append(certain + maybe)
        found.margins.append(margin)
        found.seen.append(seen)
    return found


def _confidence(x: Any, found: list[_GroupVerdict]) -> Array:
    """Mean margin of the faults that are named; while an alarm outlasts its residual the last that a residual gave."""
    rows = [row for verdict in found for row in zip(verdict.named, verdict.seen, verdict.margins, strict=True)]
    seen = sum((named * above for named, above, _ in rows), 0.0)
    trusts = sum((named * above * margin for named, above, margin in rows), 0.0)
    trust = np.where(seen > 0.5, trusts / np.maximum(seen, 1.0), x.trust)
    return np.where(largest([named for named, *_ in rows]) > 0.5, trust, 0.0)


def _faulty_speeds(x: Any, codes: list[Array]) -> Array:
    """1 for odometers and radar that were at fault since the last balise, shape (3,)."""
    slips = codes[FAULTS.index("adhesion")]
    bad = [np.maximum(codes[0], slips), np.maximum(codes[1], slips), codes[2]]
    return vector(*(np.maximum(old, np.where(now > 0.0, 1.0, 0.0)) for old, now in zip(x.faulty, bad, strict=True)))


def _stays(
    group: IsolationTable, known: Array, evaluated: IsolationVerdict, alarms: Array, possible: list[Array], fresh: Array
) -> tuple[list[Array], Array]:
    """For each fault 1 where it was isolated and stays so: alarms only go, or others come beside its own, which it does
    not explain; and 1 where there are several: no single fault explains the alarms, or not the one that is isolated.
    """
    by_name = dict(zip(group.residuals, alarms, strict=True))
    stays, several = [], evaluated.unexplained
    for fault, code, cover, there in zip(group.faults, known, evaluated.covers, possible, strict=True):
        on = np.where(code >= WHEEL, there, 0.0)
        beside = on * (1.0 - cover) * largest([by_name[residual] for residual in group.must[fault]])
        stays.append(np.maximum(on * cover * (1.0 - fresh), beside))
        several = np.maximum(several, beside)
    return stays, several


def _isolated_code(fault: str, wrong: list[Array]) -> Array:
    """Code of an isolated fault: of an odometer the wheel unless it is contradicted."""
    if fault.startswith("odometer"):
        return np.where(wrong[int(fault[-1]) - 1] > 0.0, SENSOR, WHEEL)
    if fault == "adhesion":
        return WHEEL
    return LOSS if fault in ("cylinder", "friction", "traction") else SENSOR


def _margin(group: IsolationTable, fault: str, ratios: Array, available: list[Array]) -> tuple[Array, Array]:
    """1 - threshold / residual of the weakest alarm of a fault, and 1 where there is one above its threshold"""
    margin: Array = 1.0
    seen: Array = 0.0
    moved = {*group.must[fault], *group.may.get(fault, ())}
    for name, ratio, there in zip(group.residuals, ratios, available, strict=True):
        if name in moved:
            above = np.where(there * ratio > 1.0, 1.0, 0.0)
            margin = np.minimum(margin, np.where(above > 0.0, 1.0 - 1.0 / np.maximum(ratio, 1.0), 1.0))
            seen = np.maximum(seen, above)
    return margin, seen
