"""Localisation by rollback: root search on re-done steps. The plant's trajectory is the one it would have had without
it.
"""

from __future__ import annotations

from math import ulp
from typing import Any

import numpy as np

from cosim.balises.hermite import HermiteStep, Segment
from cosim.balises.layout import Balise, InstantLayout, TrackLayout
from cosim.balises.localiser import ACCELERATION_LIMIT, Localiser, Method
from cosim.balises.telegram import Crossing
from fmus.fmi.standard import TIME_TOLERANCE

_ROOT_TOLERANCE = 1e-11
"""Crossing times are searched until they move by less than this [s]; a hundredth of the promised 1e-9 s."""

_TURN_TOLERANCE = 1e-6
"""Where the train turns it stands: its position there errs by a millionth of a millionth of a metre only."""

MAX_ROOT_STEPS = 60


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
            (trial.t + trial.search(balise.position, segment), balise)
            for segment in trial.segments()
            for balise in self.layout.crossed(segment.before, segment.after)
        ]

    def crossing(self, stamp: float, balise: Balise | None, position: float, speed: float) -> Crossing:
        """What there is to say of a crossing.

        Args:
            stamp: when [s]. balise: which one; None where they are placed by instant.
            position, speed: of the plant at the stamp [m], [m/s].
        """
        if balise is None:
            return self.instant_crossing(stamp, position)
        rounding = 4.0 * ulp(position) / max(abs(speed), 1e-12) + 2.0 * ulp(stamp)
        bound = max(_ROOT_TOLERANCE, rounding) + self.watch.error.time(stamp, position, speed)
        return Crossing(stamp, balise.position, balise.identity, balise.location_accuracy, self.method, bound)


class _Trial:
    """One step that may be taken again and again, from a saved state. Made with the step already taken once."""

    def __init__(self, localiser: RollbackLocaliser, t: float, until: float) -> None:
        self.watch = watch = localiser.watch
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

    def segments(self) -> list[Segment]:
        """The step, divided where the plant itself turns."""
        hermite = self._hermite
        if not hermite.turns():
            return [Segment(0.0, hermite.h, hermite.p0, hermite.p1)]
        low, high = 0.0, hermite.h
        while high - low > _TURN_TOLERANCE:
            middle = 0.5 * (low + high)
            self.go(self.t + middle)
            low, high = (middle, high) if self.watch.speed * hermite.v0 > 0.0 else (low, middle)
        self.go(self.t + high)
        place = self.watch.position
        return [Segment(0.0, high, hermite.p0, place), Segment(high, hermite.h, place, hermite.p1)]

    def search(self, target: float, segment: Segment) -> float:
        """Time after the start of the step [s] at which the plant is at `target` [m].

        Safeguarded Newton iteration on the plant's own steps, started from the Hermite crossing.
        """
        low, high, rising = segment.start, segment.end, segment.rising
        guess = min(max(self._guess(target, segment, rising), low), high)
        for _ in range(MAX_ROOT_STEPS):
            self.go(self.t + guess)
            position, speed = self.watch.motion
            miss = position - target
            # too short a step to take: `go` stayed at the start, and so does the linear rest
            if guess <= TIME_TOLERANCE:
                return min(max(-miss / speed, 0.0), high) if speed else guess
            if (miss < 0.0) == rising:
                low = max(low, guess)
            else:
                high = min(high, guess)
            following = guess - miss / speed if speed else 0.5 * (low + high)
            if not low <= following <= high:
                following = 0.5 * (low + high)
            if abs(following - guess) <= _ROOT_TOLERANCE or high - low <= _ROOT_TOLERANCE:
                return following
            guess = following
        return guess

    def _guess(self, target: float, segment: Segment, rising: bool) -> float:
        for part in self._hermite.segments():
            if part.rising == rising:
                return self._hermite.crossing(target, part)
        return 0.5 * (segment.start + segment.end)


def _is_near(position: float, speed: float, h: float, layout: TrackLayout) -> bool:
    behind, ahead = layout.gaps(position)
    return min(behind, ahead) <= abs(speed) * h + ACCELERATION_LIMIT * h * h
