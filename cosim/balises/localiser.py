"""The localiser: steps the watched plant in place of the master, and finds when it passes a balise on the way.

It may cut or redo the step; how, is up to the methods in the modules beside this one.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from math import inf
from typing import Literal

import numpy as np

from cosim.balises.hermite import HermiteStep
from cosim.balises.layout import InstantLayout, TrackLayout
from cosim.balises.plant_monitor import PlantMonitor
from cosim.balises.telegram import Crossing
from cosim.restorable import Restorable

Method = Literal["early-return", "dense-output", "rollback", "predict", "interpolate", "recorded"]
METHODS: tuple[Method, ...] = ("early-return", "dense-output", "rollback", "predict", "interpolate")
"""Those that find crossings; what was ``recorded`` need not be found."""

ACCELERATION_LIMIT = 5.0
"""No train accelerates or brakes harder [m/s2]; where one does, its crossings are found all the same, with a larger
bound.
"""

SHORTEST_PART = 0.1
"""Steps up to this length are taken as they are [s]: a train that turns twice within one gets 3 mm far at the limit."""


class Localiser(Restorable, ABC):
    """Steps the watched plant and finds the crossings on the way.

    Args:
        watch: the plant with its position and speed.
        layout: what to look for.
    """

    method: Method

    def __init__(self, watch: PlantMonitor, layout: TrackLayout | InstantLayout) -> None:
        self.watch, self.layout = watch, layout
        self.hidden_from = inf
        """Begin of the first step within which a balise may have been passed there and back without a word [s]."""

    @abstractmethod
    def step(self, t: float, until: float) -> list[tuple[Crossing, np.ndarray]]:
        """Step the plant from `t` to `until` [s].

        Returns:
            The crossings in ``(t, until]`` in order of time, each with the plant's outputs at that instant, shape (q,).
        """

    def hides(self, step: HermiteStep) -> bool:
        """Whether a train may have passed a balise and come back within a step, of which only both ends are known."""
        if step.h <= SHORTEST_PART or isinstance(self.layout, InstantLayout):
            return False
        if not step.may_stand(ACCELERATION_LIMIT):
            return False
        return bool(self.layout.crossed(*step.reach(ACCELERATION_LIMIT)))

    def crossings_between(
        self, step: HermiteStep, t: float, start: np.ndarray, bound: float
    ) -> list[tuple[Crossing, np.ndarray]]:
        """Crossings of a step that was taken, by cubic Hermite interpolation.

        Args:
            step: both ends of it. t: when it began [s]. start: the plant's outputs there, shape (q,).
            bound: bound of the stamps' error [s], to which that of the plant itself is added.
        """
        assert isinstance(self.layout, TrackLayout)
        found = []
        for segment in step.segments():
            for balise in self.layout.crossed(segment.before, segment.after):
                s = step.crossing(balise.position, segment)
                whole = bound + self.watch.error.time(t + s, balise.position, step.speed(s))
                crossing = Crossing(
                    t + s, balise.position, balise.identity, balise.location_accuracy, self.method, whole
                )
                found.append((crossing, self.watch.between(start, s / step.h, balise.position)))
        return found

    def instant_crossing(self, instant: float, position: float) -> Crossing:
        """The crossing that a test placed at an instant [s], where the plant was at a position [m]."""
        assert isinstance(self.layout, InstantLayout)
        return Crossing(instant, position, self.layout.identity(instant), 0.0, self.method, 0.0)
