"""Cubic Hermite interpolation of a position from position and speed at both ends of a step. Standard library only."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, sqrt

_MAX_HALVINGS = 200


@dataclass(frozen=True, slots=True)
class Segment:
    """A part of a step in which the train does not turn.

    Args:
        start, end: times after the start of the step [s]. before, after: positions there [m].
    """

    start: float
    end: float
    before: float
    after: float

    @property
    def rising(self) -> bool:
        """Whether the position grows."""
        return self.after >= self.before


@dataclass(frozen=True, slots=True)
class HermiteStep:
    """Position over one step: ``p(0) = p0, p'(0) = v0, p(h) = p1, p'(h) = v1``.

    Args:
        h: length of the step [s]. p0, p1: positions [m]. v0, v1: speeds [m/s].
    """

    h: float
    p0: float
    v0: float
    p1: float
    v1: float

    def position(self, s: float) -> float:
        """Position [m] at `s` [s] after the start of the step."""
        cubic, square = self._coefficients()
        x = s / self.h
        return self.p0 + x * (self.h * self.v0 + x * (square + x * cubic))

    def speed(self, s: float) -> float:
        """Speed [m/s] at `s` [s], quadratic over the step."""
        cubic, square = self._coefficients()
        x = s / self.h
        return self.v0 + x * (2.0 * square + 3.0 * cubic * x) / self.h

    def acceleration(self, s: float) -> float:
        """Acceleration [m/s2] at `s` [s], linear over the step."""
        cubic, square = self._coefficients()
        return (2.0 * square + 6.0 * cubic * s / self.h) / self.h**2

    def turns(self) -> bool:
        """Whether the train moves one way at the start and the other way at the end."""
        return self.v0 * self.v1 < 0.0

    def may_stand(self, acceleration: float) -> bool:
        """Whether a train can stand or turn within the step.

        Args:
            acceleration: harder than which it neither accelerates nor brakes [m/s2].
        """
        return abs(self.v0 + self.v1) <= acceleration * self.h

    def reach(self, acceleration: float) -> tuple[float, float]:
        """Lowest and highest position [m] that a train can have within the step: it is between the parabolas of the
        hardest motion from the one end and to the other.

        Args:
            acceleration: as of `may_stand`.
        """
        places = [self.p0, self.p1]
        for a in (-acceleration, acceleration):
            closing = self.v0 - self.v1 + a * self.h  # of both parabolas [m/s]
            meet = (self.p1 - self.p0 - self.h * (self.v1 - 0.5 * a * self.h)) / closing if closing else 0.0
            meet = min(max(meet, 0.0), self.h)
            places.append(self.p0 + meet * (self.v0 + 0.5 * a * meet))
        return min(places), max(places)

    def segments(self) -> list[Segment]:
        """The step, divided where the train turns."""
        if not self.turns():
            return [Segment(0.0, self.h, self.p0, self.p1)]
        forward = self.v0 > 0.0
        turn = _first_time(lambda s: (self.speed(s) <= 0.0) == forward, 0.0, self.h)
        place = self.position(turn)
        return [Segment(0.0, turn, self.p0, place), Segment(turn, self.h, place, self.p1)]

    def crossing(self, target: float, segment: Segment | None = None) -> float:
        """Time after the start of the step at which the position is `target` [s]; `target` lies within the segment."""
        part = self.segments()[0] if segment is None else segment
        (cubic, square), rising = self._coefficients(), part.rising
        p0, linear, h, low, high = self.p0, self.h * self.v0, self.h, part.start, part.end
        for _ in range(_MAX_HALVINGS):  # as `_first_time`, of `position`: some sixty halvings, without a call in each
            middle = 0.5 * (low + high)
            if middle in (low, high):
                break
            x = middle / h
            ahead = p0 + x * (linear + x * (square + x * cubic)) - target
            if ahead >= 0.0 if rising else ahead <= 0.0:
                high = middle
            else:
                low = middle
        return high

    def time_bound(self, acceleration_spread: float) -> float:
        """Bound of the crossing time's error [s] where the true acceleration differs from the cubic's by no more than a
        spread D.

        A function with zero value and slope at both ends and a second derivative within +-D stays within
        ``D h^2 / 16``, and its slope within ``D h / 4`` (bang-bang second derivative +D, -D, +D over h/4, h/2, h/4).
        The first divided by the lowest possible speed is a time. Where the train may stand, nothing better than the
        step itself is known.

        Args:
            acceleration_spread: D [m/s2].
        """
        slowest = self._lowest_speed() - acceleration_spread * self.h / 4.0
        if slowest <= 0.0:
            return self.h
        return min(acceleration_spread * self.h**2 / 16.0 / slowest, self.h)

    def _coefficients(self) -> tuple[float, float]:
        cubic = 2.0 * (self.p0 - self.p1) + self.h * (self.v0 + self.v1)
        square = 3.0 * (self.p1 - self.p0) - self.h * (2.0 * self.v0 + self.v1)
        return cubic, square

    def _lowest_speed(self) -> float:
        """Least magnitude of the cubic's speed over the step [m/s]."""
        cubic, square = self._coefficients()
        speeds = [self.v0, self.v1]
        vertex = -square / (3.0 * cubic) if cubic else -1.0
        if 0.0 < vertex < 1.0:
            speeds.append(self.speed(vertex * self.h))
        return 0.0 if min(speeds) <= 0.0 <= max(speeds) else min(map(abs, speeds))


def _first_time(reached: Callable[[float], bool], low: float, high: float) -> float:
    """The first time in ``(low, high]`` at which `reached` is true, halved down to neighbouring floats; `high` must
    reach.
    """
    for _ in range(_MAX_HALVINGS):
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        if reached(middle):
            high = middle
        else:
            low = middle
    return high


def time_to_reach(distance: float, speed: float, acceleration: float) -> float:
    """Least time [s] to cover a distance [m] ahead at a speed towards it [m/s] with no more than an acceleration
    [m/s2].

    The speed may be negative: the train must then brake first. The distance may be infinite.
    """
    if distance <= 0.0 or distance == inf:
        return max(distance, 0.0)
    root = sqrt(speed * speed + 2.0 * acceleration * distance)
    return 2.0 * distance / (speed + root) if speed > 0.0 else (root - speed) / acceleration
