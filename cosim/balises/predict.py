"""Localisation by prediction: the step is cut before it is taken, where no train could have reached the balise yet."""

from __future__ import annotations

import numpy as np

from cosim.balises.hermite import HermiteStep, time_to_reach
from cosim.balises.layout import InstantLayout, TrackLayout
from cosim.balises.localiser import ACCELERATION_LIMIT, Localiser, Method
from cosim.balises.telegram import Crossing
from fmus.fmi.standard import TIME_TOLERANCE

_FINE_CUT = 1e-4
"""Half the length of the cut that takes the plant over a balise [s]; interpolation over it errs by 1e-8 s at walking
pace.
"""


class PredictLocaliser(Localiser):
    """Cut after cut the plant is brought near the balise, then over it in one short step, within which it is
    interpolated.
    """

    method: Method = "predict"

    def step(self, t: float, until: float) -> list[tuple[Crossing, np.ndarray]]:  # noqa: D102 - see Localiser
        watch = self.watch
        if isinstance(self.layout, InstantLayout):
            return self._step_to_instants(self.layout.within(t, until), t, until)
        crossings: list[tuple[Crossing, np.ndarray]] = []
        while until - t > TIME_TOLERANCE:
            cut = self._next_cut(self.layout, t, until)
            begin, start = watch.motion, watch.outputs.copy()
            watch.step(t, cut)
            taken = HermiteStep(cut - t, *begin, *watch.motion)
            crossings += self.crossings_between(taken, t, start, taken.time_bound(2.0 * ACCELERATION_LIMIT))
            t = cut
        return crossings

    def _step_to_instants(self, instants: list[float], t: float, until: float) -> list[tuple[Crossing, np.ndarray]]:
        crossings = []
        for instant in instants:
            cut = until if until - instant <= TIME_TOLERANCE else instant
            if cut - t > TIME_TOLERANCE:
                self.watch.step(t, cut)
                t = cut
            crossings.append((self.instant_crossing(instant, self.watch.position), self.watch.outputs.copy()))
        if until - t > TIME_TOLERANCE:
            self.watch.step(t, until)
        return crossings

    def _next_cut(self, layout: TrackLayout, now: float, until: float) -> float:
        """As far as no balise can be reached on the way, or a short way over one; the end where it is near."""
        speed = self.watch.speed
        behind, ahead = layout.gaps(self.watch.position)
        safe = min(time_to_reach(ahead, speed, ACCELERATION_LIMIT), time_to_reach(behind, -speed, ACCELERATION_LIMIT))
        cut = now + max(safe, 2.0 * _FINE_CUT)
        return until if until - cut <= _FINE_CUT else cut
