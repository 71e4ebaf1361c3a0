"""Iterate: loops are stepped again and again until what they feed back agrees; everything else is Gauss-Seidel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from cosim.coupling.plan import Plan
from cosim.coupling.planned import PlannedComponent
from cosim.master.algorithms.algorithm import Algorithm
from cosim.master.algorithms.links import plan_links
from cosim.master.algorithms.loop import IteratedLoop
from cosim.master.algorithms.settings import IterationSettings


class Iterate(Algorithm):
    """Implicit coupling of the loops, with the values at the end of the step.

    Args:
        plan: prepared, components initialised.
        loops: names of the components of each loop, consecutive in the plan.
        settings: method and tolerances.

    Source: R. Kuebler, W. Schiehlen, Two methods of simulator coupling, Mathematical and Computer Modelling of
    Dynamical Systems 6 (2000) 93-113; M. Busch, Zur effizienten Kopplung von Simulationsprogrammen, Kassel 2012,
    chapter 2.
    """

    name = "iterate"

    def __init__(self, plan: Plan, loops: Sequence[Sequence[str]], settings: IterationSettings | None = None) -> None:
        super().__init__(plan, loops)
        links = plan_links(plan)
        places = {step.component.name: place for place, step in enumerate(plan.steps)}
        self.loops: list[IteratedLoop] = []
        self._parts: list[PlannedComponent | IteratedLoop] = []
        first_of = {min(places[name] for name in names): names for names in loops}
        place = 0
        while place < len(plan.steps):
            if place not in first_of:
                self._parts.append(plan.steps[place])
                place += 1
                continue
            members = range(place, place + len(first_of[place]))
            assert {plan.steps[i].component.name for i in members} == set(first_of[place]), (
                "a loop is consecutive in its plan"
            )
            self.loops.append(IteratedLoop(plan, members, links, settings or IterationSettings()))
            self._parts.append(self.loops[-1])
            place = members.stop

    def advance(self, t: float, until: float) -> None:  # noqa: D102 - see Algorithm
        for part in self._parts:
            if isinstance(part, IteratedLoop):
                part.advance(t, until)
            else:
                part.step(t, until)

    def save(self) -> Any:  # noqa: D102 - see Algorithm
        return [loop.save() for loop in self.loops]

    def restore(self, state: Any) -> None:  # noqa: D102 - see Algorithm
        for loop, saved in zip(self.loops, state, strict=True):
            loop.restore(saved)

    def summary(self) -> Mapping[str, Any]:  # noqa: D102 - see Algorithm
        return {**super().summary(), "loops": [loop.summary() for loop in self.loops]}
