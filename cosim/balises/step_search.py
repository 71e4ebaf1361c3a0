"""Root search within a step in which the plant can be put at any instant: crossings of balises, turns included."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import NamedTuple

from cosim.balises.hermite import HermiteStep, Segment
from cosim.balises.layout import Balise, InstantLayout, TrackLayout
from cosim.balises.localiser import ACCELERATION_LIMIT, SHORTEST_PART
from cosim.balises.plant_monitor import PlantMonitor
from fmus.fmi.standard import TIME_TOLERANCE

ROOT_TOLERANCE = 1e-11
"""Crossing times are searched until they move by less than this [s]; a hundredth of the promised 1e-9 s."""

_TURN_TOLERANCE = 1e-6
"""Where the train turns it stands: its position there errs by a millionth of a millionth of a metre only."""

MAX_ROOT_STEPS = 60

_MOST_PARTS = 64
"""Of a step within which the train may pass a balise and come back."""


class _Part(NamedTuple):
    """A part of a step in which the train does not turn.

    Args:
        begin: of the motion that it is a part of, after the start of the step [s]. motion: between two instants at
            which the plant was looked at. segment: the part, from the begin of the motion on.
    """

    begin: float
    motion: HermiteStep
    segment: Segment

    def guess(self, target: float) -> float:
        """About when the train is at `target` [m], after the start of the step [s]."""
        if not self.motion.turns():
            return self.begin + self.motion.crossing(target, self.segment)
        for segment in self.motion.segments():
            if segment.rising == self.segment.rising:
                return self.begin + self.motion.crossing(target, segment)
        return self.begin + 0.5 * (self.segment.start + self.segment.end)


class StepSearch(ABC):
    """A step within which crossings are searched; `go` puts the plant at an instant of it, with its outputs read.

    Who makes one says where it begins (`t` [s]), how the plant moves between both ends, and what its localiser knows:
    once for each balise, so it is set here without a call.
    """

    watch: PlantMonitor
    t: float
    _hermite: HermiteStep
    _hides: Callable[[HermiteStep], bool]

    @abstractmethod
    def go(self, time: float) -> None:
        """Put the plant at `time` [s] within the step, with the inputs it had."""

    def crossings(self, layout: TrackLayout | InstantLayout) -> list[tuple[float, Balise | None]]:
        """Instants [s] within the step at which balises are passed, in order, each with its balise; without one where
        they are placed by instant.

        Args:
            layout: of the balises.
        """
        if isinstance(layout, InstantLayout):
            return [(instant, None) for instant in layout.within(self.t, self.t + self._hermite.h)]
        return [
            (self.t + self.search(balise.position, part), balise)
            for part in self.parts()
            for balise in layout.crossed(part.segment.before, part.segment.after)
        ]

    def parts(self) -> list[_Part]:
        """The step, divided where the plant itself turns."""
        if self._hermite.h <= SHORTEST_PART:
            return self._divided(0.0, self._hermite)
        return [part for begin, motion in self._motions() for part in self._divided(begin, motion)]

    def _motions(self) -> list[tuple[float, HermiteStep]]:
        """The step as motions, with their begins after its start [s]: halved again and again where the train may pass a
        balise there and back, down to a tenth of a second or, of long steps, a sixty-fourth.
        """
        shortest = self._hermite.h / _MOST_PARTS
        found, open_ = list[tuple[float, HermiteStep]](), [(0.0, self._hermite)]
        while open_:
            begin, motion = open_.pop()
            if motion.h <= shortest or not self._hides(motion):
                found.append((begin, motion))
                continue
            half = 0.5 * motion.h  # halves of halves are exact
            self.go(self.t + begin + half)
            there = self.watch.motion
            open_.append((begin + half, HermiteStep(half, *there, motion.p1, motion.v1)))
            open_.append((begin, HermiteStep(half, motion.p0, motion.v0, *there)))
        return found

    def _divided(self, begin: float, motion: HermiteStep) -> list[_Part]:
        """A motion, divided where the plant itself turns."""
        if not motion.turns():
            return [_Part(begin, motion, Segment(0.0, motion.h, motion.p0, motion.p1))]
        low, high = 0.0, motion.h
        while high - low > _TURN_TOLERANCE:
            middle = 0.5 * (low + high)
            self.go(self.t + begin + middle)
            low, high = (middle, high) if self.watch.speed * motion.v0 > 0.0 else (low, middle)
        self.go(self.t + begin + high)
        place = self.watch.position
        there, back = Segment(0.0, high, motion.p0, place), Segment(high, motion.h, place, motion.p1)
        return [_Part(begin, motion, there), _Part(begin, motion, back)]

    def search(self, target: float, part: _Part) -> float:
        """Time after the start of the step [s] at which the plant is at `target` [m] for the first time in a part.

        Safeguarded Newton iteration on the plant's own steps, started from the Hermite crossing.
        """
        low, high, rising = part.begin + part.segment.start, part.begin + part.segment.end, part.segment.rising
        guess = min(max(part.guess(target), low), high)
        for _ in range(MAX_ROOT_STEPS):
            self.go(self.t + guess)
            position, speed = self.watch.motion
            miss = position - target
            # too short a step to take: `go` stayed at the start, and so does the linear rest
            if guess <= TIME_TOLERANCE:
                return min(max(-miss / speed, 0.0), high) if speed else guess
            if miss >= 0.0 if rising else miss <= 0.0:
                high = min(high, guess)
            else:
                low = max(low, guess)
            following = guess - miss / speed if speed else 0.5 * (low + high)
            if not low <= following <= high:
                following = 0.5 * (low + high)
            if abs(following - guess) <= ROOT_TOLERANCE or high - low <= ROOT_TOLERANCE:
                return following
            guess = following
        return guess


def is_near(position: float, speed: float, h: float, layout: TrackLayout) -> bool:
    """Whether a plant may pass a balise within a step.

    Args:
        position: [m]. speed: [m/s]. h: length of the step [s]. layout: of the balises.
    """
    behind, ahead = layout.gaps(position)
    return min(behind, ahead) <= abs(speed) * h + ACCELERATION_LIMIT * h * h
