"""Instants: at which end of a step the targets of a signal take it. Pure graph work on names and descriptions.

A signal means the same instant in all its targets. It is *fresh* where its source is stepped before all of them: each
takes the value at the end of the step. Else it is *held*: each takes the value at the start of the step, also those
stepped after the source. A column of a table is held, or a *line*: each takes its course within the step.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from cosim.components.component import Component
from cosim.components.recording import RecordingComponent
from cosim.components.recording_data import Recording
from cosim.coupling.connection import Connection
from fmus.fmi.types import is_continuous

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
    what was held in the run that a recording plays back, also between others, and held columns of tables.

    Args:
        components: by name. connections: checked. order: of execution.
        iterated: names of the components of each loop that is iterated; within it all values are those of the end of
            the step.
    """
    place = {name: i for i, name in enumerate(order)}
    loop_of = {name: i for i, loop in enumerate(iterated) for name in loop}
    recorded = {link for recording in _played(components) for link in recording.held_links}

    def holds(c: Connection) -> bool:
        source, target = c.source[0], c.target[0]
        if source in components and c.source[1] in components[source].line_outputs:
            return False
        if source not in place or str(c) in recorded:  # what is not stepped changes between steps only
            return True
        together = source in loop_of and loop_of[source] == loop_of.get(target)
        if place[target] <= place[source] and not together:
            return True
        return c.source[1] in components[source].held_outputs or _waits_for_events(
            components[source], components[target], c
        )

    return frozenset(c.source_variable for c in connections if holds(c))


def recorded_order(components: Mapping[str, Component], connections: Sequence[Connection]) -> list[tuple[str, str]]:
    """Pairs (source, target) of connections that were fresh in a run a part of which is played back: without that part
    there are fewer loops, and another order would make other signals held.

    Args:
        components: by name. connections: checked.
    """
    fresh = {link for recording in _played(components) for link in recording.fresh_links}
    return sorted({(c.source[0], c.target[0]) for c in connections if str(c) in fresh and c.source[0] != c.target[0]})


def _played(components: Mapping[str, Component]) -> list[Recording]:
    return [c.recording for c in components.values() if isinstance(c, RecordingComponent)]


def followed(components: Mapping[str, Component], connections: Sequence[Connection]) -> frozenset[Signal]:
    """The signals whose targets follow lines that are known ahead, whatever the algorithm.

    Args:
        components: by name. connections: checked.
    """
    return frozenset(
        c.source_variable
        for c in connections
        if c.source[0] in components and c.source[1] in components[c.source[0]].line_outputs
    )


def _waits_for_events(source: Component, target: Component, connection: Connection) -> bool:
    """Whether the target is notified at the end of the step, by an event, of what the source changes within it."""
    if not target.capabilities.hasEventMode or source.capabilities.hasEventMode:
        return False
    variable = target.variables[connection.target[1]]
    return not is_continuous(variable) or bool(variable.clocks)
