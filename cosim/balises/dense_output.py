"""Localisation by dense output: root search on the polynomial of the solver that moves a model exchange plant.

Nothing is stepped again, and the plant's trajectory is the one that it has without balises.
"""

from __future__ import annotations

import numpy as np

from cosim.balises.hermite import HermiteStep
from cosim.balises.layout import InstantLayout, TrackLayout
from cosim.balises.localiser import Localiser, Method
from cosim.balises.plant_monitor import PlantMonitor
from cosim.balises.rollback import RollbackLocaliser
from cosim.balises.step_search import StepSearch, is_near
from cosim.balises.telegram import Crossing
from cosim.errors import CouplingError
from fmus.exchange.slave import CoSimulationFunctions, solver_of
from fmus.fmi.standard import TIME_TOLERANCE


class DenseOutputLocaliser(RollbackLocaliser):
    """Within each internal step of the solver the plant is looked at where the solver's polynomial puts it.

    Args:
        watch: the monitored plant. layout: where the balises are.

    Raises:
        CouplingError: no solver moves the plant here.
    """

    method: Method = "dense-output"

    def __init__(self, watch: PlantMonitor, layout: TrackLayout | InstantLayout) -> None:
        super().__init__(watch, layout)
        solver = solver_of(watch.component.slave)
        if solver is None:
            raise CouplingError(
                f"balises.method = 'dense-output': {watch.component.name} is no model exchange FMU, whose solver could "
                "be asked; use 'auto'."
            )
        self._solver: CoSimulationFunctions = solver
        self._found: list[tuple[Crossing, np.ndarray]] = []
        self._stood, self._at = (0.0, 0.0), np.nan

    def step(self, t: float, until: float) -> list[tuple[Crossing, np.ndarray]]:  # noqa: D102 - see Localiser
        if not self._may_pass(t, until):
            return super().step(t, until)  # nothing is met, and nothing redone
        self._found, self._stood, self._at = [], self.watch.motion, t
        self._solver.follow(self._part)
        try:
            self.watch.step(t, until)
        finally:
            self._solver.follow(None)
        return self._found

    def _may_pass(self, t: float, until: float) -> bool:
        if isinstance(self.layout, InstantLayout):
            return bool(self.layout.within(t, until))
        return is_near(*self.watch.motion, until - t, self.layout)

    def _part(self, begin: float, end: float) -> None:
        """Find the crossings of an internal step [s]; the plant stands at its end."""
        watch = self.watch
        watch.read()
        ahead, solver = watch.motion, self._solver
        solver.look(begin)
        watch.read()
        place, speed = watch.motion
        if begin == self._at:  # the very number where the part before it ended, so that no balise lies between
            place = self._stood[0]
        part = _Part(self, begin, HermiteStep(end - begin, place, speed, *ahead), solver)
        self._stood, self._at = ahead, end
        for stamp, balise in part.crossings(self.layout):
            part.go(stamp)
            self._found.append((self.crossing(stamp, balise, *watch.motion), watch.outputs.copy()))


class _Part(StepSearch):
    """One internal step of a solver, at any instant of which the plant can be put."""

    def __init__(self, localiser: Localiser, t: float, motion: HermiteStep, solver: CoSimulationFunctions) -> None:
        self.watch, self._hides, self._solver = localiser.watch, localiser.hides, solver
        self.t, self._hermite = t, motion

    def go(self, time: float) -> None:
        self._solver.look(time if time - self.t > TIME_TOLERANCE else self.t)
        self.watch.read()
