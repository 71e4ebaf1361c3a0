"""Localisation by rollback: root search on re-done steps. The plant's trajectory is the one it would have had without
it.
"""

from __future__ import annotations

from math import ulp
from typing import Any, NamedTuple

import numpy as np

from cosim.balises.hermite import HermiteStep, Segment
from cosim.balises.layout import Balise, InstantLayout, TrackLayout
from cosim.balises.localiser import ACCELERATION_LIMIT, SHORTEST_PART, Localiser, Method
from cosim.balises.telegram import Crossing
from fmus.fmi.standard import TIME_TOLERANCE

_ROOT_TOLERANCE = 1e-11
"""Crossing times are searched until they move by less than this [s]; a hundredth of the promised 1e-9 s."""

_TURN_TOLERANCE = 1e-6
"""Where the train turns it stands: its position there errs by a millionth of a millionth of a metre only."""

MAX_ROOT_STEPS = 60

_MOST_PARTS = 64
"""Of a step within which the train may pass a balise and come back."""


class RollbackLocaliser(Localiser):
    """Save, step, look, restore, step to the crossing, restore, step. Redone steps are compared with the first ones."""

    method: Method = "rollback"

    def step(self, t: float, until: float) -> list[tuple[Crossing, np.ndarray]]:  # noqa: D102 - see Localiser
        watch, layout = self.watch, self.layout
        if isinstance(layout, InstantLayout):
            instants = layout.within(t, until)
            if instants:
                return self._redone(t, until, instants)
        elif _is_near(*watch.motion, until - t, layout):
            return self._redone(t, until, [])
        begin = watch.motion
        start = watch.outputs.copy()
        watch.step(t, until)
        if isinstance(layout, InstantLayout) or not layout.crossed(begin[0], watch.position):
            return []
        step = HermiteStep(until - t, *begin, *watch.motion)  # it moved further than any train: too late to go back
        return self.crossings_between(step, t, start, step.h)

    def _redone(self, t: float, until: float, instants: list[float]) -> list[tuple[Crossing, np.ndarray]]:
        trial = _Trial(self, t, until)
        try:
            found = [(instant, None) for instant in instants] if instants else self._crossings(trial)
            crossings = []
            for stamp, balise in found:
                trial.go(stamp)
                crossings.append((self.crossing(stamp, balise, *self.watch.motion), self.watch.outputs.copy()))
            trial.finish()
            return crossings
        finally:
            trial.release()

    def _crossings(self, trial: _Trial) -> list[tuple[float, Balise | None]]:
        assert isinstance(self.layout, TrackLayout)
        return [
            (trial.t + trial.search(balise.position, part), balise)
            for part in trial.parts()
            for balise in self.layout.crossed(part.segment.before, part.segment.after)
        ]

    def crossing(self, stamp: float, balise: Balise | None, position: float, speed: float) -> Crossing:
        """What there is to say of a crossing.

        Args:
            stamp: when [s]. balise: which one; None where they are placed by instant.
            position, speed: of the plant at the stamp [m], [m/s].
        """
        if balise is None:
            return self.instant_crossing(stamp, position)
        rounding = 4.0 * ulp(max(abs(position), 1.0)) / max(abs(speed), 1e-12) + 2.0 * ulp(stamp)
        bound = max(_ROOT_TOLERANCE, rounding) + self.watch.error.time(stamp, position, speed)
        return Crossing(stamp, balise.position, balise.identity, balise.location_accuracy, self.method, bound)


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


class _Trial:
    """One step that may be taken again and again, from a saved state. Made with the step already taken once."""

    def __init__(self, localiser: RollbackLocaliser, t: float, until: float) -> None:
        self.watch, self._hides = localiser.watch, localiser.hides
        watch = self.watch
        self.t, self.until, self.tries = t, until, 0
        begin = watch.motion
        self._start = watch.outputs.copy()
        self._state: Any = watch.save()
        try:
            watch.step(t, until)
        except BaseException:
            self.release()
            raise
        self._final = watch.outputs.copy()
        self._hermite = HermiteStep(until - t, *begin, *watch.motion)

    def go(self, time: float) -> None:
        """Put the plant at `time` [s] within the step, as it was, with the inputs it had."""
        self.tries += 1
        self.watch.restore(self._state)
        self.watch.outputs[:] = self._start  # an input may be connected to an output of the plant itself
        if time - self.t > TIME_TOLERANCE:
            self.watch.step(self.t, time)

    def finish(self) -> None:
        """Take the step once more and for good where the plant was sent back, and note whether it came out the same."""
        if self.tries:
            self.go(self.until)
            outputs, first = self.watch.outputs, self._final
            if outputs.tobytes() != first.tobytes():  # quick; zeros of either sign and NaN come after
                self.watch.redo_differences += not np.array_equal(outputs, first, equal_nan=True)

    def release(self) -> None:
        """Free the saved state."""
        self.watch.release(self._state)

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
            if abs(following - guess) <= _ROOT_TOLERANCE or high - low <= _ROOT_TOLERANCE:
                return following
            guess = following
        return guess


def _is_near(position: float, speed: float, h: float, layout: TrackLayout) -> bool:
    behind, ahead = layout.gaps(position)
    return min(behind, ahead) <= abs(speed) * h + ACCELERATION_LIMIT * h * h
