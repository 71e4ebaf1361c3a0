"""The innovation gate: whether a position that is told can be true, beside what the observer believes. Pure functions,
ours.

The limit of the innovation ``|estimate - told|`` is

    ``gate_floor + location accuracy + own bound + gate_drift * way + gate_spread * recent``

with the way since the last position that was used, as the observer believes it, and `recent` the largest innovation of
late, halved at every telegram: the bound of its own error that an observer without a covariance has. While an observer
converges the gate is therefore open; and nothing is doubted before `gate_recover` telegrams in a row were within the
limit, for an observer may start anywhere. It is touched at telegrams only, so it costs nothing between them.

Positions that were doubted may be right and the estimate wrong. So each is compared with the one doubted before it:
they agree where the way between them is the way of the odometer, or that of the estimate. After `gate_recover` that
agree, the position is taken, the estimate restarts there, and the gate is open again until it has settled.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from plant_models.hybrid import memory, parameter
from plant_models.hybrid.event import DOUBTED, IGNORED, USED
from plant_models.hybrid.system import Array

OFF, WARN, REJECT = 0.0, 1.0, 2.0
"""Values of the parameter `gate`: every telegram is used; doubted ones are used and counted; they are ignored and
counted.
"""

FORGETTING = 0.5  # of the recent innovation, at each telegram
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
    parameter("gate_drift", "1", 0.05, "Error granted for the way since the last balise, a share of it", min=0.0),
    parameter("gate_spread", "1", 3.0, "Error granted as a multiple of the largest recent innovation", min=0.0),
    parameter(
        "gate_recover",
        "1",
        3.0,
        "Balises within the limit until others are doubted, and doubted ones that agree until they are believed",
        min=1.0,
    ),
)
GATE_MEMORY = (
    memory(VERDICT, "1", 0.0, "Last balise: 0 used, 1 doubted and used, 2 doubted and ignored"),
    memory("gate_settled", "1", 0.0, "Balises in a row whose innovation was within the limit"),
    memory("gate_recent", "m", 0.0, "Largest recent innovation of a balise, halved at each"),
    memory("gate_reference", "m", 0.0, "Position of the last balise that was used"),
    memory("gate_doubted", "1", 0.0, "Balises doubted in a row that agree with each other"),
    memory("gate_doubted_position", "m", 0.0, "Position of the last doubted balise"),
    memory("gate_doubted_innovation", "m", 0.0, "Its innovation"),
    memory("gate_doubted_time", "s", 0.0, "Its stamp"),
    memory("gate_doubted_odometer", "m/s", 0.0, "Odometer at it"),
)


class GateMemory(NamedTuple):
    """What a gate remembers, in the order of `GATE_MEMORY`."""

    verdict: Array
    settled: Array
    recent: Array
    reference: Array
    doubted: Array
    doubted_position: Array
    doubted_innovation: Array
    doubted_time: Array
    doubted_odometer: Array


class Told(NamedTuple):
    """What is told, and what is believed at its stamp.

    Args:
        position: told [m]. accuracy: of the place of the balise, either way [m]. estimate: believed position [m].
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


class Judgement(NamedTuple):
    """Args: used: 1 where the position is used, else 0. restart: 1 where the estimate restarts there. memory:
    afterwards.
    """

    used: Array
    restart: Array
    memory: GateMemory


def gate_limit(before: GateMemory, told: Told, p: Any) -> Array:
    """Innovation beyond which a position is doubted [m].

    Args:
        before: memory of the gate before the telegram. told: the telegram and what the observer knows then.
        p: parameters, as in `HybridSystem.flow`.
    """
    way = np.abs(told.estimate - before.reference)
    granted = _granted(way, told.accuracy, p)
    return granted + told.bound + p.gate_spread * before.recent


def judge(before: GateMemory, told: Told, p: Any) -> Judgement:
    """Whether a told position is used, and what the gate remembers of it.

    Args:
        before: memory at the telegram. told: telegram and belief. p: named tuple with `GATE_PARAMETERS`.
    """
    innovation = told.estimate - told.position
    size = np.abs(innovation)
    outside = _is(size > gate_limit(before, told, p))
    doubted = outside * _is(before.settled >= p.gate_recover) * _is(p.gate > OFF)
    count = doubted * _agreeing(before, told, innovation, p)
    refused = doubted * _is(p.gate >= REJECT)
    restart = refused * _is(count >= p.gate_recover)
    used = 1.0 - refused + restart
    verdict = np.where(used > 0.0, np.where(doubted > 0.0, float(DOUBTED), float(USED)), float(IGNORED))
    after = GateMemory(
        verdict,
        np.where(used > 0.0, np.where(outside > 0.0, 0.0, before.settled + 1.0), before.settled),
        np.where(used > 0.0, np.maximum(size, FORGETTING * before.recent), before.recent),
        np.where(used > 0.0, told.position, before.reference),
        np.where(used > 0.0, 0.0, count),
        np.where(doubted > 0.0, told.position, before.doubted_position),
        np.where(doubted > 0.0, innovation, before.doubted_innovation),
        np.where(doubted > 0.0, told.t, before.doubted_time),
        before.doubted_odometer
        if told.odometer is None
        else np.where(doubted > 0.0, told.odometer, before.doubted_odometer),
    )
    return Judgement(used, restart, after)


def _agreeing(before: GateMemory, told: Told, innovation: Array, p: Any) -> Array:
    """How many doubted positions in a row agree, this one included; one told twice is one."""
    spacing = told.position - before.doubted_position
    tolerance = _granted(np.abs(spacing), told.accuracy, p)
    agrees = is_same = _is(np.abs(spacing) <= tolerance)
    # the way of the estimate
    agrees = np.maximum(agrees, _is(np.abs(innovation - before.doubted_innovation) <= tolerance))
    if told.odometer is not None:
        way = 0.5 * (told.odometer + before.doubted_odometer) * (told.t - before.doubted_time)
        agrees = np.maximum(agrees, _is(np.abs(spacing - way) <= tolerance))
    in_a_row = before.doubted + np.where(is_same > 0.0, 0.0, 1.0)
    return np.where(_is(before.doubted > 0.0) * agrees > 0.0, in_a_row, 1.0)


def _granted(way: Array, accuracy: Array, p: Any) -> Array:
    return p.gate_floor + np.maximum(accuracy, 0.0) + p.gate_drift * way


def _is(condition: Array) -> Array:
    return np.where(condition, 1.0, 0.0)
