"""The balise reader: position and speed of a train, from one communication step to the next, become balise events.

A sensor as a hybrid system of its own; knows the hybrid foundation, the layouts and the cubic.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal, NamedTuple

import numpy as np

from plant_models.hybrid import Array, CommunicationEvent, HybridSystem, Resource, vector
from plant_models.hybrid.option import require_chosen, require_whole
from plant_models.hybrid.signal import discrete_output, input_signal, memory, parameter
from plant_models.railway.track.balise_layout import BaliseLayout, Positions, Spacing

_HALVINGS = 6  # bring the bracket to 1/64 of the step
_PARABOLAS = 5  # each triples the digits


class _HermiteCubic(NamedTuple):
    """``p(s) = p0 + s (slope + s (square + s cubic))`` over a step, with s from 0 to 1.

    Args:
        p0: position at the start [m]. slope, square, cubic: coefficients [m].
    """

    p0: Array
    slope: Array
    square: Array
    cubic: Array

    @classmethod
    def of(cls, h: Array, p0: Array, v0: Array, p1: Array, v1: Array) -> _HermiteCubic:
        """From positions [m] and speeds [m/s] at both ends of a step of length `h` [s].

        Args:
            h: length of the step [s]. p0, v0: position [m] and speed [m/s] at its start. p1, v1: at its end.
        """
        rise = p1 - p0
        return cls(p0, h * v0, 3.0 * rise - h * (2.0 * v0 + v1), h * (v0 + v1) - 2.0 * rise)

    def rise(self, s: Array) -> Array:
        """Position minus `p0` [m]."""
        return s * (self.slope + s * (self.square + s * self.cubic))

    def rate(self, s: Array) -> Array:
        """Derivative of the position by s [m]."""
        return self.slope + s * (2.0 * self.square + 3.0 * self.cubic * s)

    def turn(self) -> Array:
        """Where the train turns: s in (0, 1) if it moves one way at the start and the other way at the end, else 1."""
        a, b, c = 3.0 * self.cubic, 2.0 * self.square, self.slope
        root = np.sqrt(np.maximum(b * b - 4.0 * a * c, 0.0))
        divisor = np.where(c > 0.0, root, -root) - b
        turns = self.slope * self.rate(1.0) < 0.0
        return np.where(turns, np.clip(2.0 * c / np.where(turns, divisor, 1.0), 0.0, 1.0), 1.0)

    def crossing(self, target: Array, direction: Array, low: Array, high: Array) -> Array:
        """Where the position reaches a target: s in ``[low, high]``.

        Bisection first, then steps to the zero of the parabola that touches the cubic (Cauchy's method), clipped to the
        bracket that shrinks with them. Newton's tangents would need 25 steps where a train comes to rest on the target,
        a double zero; the parabola has it at once, and everything under constant acceleration.

        Args:
            target: position [m], reached between the ends of the bracket. direction: 1 where it is reached upwards, -1
                downwards. low, high: the bracket.
        """
        distance = target - self.p0
        s = 0.5 * (low + high)
        for i in range(_HALVINGS + _PARABOLAS):
            excess = direction * (self.rise(s) - distance)
            high, low = np.where(excess >= 0.0, s, high), np.where(excess >= 0.0, low, s)
            middle = 0.5 * (low + high)
            s = middle if i < _HALVINGS else self._improved(s, excess, direction, low, high)
        return s

    def _improved(self, s: Array, excess: Array, direction: Array, low: Array, high: Array) -> Array:
        rate, curvature = direction * self.rate(s), direction * (2.0 * self.square + 6.0 * self.cubic * s)
        divisor = rate + np.sqrt(np.maximum(rate * rate - 2.0 * excess * curvature, 0.0))
        usable = divisor > 0.0  # else the cubic stands here, or runs backwards
        zero = s - 2.0 * excess / np.where(usable, divisor, 1.0)
        return np.where(usable, np.clip(zero, low, high), 0.5 * (low + high))


LayoutShape = Literal["spacing", "positions"]

_EXAMPLE = (100.0, 350.0, 600.0, 1100.0)  # an example, so that the file in the FMU shows its form


class _Segment(NamedTuple):
    """A part of a step in which the train does not turn: bracket of s, positions at its ends [m], direction, balises in
    it.
    """

    low: Array
    high: Array
    before: Array
    after: Array
    direction: Array
    count: Array


class BaliseReader(HybridSystem):
    """Finds the instants at which a train passes balises, inside a communication step, and announces them.

    At every communication point the reader takes `position` and `speed`. Between two of them the position is the cubic
    Hermite polynomial of both; where it crosses a balise, forwards or backwards, is a crossing. Its error is of order
    ``h^4`` in the position, none at all under constant acceleration. A crossing belongs to ``(before, after]``: a train
    that stops on a balise has passed it, and has not passed it again when it moves on, or starts there.

    One crossing is announced in each communication step, the oldest first: `balise_count` goes up by one, `balise_time`
    is the instant, `balise_position` the place. Wired to the inputs of the same names of an observer, that is the event
    protocol of FMI 2. Others wait, up to `pending_capacity`; what is more is lost and counted in `lost_count`. The
    stamp makes a late announcement exact: the observer replays.

    What the inputs mean depends on the master. `input_instant` = 1: they belong to the end of the step, as where a
    sequential (Gauss-Seidel) master steps the plant first and hands its new outputs on before it steps the reader;
    crossings lie in the step just taken. `input_instant` = 0: they belong to the start of the step, as in a parallel
    (Jacobi) master; crossings lie in the step before, and are announced one step later with the same stamps. With the
    wrong value all stamps are off by one step. At the start the inputs must hold the plant's start position and speed:
    by an exchange in initialisation mode, or by start values; with 0 the first step brings them all the same. Steps may
    vary.

    Two balises at one place are refused where they are given as an option, and taken as one where parameters or the
    file say so.

    Args:
        layout: ``spacing``: balises at equal distances; ``positions``: a list, which an FMU reads from its file
            ``resources/balises.csv`` (column ``position`` [m], increasing) if that is there.
        positions: start values of the list [m], increasing.
        balise_capacity: entries of the list.
        pending_capacity: crossings that can be found in one step, and that can wait.

    Raises:
        ValueError: an unknown layout, a capacity below one, or a list of positions that is not one.

    Source: the balises of Bouchama 2024, section 3.4, sampled where they are passed; the localisation is ours.
    """

    name = "balise_reader"
    description = "Balise reader: position and speed of a train in, balise events with their own time stamps out"
    source = "Bouchama 2024, section 3.4 (balises as aperiodic samples); the localisation is ours"
    internal_step = 1e-2  # nothing flows
    inputs = (
        input_signal("position", "m", 0.0, "Position of the train, at the instant that input_instant names"),
        input_signal("speed", "m/s", 0.0, "Speed of the train at the same instant", display_unit="km/h"),
    )
    outputs = (
        discrete_output("balise_count", "1", "Goes up by one with every balise announced", integer=True),
        discrete_output("balise_time", "s", "Instant at which the balise was passed"),
        discrete_output("balise_position", "m", "Position of the balise passed"),
        discrete_output("lost_count", "1", "Crossings that found no room", integer=True),
    )
    events = (CommunicationEvent("reading", "Position and speed are taken"),)
    option_choices = {
        "layout": ("spacing", "positions"),
        "balise_capacity": range(1, 257),
        "pending_capacity": range(1, 17),
    }

    def __init__(
        self,
        *,
        layout: LayoutShape = "spacing",
        positions: Sequence[float] = _EXAMPLE,
        balise_capacity: int = 64,
        pending_capacity: int = 8,
    ) -> None:
        require_chosen(self.name, self.option_choices, layout=layout)
        require_whole("balise_reader", pending_capacity=pending_capacity)
        self.pending_capacity = pending_capacity
        self._layout: BaliseLayout = (
            Spacing() if layout == "spacing" else Positions(balise_capacity, positions, pending_capacity)
        )
        self.resources = (Resource("positions", "balises.csv", "position"),) if layout == "positions" else ()
        self.parameters = (_INPUT_INSTANT, *self._layout.parameters)
        self.states = (*_SAMPLE, *_announcements(pending_capacity))
        super().__init__(
            layout=layout,
            positions=tuple(positions),
            balise_capacity=balise_capacity,
            pending_capacity=pending_capacity,
        )

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """Take a sample, find what was passed since the last one, announce the oldest."""
        known, t0 = x.primed > 0.0, x.sample_time
        instant = np.where(known, np.where(p.input_instant > 0.5, t, x.last_communication), t)
        h = np.where(known, np.maximum(instant - t0, 0.0), 0.0)
        # A second sample at one instant replaces the first: the train did not move in no time.
        before = np.where(h > 0.0, x.sample_position, u.position)
        cubic = _HermiteCubic.of(h, before, x.sample_speed, u.position, u.speed)
        segments = self._segments(cubic, u.position, p)
        places, fractions = self._crossings(cubic, segments, p)
        found = segments[0].count + segments[1].count
        stamps = [np.where(found > j, np.minimum(t0 + s * h, instant), 0.0) for j, s in enumerate(fractions)]
        places = [np.where(found > j, place, 0.0) for j, place in enumerate(places)]
        sample = {"sample_time": instant, "sample_position": u.position, "sample_speed": u.speed}
        announced = self._announce(x, found, stamps, places)
        return {"last_communication": t, **sample, "primed": 1.0, **announced}

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        passed = {"balise_time": x.announced_time, "balise_position": x.announced_position}
        return {"balise_count": x.announced, **passed, "lost_count": x.lost}

    def _segments(self, cubic: _HermiteCubic, after: Array, p: Any) -> tuple[_Segment, _Segment]:
        """The step, divided where the train turns; the second segment is empty where it does not."""
        turn = cubic.turn()
        place = np.where(turn < 1.0, cubic.p0 + cubic.rise(turn), after)
        first, second = _direction(cubic.p0, place), _direction(place, after)
        return (
            _Segment(0.0, turn, cubic.p0, place, first, self._layout.count(cubic.p0, place, first, p)),
            _Segment(turn, 1.0, place, after, second, self._layout.count(place, after, second, p)),
        )

    def _crossings(
        self, cubic: _HermiteCubic, segments: tuple[_Segment, _Segment], p: Any
    ) -> tuple[list[Array], list[Array]]:
        """Places [m] and fractions of the step of the first crossings; what lies beyond their number means nothing."""
        one, two = segments
        places: list[Array] = []
        fractions: list[Array] = []
        place = one.before
        for j in range(self.pending_capacity):
            beyond = one.count <= j
            direction = np.where(beyond, two.direction, one.direction)
            place = self._layout.next(np.where(one.count == j, two.before, place), direction, p)
            bracket = (np.where(beyond, two.low, one.low), np.where(beyond, two.high, one.high))
            places.append(place)
            fractions.append(cubic.crossing(place, direction, *bracket))
        return places, fractions

    def _announce(self, x: Any, found: Array, stamps: list[Array], places: list[Array]) -> dict[str, Array]:
        """Memory of the announcements after the crossings found have joined the queue and its head has left it."""
        times = _joined(x.waiting_time, x.waiting, stamps)
        positions = _joined(x.waiting_position, x.waiting, places)
        room = self.pending_capacity - x.waiting
        waiting = x.waiting + np.minimum(found, room)
        some = waiting > 0.0
        return {
            "announced": x.announced + np.where(some, 1.0, 0.0),
            "announced_time": np.where(some, times[0], x.announced_time),
            "announced_position": np.where(some, positions[0], x.announced_position),
            "lost": x.lost + np.maximum(found - room, 0.0),
            "waiting": waiting - np.where(some, 1.0, 0.0),
            "waiting_time": _without_head(times, some),
            "waiting_position": _without_head(positions, some),
        }


def _announcements(capacity: int) -> tuple[Any, ...]:
    return (
        memory("announced", "1", 0.0, "Balises announced so far"),
        memory("announced_time", "s", 0.0, "Instant of the last one announced"),
        memory("announced_position", "m", 0.0, "Position of the last one announced"),
        memory("lost", "1", 0.0, "Crossings that found no room"),
        memory("waiting", "1", 0.0, "Crossings that wait to be announced"),
        memory("waiting_time", "s", 0.0, "Instants of those that wait, oldest first", size=capacity),
        memory("waiting_position", "m", 0.0, "Positions of those that wait", size=capacity),
    )


_SAMPLE = (
    memory("last_communication", "s", 0.0, "Last communication point"),
    memory("sample_time", "s", 0.0, "Instant of the last sample"),
    memory("sample_position", "m", 0.0, "Position at the last sample"),
    memory("sample_speed", "m/s", 0.0, "Speed at the last sample"),
    memory("primed", "1", 0.0, "1 after the first sample"),
)

_INPUT_INSTANT = parameter(
    "input_instant",
    "1",
    1.0,
    "Inputs at a step belong to its end (1, sequential master) or to its start (0, parallel master)",
    min=0.0,
    max=1.0,
)


def _direction(before: Array, after: Array) -> Array:
    return np.where(after >= before, 1.0, -1.0)


def _joined(queue: Array, waiting: Array, new: list[Array]) -> list[Array]:
    """The queue with the new ones behind those that wait, as far as there is room."""
    joined = []
    for i, old in enumerate(queue):
        value = old
        for j in range(i + 1):
            value = np.where(waiting == i - j, new[j], value)
        joined.append(value)
    return joined


def _without_head(queue: list[Array], some: Array) -> Array:
    """The queue, moved up where something waits."""
    return vector(*(np.where(some, behind, value) for value, behind in zip(queue, [*queue[1:], 0.0], strict=True)))
