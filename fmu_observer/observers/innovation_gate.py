"""The gate of telegrams: whether a reported position can be true beside what the observer believes, and how much it
weighs. Pure functions, ours.

The limit of the innovation ``|estimate - reported|`` is

    ``gate_floor + location accuracy + g``, ``g = own error + gate_spread * recent``

`recent` is the largest innovation of late beyond its accuracy, halved at every telegram: the gate is open while an
observer converges. The own error follows from what is known. It is the bound that the observer carries (three standard
deviations of a covariance, or an error bound), and at least what the last telegram left and a share of the way since
then as the observer believes it, as the root of their squares. That share is `gate_creep` for wheels that roll, and
rises to `gate_drift` (what SUBSET-041 grants an odometer) where the odometer has changed its speed since the last
telegram by 0.3 m/s2 or more, for wheels creep as they pull and brake; it is ``gate_spread`` times the largest share
seen of late, halved at every telegram, where that lies between them and is larger. Nothing is doubted before
`gate_recover` telegrams in a row were within the limit, for an observer may start anywhere. The gate acts at
telegrams only, so it costs nothing between them.

Positions that were doubted may be right and the estimate wrong. So each is compared with the telegram before it. A
doubted one counts one; one more where the way between both is that of the odometer, by its mean of both ends, or that
of the estimate. The first in a row has only the odometer, and only where that does not agree with the estimate as well.
It counts half more where no more than the mean speeds of the last two ways agree: they differ by no more than a train
can cause that changes its speed by `gate_acceleration` at most. At `gate_recover` the position is taken, the estimate
restarts there, and the gate is open again until it has settled. True telegrams always agree in their speeds, whatever
odometer and estimate say: of ``2 gate_recover - 1`` in a row that follow a true one at least one is used.

A place within ``+-a`` has a standard deviation of ``a / sqrt(3)``: the rectangular distribution, JCGM 100:2008, 4.3.7.
A telegram with it weighs ``(g^2 + f^2) / (g^2 + max(f, a)^2)``, f `gate_floor`: the ratio of the gain of a Kalman
filter at this accuracy to that at the floor, g the half-width of the estimate's own error. So it is one where nothing
is reported, and never more.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from plant_models.hybrid import Array, memory, parameter
from plant_models.hybrid.arrays import indicator
from plant_models.hybrid.event import DOUBTED, IGNORED, USED

OFF, WARN, REJECT = 0.0, 1.0, 2.0
"""Values of the parameter `gate`: every telegram is used; doubted ones are used and counted; they are ignored and
counted.
"""

FORGETTING = 0.5  # of the recent innovation and share, at each telegram
_BY_SPEED = 0.5  # what counts that a doubted telegram agrees by the speeds of telegrams alone
_LEAST_TIME = 1e-3  # between two telegrams of which a speed is made [s]
_LEAST_SHARE = 1e-6  # in place of a drift of zero
PULLING = 0.3  # change of speed from which on wheels may creep by the whole drift [m/s2] [ours]
VERDICT = "gate_verdict"

GATE_PARAMETERS = (
    parameter(
        "gate",
        "1",
        REJECT,
        "Balises that cannot be true: 0 not looked for, 1 used and counted, 2 ignored",
        min=0.0,
        max=2.0,
    ),
    parameter("gate_floor", "m", 0.5, "Innovation that is never doubted", min=1e-3),
    parameter(
        "gate_drift", "1", 0.05, "Share of the way since the last balise granted, wheels that pull or brake", min=0.0
    ),
    parameter("gate_creep", "1", 0.01, "Likewise, wheels that roll: the least", min=0.0),
    parameter("gate_spread", "1", 3.0, "Error granted as a multiple of the largest recent innovation", min=0.0),
    parameter("gate_acceleration", "m/s2", 1.5, "Largest acceleration of the train, either way", min=0.0),
    parameter(
        "gate_recover",
        "1",
        2.0,
        "Balises within the limit until others are doubted, and doubted ones that agree until they are believed",
        min=1.0,
    ),
)
GATE_MEMORY = (
    memory(VERDICT, "1", 0.0, "Last balise: 0 used, 1 doubted and used, 2 doubted and ignored"),
    memory("gate_settled", "1", 0.0, "Balises in a row whose innovation was within the limit"),
    memory("gate_recent", "m", 0.0, "Largest recent innovation of a balise beyond its accuracy, halved at each"),
    memory("gate_share", "1", 0.0, "The same as a share of the way since the balise before, halved at each"),
    memory("gate_reference", "m", 0.0, "Position of the last balise that was used"),
    memory("gate_left", "m", 0.0, "Error that its accuracy left"),
    memory("gate_doubted", "1", 0.0, "Balises doubted in a row that agree with each other"),
    memory("gate_last_position", "m", 0.0, "Position of the last balise, used or not"),
    memory("gate_last_accuracy", "m", 0.0, "Its location accuracy"),
    memory("gate_last_innovation", "m", 0.0, "Its innovation"),
    memory("gate_last_time", "s", 0.0, "Its stamp"),
    memory("gate_last_odometer", "m/s", 0.0, "Odometer at it"),
    memory("gate_last_speed", "m/s", 0.0, "Mean speed between the last two balises"),
    memory("gate_last_slack", "m/s", 0.0, "By how much it may differ from the speed halfway"),
)


class GateMemory(NamedTuple):
    """What a gate remembers, in the order of `GATE_MEMORY`."""

    verdict: Array
    settled: Array
    recent: Array
    share: Array
    reference: Array
    left: Array
    doubted: Array
    last_position: Array
    last_accuracy: Array
    last_innovation: Array
    last_time: Array
    last_odometer: Array
    last_speed: Array
    last_slack: Array


class ReportedPlace(NamedTuple):
    """What is reported, and what is believed at its stamp.

    Args:
        position: reported [m]. accuracy: of the place of the balise, either way, zero where it is not known [m].
        estimate: believed position [m].
        bound: of the estimate's own error, where the observer has one [m]. odometer: reading [m/s]; None where there is
            none.
        t: stamp [s].
    """

    position: Array
    accuracy: Array
    estimate: Array
    bound: Array
    odometer: Array | None
    t: Array


class _GateVerdict(NamedTuple):
    """Args: used: 1 where the position is used, else 0. restart: 1 where the estimate restarts there. weight: of the
    innovation, 0 to 1. memory: afterwards.
    """

    used: Array
    restart: Array
    weight: Array
    memory: GateMemory


def known_accuracy(accuracy: Array) -> Array:
    """The location accuracy, zero where it is reported below zero or as no number [m].

    Args:
        accuracy: as reported [m].
    """
    return np.where(accuracy > 0.0, accuracy, 0.0)


def place_deviation(accuracy: Array, floor: Array) -> Array:
    """Standard deviation of the place of a balise, ``accuracy / sqrt(3)`` and not below a floor [m].

    Args:
        accuracy: half-width of where it lies [m]. floor: its deviation where nothing is reported [m].
    """
    return np.maximum(known_accuracy(accuracy) / np.sqrt(3.0), floor)


def gain_ratio(error: Array, place: Array, floor: Array) -> Array:
    """Gain of a Kalman filter for a place reported so well over that for one at the floor, 0 to 1.

    Args:
        error: of the estimate [m]. place: of the place as reported [m]. floor: of a place of which nothing is reported
            [m]; all three deviations, or all three half-widths.
    """
    known = error * error
    # where the place is no worse than the floor, both may be zero
    total = np.where(place > floor, known + place * place, 1.0)
    return np.where(place > floor, (known + floor * floor) / total, 1.0)


def _granted_error(before: GateMemory, report: ReportedPlace, p: Any) -> Array:
    """What is granted of the estimate's error, g [m].

    Args:
        before: memory of the gate before the telegram. report: the telegram and what the observer knows then.
    """
    drift = np.maximum(p.gate_drift, p.gate_creep)
    seen = np.clip(p.gate_spread * before.share, p.gate_creep, drift)
    share = np.maximum(seen, p.gate_creep + (drift - p.gate_creep) * _pulled(before, report))
    since = _root_of_squares(before.left, share * (report.estimate - before.reference))
    return np.maximum(report.bound, since) + p.gate_spread * before.recent


def _pulled(before: GateMemory, report: ReportedPlace) -> Array:
    """How hard the wheels have pulled or braked since the last telegram, 0 to 1; 1 where there is no odometer."""
    if report.odometer is None:
        return 1.0
    time = np.maximum(report.t - before.last_time, _LEAST_TIME)
    return np.minimum(np.abs(report.odometer - before.last_odometer) / (PULLING * time), 1.0)


def _gate_limit(before: GateMemory, report: ReportedPlace, p: Any) -> Array:
    """Innovation beyond which a position is doubted [m]."""
    return p.gate_floor + known_accuracy(report.accuracy) + _granted_error(before, report, p)


def evaluate(before: GateMemory, report: ReportedPlace, p: Any) -> _GateVerdict:
    """Whether a reported position is used, how much it weighs, and what the gate remembers of it.

    Args:
        before: memory at the telegram. report: telegram and belief. p: named tuple with `GATE_PARAMETERS`.
    """
    size, accuracy = np.abs(report.estimate - report.position), known_accuracy(report.accuracy)
    granted = _granted_error(before, report, p)
    settled = indicator(before.settled >= p.gate_recover)
    outside = indicator(size > _gate_limit(before, report, p))
    doubted = outside * settled * indicator(p.gate > OFF)
    refused = doubted * indicator(p.gate >= REJECT)
    row = _row(before, report, p)
    restart = refused * indicator(row[0] >= p.gate_recover)
    used = 1.0 - refused + restart
    # nothing is known of an estimate that has not settled, so nothing speaks against the telegram
    weight = np.where(settled * (1.0 - restart) > 0.0, gain_ratio(granted, accuracy, p.gate_floor), 1.0)
    beyond = np.maximum(size - accuracy, 0.0)
    share = beyond / (
        p.gate_floor / np.maximum(p.gate_drift, _LEAST_SHARE) + np.abs(report.estimate - before.reference)
    )
    after = GateMemory._make(
        (
            np.where(used > 0.0, np.where(doubted > 0.0, float(DOUBTED), float(USED)), float(IGNORED)),
            np.where(outside > 0.0, 0.0, before.settled + 1.0),
            np.maximum(beyond, FORGETTING * before.recent),
            np.maximum(share, FORGETTING * before.share),
            report.position,
            _root_of_squares((1.0 - weight) * granted, weight * accuracy),
            *row,
        )
    )
    kept = (np.where(used > 0.0, new, old) for new, old in zip(after[1:6], before[1:6], strict=True))
    still_doubted = np.where(used > 0.0, 0.0, after.doubted)
    return _GateVerdict(used, restart, weight, GateMemory._make((after.verdict, *kept, still_doubted, *after[7:])))


def _row(before: GateMemory, report: ReportedPlace, p: Any) -> tuple[Array, ...]:
    """How many doubted telegrams in a row agree, this one included, and what is remembered of it; one reported twice
    is one.
    """
    innovation, accuracy = report.estimate - report.position, known_accuracy(report.accuracy)
    spacing, passed = report.position - before.last_position, report.t - before.last_time
    places = p.gate_floor + accuracy + before.last_accuracy
    tolerance = places + p.gate_drift * np.abs(spacing)
    is_first = indicator(before.doubted <= 0.0)
    by_way = (1.0 - is_first) * indicator(np.abs(innovation - before.last_innovation) <= tolerance)
    if report.odometer is not None:
        beyond = spacing - 0.5 * (report.odometer + before.last_odometer) * passed
        # an odometer that agrees with both says nothing against the estimate
        against = indicator(np.abs(beyond + innovation - before.last_innovation) > tolerance)
        by_way = np.maximum(by_way, indicator(np.abs(beyond) <= tolerance) * np.maximum(against, 1.0 - is_first))
    time = np.maximum(passed, _LEAST_TIME)
    speed, slack = spacing / time, 0.5 * p.gate_acceleration * time + (p.gate_floor + places) / time
    by_speed = (1.0 - is_first) * indicator(np.abs(speed - before.last_speed) <= slack + before.last_slack)
    agreeing = np.maximum(by_way, _BY_SPEED * by_speed)
    count = np.where(agreeing > 0.0, np.maximum(before.doubted, 1.0) + agreeing, 1.0)
    odometer = before.last_odometer if report.odometer is None else report.odometer
    new = (count, report.position, accuracy, innovation, report.t, odometer, speed, slack)
    repeated = (1.0 - is_first) * indicator(np.abs(spacing) <= p.gate_floor)
    return tuple(np.where(repeated > 0.0, a, b) for a, b in zip(before[6:], new, strict=True))


def _root_of_squares(a: Array, b: Array) -> Array:
    return np.sqrt(a * a + b * b)
