"""Localisation by early return: an FMI 3 plant with event mode reports the crossing itself."""

from __future__ import annotations

from typing import Any

import numpy as np

from cosim.balises.layout import InstantLayout, TrackLayout
from cosim.balises.localiser import Localiser, Method
from cosim.balises.plant_monitor import PlantMonitor
from cosim.balises.telegram import Crossing
from cosim.components.fmi3 import FMI3Component
from cosim.errors import CouplingError
from fmus.fmi.standard import MAX_RETURNS_PER_STEP, TIME_TOLERANCE


class EarlyReturnLocaliser(Localiser):
    """The plant returns early from its step at a balise, and its output clock ticks.

    Args:
        clock: name of the plant's triggered output clock.
        watch: the monitored plant. layout: where the balises are.

    Raises:
        CouplingError: the plant has no event mode, or no such clock.
    """

    method: Method = "early-return"

    def __init__(self, watch: PlantMonitor, layout: TrackLayout | InstantLayout, clock: str) -> None:
        super().__init__(watch, layout)
        component = watch.component
        if not isinstance(component, FMI3Component) or not component.has_event_mode:
            raise CouplingError(f"{component.name}: 'early-return' needs an FMI 3 plant with event mode.")
        self._plant = component
        self._clock = component.output_clock(clock)
        self._count = 0

    def step(self, t: float, until: float) -> list[tuple[Crossing, np.ndarray]]:  # noqa: D102 - see Localiser
        plant, watch = self._plant, self.watch
        crossings: list[tuple[Crossing, np.ndarray]] = []
        watch.send(t, until)
        for _ in range(MAX_RETURNS_PER_STEP):
            t, event = plant.step(t, plant.next_stop(t, until))
            if not plant.terminated and plant.is_event(t, event) and plant.report_clock(self._clock):
                watch.read()
                crossings.append((self._crossing(t), watch.outputs.copy()))
            if plant.terminated or until - t <= TIME_TOLERANCE:
                watch.read()
                return crossings
        raise plant.failure(f"returned early {MAX_RETURNS_PER_STEP} times without reaching {until:g} s", t)

    def save(self) -> Any:  # noqa: D102 - see Localiser
        return self._count

    def restore(self, state: Any) -> None:  # noqa: D102 - see Localiser
        self._count = state

    def _crossing(self, stamp: float) -> Crossing:
        """The plant says that it passed a balise; which one and how accurately it is placed, the layout knows."""
        self._count += 1
        watch = self.watch
        bound = watch.error.time(stamp, watch.position, watch.speed)
        if not isinstance(self.layout, TrackLayout):
            return Crossing(stamp, watch.position, f"E{self._count}", 0.0, self.method, bound)
        balise = self.layout.nearest(watch.position)
        return Crossing(stamp, watch.position, balise.identity, balise.location_accuracy, self.method, bound)
