"""Whether a run needs a coordinator, and who takes part. Reads the plan."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from cosim.balises.early_return import EarlyReturnLocaliser
from cosim.components.fmi3 import FMI3Component
from cosim.coupling.plan import Plan
from cosim.coupling.planned import PlannedComponent
from cosim.master.events.coordinator import EventCoordinator
from cosim.master.events.gates import Gate, clock_references
from cosim.master.events.participant import Participant
from fmus.fmi.standard import OWN_TOOL

if TYPE_CHECKING:
    from cosim.master.system import System

Events = Literal["propagate", "local"]
UNTOUCHED = {"String", "Binary", "Int64", "UInt64"}
"""Types that may travel as they are, not as columns of the plan."""


def make_coordinator(system: System, events: Events) -> EventCoordinator | None:
    """The coordinator that a system needs; None where no event of a component concerns another one.

    A watched plant that reports balises by early return is left to its localiser.

    Args:
        system: plan, algorithm and balises in place, components not initialised.
        events: ``propagate``, or ``local``: every component handles its own events for itself.
    """
    balises = system.balises
    alone = balises.plant if balises is not None and isinstance(balises.localiser, EarlyReturnLocaliser) else None
    capable = [step for step in system.plan.steps if has_event_mode(step) and step.component.name != alone]
    if events == "local":
        for step in capable:
            _never_send_clocked(step)
        return None
    concerned = {step.component.name for step in capable if _is_concerned(step, system.plan)}
    if not concerned:
        return None
    participants = {
        s.component.name: Participant(s, gives=_gives(s, system.plan)) for s in capable if s.component.name in concerned
    }
    for wire in system.plan.clocks:
        if wire.source[0] in participants and wire.target[0] in participants:
            source, target = participants[wire.source[0]], participants[wire.target[0]]
            clocks = [
                p.component.variables[c].valueReference for p, c in ((source, wire.source[1]), (target, wire.target[1]))
            ]
            source.wires.setdefault(clocks[0], []).append((target, clocks[1]))
    return EventCoordinator(system, list(participants.values()))


def has_event_mode(step: PlannedComponent) -> bool:
    """Whether a component can take part in events at all."""
    return isinstance(step.component, FMI3Component) and step.component.has_event_mode


def _is_concerned(step: PlannedComponent, plan: Plan) -> bool:
    """Whether its events may concern others, or those of others it."""
    component = step.component
    assert isinstance(component, FMI3Component)
    if component.clocks or any(component.name in (wire.source[0], wire.target[0]) for wire in plan.clocks):
        return True
    if _gives(step, plan) and not _waits_to_be_told(component):
        return True
    names = [*step.inputs.names, *(step.inputs.non_numeric.names if step.inputs.non_numeric is not None else ())]
    inputs = [component.variables[name] for name in names]
    return any(v.variability == "discrete" or clock_references(v) for v in inputs)


def _waits_to_be_told(component: FMI3Component) -> bool:
    """Whether its only events are those it is told: known of what this package makes that does not return early."""
    made_here = component.description.generationTool == OWN_TOOL
    return made_here and not component.capabilities.mightReturnEarlyFromDoStep


def _gives(step: PlannedComponent, plan: Plan) -> bool:
    """Whether an output or clock of it is connected."""
    component = step.component
    if any(component.name == wire.source[0] for wire in plan.clocks):
        return True
    if any(
        ((s.inputs.sources >= step.columns.start) & (s.inputs.sources < step.columns.stop)).any() for s in plan.steps
    ):
        return True
    return len(plan.non_numeric) > 0 and any(
        v.causality == "output" and v.type in UNTOUCHED for v in component.variables.values()
    )


def _never_send_clocked(step: PlannedComponent) -> None:
    if any(clock_references(step.component.variables[name]) for name in step.inputs.names):
        Gate(step.component, step.inputs, events_pass=False)
