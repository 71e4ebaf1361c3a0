"""Instants: at which end of a step the targets of a signal take it. Pure graph work on names and descriptions.

A signal means the same instant in all its targets. It is *fresh* where its source is stepped before all of them: each
takes the value at the end of the step. Else it is *held*: each takes the value at the start of the step, also those
stepped after the source.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from cosim.components.component import Component
from cosim.coupling.connection import Connection
from fmus.fmi.types import FLOATING_TYPES

Signal = tuple[str, str]
"""(component, variable) of a source; an array is one signal."""


def held_signals(
    components: Mapping[str, Component],
    connections: Sequence[Connection],
    order: Sequence[str],
    iterated: Sequence[Sequence[str]] = (),
) -> frozenset[Signal]:
    """The signals that are held; all others are fresh.

    Besides those with a target that is stepped no later than the source these are: what a target takes at events only,
    and what was held in the run that a recording plays back.

    Args:
        components: by name. connections: checked. order: of execution.
        iterated: names of the components of each loop that is iterated; within it all values are those of the end of
            the step.
    """
    place = {name: i for i, name in enumerate(order)}
    loop_of = {name: i for i, loop in enumerate(iterated) for name in loop}

    def holds(c: Connection) -> bool:
        source, target = c.source[0], c.target[0]
        if source not in place:
            return True  # it is not stepped: its values change between steps only
        together = source in loop_of and loop_of[source] == loop_of.get(target)
        if place[target] <= place[source] and not together:
            return True
        return c.source[1] in components[source].held_outputs or _waits_for_events(
            components[source], components[target], c
        )

    return frozenset(c.source_variable for c in connections if holds(c))


def _waits_for_events(source: Component, target: Component, connection: Connection) -> bool:
    """Whether the target is told at the end of the step, by an event, of what the source changes within the step."""
    if not target.capabilities.hasEventMode or source.capabilities.hasEventMode:
        return False
    variable = target.variables[connection.target[1]]
    flows = variable.type in FLOATING_TYPES and variable.variability in (None, "continuous") and not variable.clocks
    return not flows
