"""Localisation by rollback: root search on re-done steps. The plant's trajectory is the one it would have had without
it.
"""

from __future__ import annotations

from math import ulp
from typing import Any

import numpy as np

from cosim.balises.hermite import HermiteStep
from cosim.balises.layout import Balise, InstantLayout
from cosim.balises.localiser import Localiser, Method
from cosim.balises.step_search import ROOT_TOLERANCE, StepSearch, is_near
from cosim.balises.telegram import Crossing
from fmus.fmi.standard import TIME_TOLERANCE


class RollbackLocaliser(Localiser):
    """Save, step, look, restore, step to the crossing, restore, step. Redone steps are compared with the first ones."""

    method: Method = "rollback"

    def step(self, t: float, until: float) -> list[tuple[Crossing, np.ndarray]]:  # noqa: D102 - see Localiser
        watch, layout = self.watch, self.layout
        if isinstance(layout, InstantLayout):
            instants = layout.within(t, until)
            if instants:
                return self._redone(t, until, instants)
        elif is_near(*watch.motion, until - t, layout):
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
            found = [(instant, None) for instant in instants] if instants else trial.crossings(self.layout)
            crossings = []
            for stamp, balise in found:
                trial.go(stamp)
                crossings.append((self.crossing(stamp, balise, *self.watch.motion), self.watch.outputs.copy()))
            trial.finish()
            return crossings
        finally:
            trial.release()

    def crossing(self, stamp: float, balise: Balise | None, position: float, speed: float) -> Crossing:
        """What there is to say of a crossing.

        Args:
            stamp: when [s]. balise: which one; None where they are placed by instant.
            position, speed: of the plant at the stamp [m], [m/s].
        """
        if balise is None:
            return self.instant_crossing(stamp, position)
        rounding = 4.0 * ulp(max(abs(position), 1.0)) / max(abs(speed), 1e-12) + 2.0 * ulp(stamp)
        bound = max(ROOT_TOLERANCE, rounding) + self.watch.error.time(stamp, position, speed)
        return Crossing(stamp, balise.position, balise.identity, balise.location_accuracy, self.method, bound)


class _Trial(StepSearch):
    """One step that may be taken again and again, from a saved state. Made with the step already taken once."""

    def __init__(self, localiser: RollbackLocaliser, t: float, until: float) -> None:
        watch = self.watch = localiser.watch
        self._hides, self.t, self.until, self.tries = localiser.hides, t, until, 0
        begin = watch.motion
        self._start = watch.outputs.copy()
        self._state: Any = watch.save()
        try:
            watch.step(t, until)
        except BaseException:
            watch.release(self._state)
            raise
        self._final = watch.outputs.copy()
        self._hermite = HermiteStep(until - t, *begin, *watch.motion)

    def go(self, time: float) -> None:
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
