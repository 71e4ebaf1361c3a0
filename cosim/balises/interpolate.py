"""Localisation by interpolation: a cubic between the ends of the step. It needs nothing of the plant, and reports its
bound.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from cosim.balises.hermite import HermiteStep
from cosim.balises.layout import InstantLayout, TrackLayout
from cosim.balises.localiser import Localiser, Method
from cosim.balises.plant_monitor import PlantMonitor
from cosim.balises.telegram import Crossing


class InterpolateLocaliser(Localiser):
    """Cubic Hermite between the ends of the step.

    Args:
        jerk_bound: how fast the plant's acceleration may change between two sudden changes [m/s3].
        watch: the monitored plant. layout: where the balises are.
    """

    method: Method = "interpolate"

    def __init__(self, watch: PlantMonitor, layout: TrackLayout | InstantLayout, jerk_bound: float = 10.0) -> None:
        super().__init__(watch, layout)
        self.jerk_bound = jerk_bound
        self._last_acceleration = math.nan

    def step(self, t: float, until: float) -> list[tuple[Crossing, np.ndarray]]:  # noqa: D102 - see Localiser
        watch = self.watch
        begin, start = watch.motion, watch.outputs.copy()
        watch.step(t, until)
        step = HermiteStep(until - t, *begin, *watch.motion)
        spread = self._spread(step)
        if isinstance(self.layout, TrackLayout):
            return self.crossings_between(step, t, start, step.time_bound(spread))
        return [self._at(instant, step, t, start) for instant in self.layout.within(t, until)]

    def save(self) -> Any:  # noqa: D102 - see Localiser
        return self._last_acceleration

    def restore(self, state: Any) -> None:  # noqa: D102 - see Localiser
        self._last_acceleration = state

    def _at(self, instant: float, step: HermiteStep, t: float, start: np.ndarray) -> tuple[Crossing, np.ndarray]:
        s = min(max(instant - t, 0.0), step.h)
        position = step.position(s)
        return self.instant_crossing(instant, position), self.watch.between(start, s / step.h, position)

    def _spread(self, step: HermiteStep) -> float:
        """How far the true acceleration may be from the cubic's: what was seen to vary, and the stated jerk over the
        step.
        """
        first, last = step.acceleration(0.0), step.acceleration(step.h)
        jump = 0.0 if math.isnan(self._last_acceleration) else abs(first - self._last_acceleration)
        self._last_acceleration = last
        return abs(last - first) + jump + self.jerk_bound * step.h
