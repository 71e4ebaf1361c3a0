"""Localisation: which method finds the crossings. `choose` takes the best one that the probed plant allows.

| method | needs | error |
|---|---|---|
| ``early-return`` | an FMI 3 plant with event mode that reports the crossing itself | the plant's own |
| ``dense-output`` | a model exchange plant, which a solver moves here | root search on the solver's polynomial |
| ``rollback`` | an exact state and steps of any length | root search on re-done steps |
| ``predict`` | steps of any length | interpolation over the last short cut |
| ``interpolate`` | nothing | cubic over the step; the bound is reported |
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from cosim.balises.dense_output import DenseOutputLocaliser
from cosim.balises.early_return import EarlyReturnLocaliser
from cosim.balises.hermite import HermiteStep, time_to_reach
from cosim.balises.layout import InstantLayout, TrackLayout
from cosim.balises.localiser import ACCELERATION_LIMIT, METHODS, Localiser, Method
from cosim.balises.plant_monitor import PlantMonitor
from cosim.balises.rollback import RollbackLocaliser
from cosim.balises.telegram import Crossing
from cosim.errors import CouplingError
from fmus.check.restoring import Restores
from fmus.fmi.standard import TIME_TOLERANCE

__all__ = ["METHODS", "Localiser", "Method", "choose", "make_localiser"]


_FINE_CUT = 1e-4
"""Half the length of the cut that takes the plant over a balise [s]; interpolation over it errs by 1e-8 s at walking
pace.
"""


class _InterpolateLocaliser(Localiser):
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

    def step(self, t: float, until: float) -> list[tuple[Crossing, np.ndarray]]:
        watch = self.watch
        begin, start = watch.motion, watch.outputs.copy()
        watch.step(t, until)
        step = HermiteStep(until - t, *begin, *watch.motion)
        if self.hides(step):
            self.hidden_from = min(self.hidden_from, t)
        spread = self._spread(step)
        if isinstance(self.layout, TrackLayout):
            return self.crossings_between(step, t, start, step.time_bound(spread))
        return [self._at(instant, step, t, start) for instant in self.layout.within(t, until)]

    def save(self) -> Any:
        return self._last_acceleration

    def restore(self, state: Any) -> None:
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


class _PredictLocaliser(Localiser):
    """Cut after cut the plant is brought near the balise, then over it in one short step, within which it is
    interpolated.
    """

    method: Method = "predict"

    def step(self, t: float, until: float) -> list[tuple[Crossing, np.ndarray]]:
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


def choose(honest_step: bool, restores: Restores, clock: str | None, *, solved: bool = False) -> tuple[Method, str]:
    """The best method a probed plant allows, and why.

    Args:
        honest_step: steps of any length were seen to do what they say.
        restores: how what followed a restored state was seen to continue.
        clock: output clock that reports crossings, where the scenario names one.
        solved: a solver moves the plant here, and can be asked.
    """
    if clock is not None:
        return "early-return", f"the plant reports crossings on its clock '{clock}'"
    if solved and honest_step:
        return "dense-output", "the plant is a model exchange FMU, whose solver knows its states at every instant"
    if restores == "exact" and honest_step:
        return "rollback", "the plant restores its state exactly and takes steps of any length"
    if honest_step:
        how = "only to within its solver's tolerance" if restores == "within_tolerance" else "not"
        return "predict", f"the plant takes steps of any length, its state is restored {how}"
    return "interpolate", "the plant does not take steps of any length reliably"


def make_localiser(
    method: Method,
    watch: PlantMonitor,
    layout: TrackLayout | InstantLayout,
    clock: str | None = None,
    jerk_bound: float = 10.0,
) -> Localiser:
    """A localiser by name.

    Args:
        watch: the monitored plant. layout: where the balises are.
        clock: name of the plant's clock that announces crossings. jerk_bound: largest jerk of the plant [m/s3].

    Raises:
        CouplingError: the method is unknown, or needs something the plant or the scenario does not have.
    """
    if method == "early-return":
        if clock is None:
            raise CouplingError("balises.method = 'early-return' needs balises.clock, the plant's output clock.")
        return EarlyReturnLocaliser(watch, layout, clock)
    if method == "dense-output":
        return DenseOutputLocaliser(watch, layout)
    if method == "rollback":
        if not watch.component.can_save:
            raise CouplingError(
                f"balises.method = 'rollback': {watch.component.name} cannot save its state; use 'auto'."
            )
        return RollbackLocaliser(watch, layout)
    if method == "predict":
        return _PredictLocaliser(watch, layout)
    if method == "interpolate":
        return _InterpolateLocaliser(watch, layout, jerk_bound)
    raise CouplingError(f"balises.method {method!r} is unknown; use 'auto' or one of {', '.join(METHODS)}.")
