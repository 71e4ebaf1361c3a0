"""Whether a run needs a coordinator, and who takes part. Known from descriptions and connections alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from fmpy.model_description import ModelVariable

from cosim.balises.early_return import EarlyReturnLocaliser
from cosim.components.component import Component
from cosim.components.fmi3 import FMI3Component
from cosim.coupling.clocks import ClockConnection
from cosim.coupling.connection import Connection
from cosim.master.events.coordinator import EventCoordinator
from cosim.master.events.gates import Gate
from cosim.master.events.participant import Participant
from cosim.master.system import System
from fmus.fmi.clocks import clock_references
from fmus.fmi.standard import OWN_TOOL

Events = Literal["propagate", "local"]
EXACT = {"String", "Binary", "Int64", "UInt64"}
"""Types that may travel as they are, not as columns of the plan."""


def make_coordinator(system: System, events: Events) -> EventCoordinator | None:
    """The coordinator that a system needs; None where no event of a component concerns another one and there is no
    network.

    Args:
        system: plan, algorithm and balises in place, components not initialised.
        events: ``propagate``, or ``local``: every component handles its own events for itself.
    """
    plan, balises = system.plan, system.balises
    alone = balises.plant if balises is not None and isinstance(balises.localiser, EarlyReturnLocaliser) else None
    part = taking_part(
        {s.component.name: s.component for s in plan.steps}, plan.connections, plan.clocks, events, alone
    )
    steps = {step.component.name: step for step in plan.steps}
    if events == "local":
        for name in part:
            Gate(steps[name].component, steps[name].inputs, events_pass=False)
        return None if system.network is None else EventCoordinator(system, [])
    if not part and system.network is None:
        return None
    participants = {name: Participant(steps[name], gives=gives) for name, gives in part.items()}
    for wire in plan.clocks:
        if wire.source[0] in participants and wire.target[0] in participants:
            source, target = participants[wire.source[0]], participants[wire.target[0]]
            clocks = [
                p.component.variables[c].valueReference for p, c in ((source, wire.source[1]), (target, wire.target[1]))
            ]
            source.wires.setdefault(clocks[0], []).append((target, clocks[1]))
    return EventCoordinator(system, list(participants.values()))


def taking_part(
    components: Mapping[str, Component],
    connections: Sequence[Connection],
    clocks: Sequence[ClockConnection],
    events: Events,
    alone: str | None,
) -> dict[str, bool]:
    """The components whose inputs are sent through a gate, and whether another one takes something from each.

    Args:
        components: by name, in execution order. connections: checked. clocks: connections between clocks.
        events: where they are ``propagate``d, all whose events concern others, or who are concerned by those of
            others; where they are ``local``, those with a clocked input, which is then never sent.
        alone: a watched plant that reports balises by early return, which is left to its localiser; or None.
    """
    coupling = _Coupling(connections, clocks)
    takes_part = coupling.sends_clocked if events == "local" else coupling.concerns
    return {
        name: coupling.gives(c)
        for name, c in components.items()
        if isinstance(c, FMI3Component) and c.has_event_mode and name != alone and takes_part(c)
    }


@dataclass(frozen=True)
class _Coupling:
    """Who takes what from whom.

    Args:
        connections: checked. clocks: connections between clocks.
    """

    connections: Sequence[Connection]
    clocks: Sequence[ClockConnection]

    def concerns(self, component: FMI3Component) -> bool:
        """Whether its events may concern others, or those of others it."""
        if component.clocks or any(component.name in (wire.source[0], wire.target[0]) for wire in self.clocks):
            return True
        if self.gives(component) and not _waits_to_be_notified(component):
            return True
        return any(v.variability == "discrete" or clock_references(v) for v in self._inputs(component))

    def gives(self, component: FMI3Component) -> bool:
        """Whether an output or clock of it is connected."""
        exact = any(c.exact for c in self.connections)
        return (
            any(component.name == wire.source[0] for wire in self.clocks)
            or any(component.name == c.source[0] and not c.exact for c in self.connections)
            or (exact and any(v.causality == "output" and v.type in EXACT for v in component.variables.values()))
        )

    def sends_clocked(self, component: FMI3Component) -> bool:
        """Whether an input with a clock is connected to a number."""
        return any(
            clock_references(component.variables[c.target[1]])
            for c in self.connections
            if c.target[0] == component.name and not c.exact
        )

    def _inputs(self, component: FMI3Component) -> list[ModelVariable]:
        return [component.variables[c.target[1]] for c in self.connections if c.target[0] == component.name]


def _waits_to_be_notified(component: FMI3Component) -> bool:
    """Whether its only events are those it is notified of: known of what this package makes that does not return
    early.
    """
    made_here = component.description.generationTool == OWN_TOOL
    return made_here and not component.capabilities.mightReturnEarlyFromDoStep
