"""Clock connections: a triggered output clock of one component makes a triggered input clock of another one tick.

Written like any other connection (``a.tick -> b.trigger``). Knows components, not time.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from cosim.components.component import Component
from cosim.coupling.connection import Link, split_name, take_source
from cosim.errors import CouplingError
from fmus.fmi.elements import described

_CLOCK, _TRIGGERED = "Clock", "triggered"


@dataclass(frozen=True)
class ClockConnection:
    """Whenever the source ticks, the target is set active in the same event iteration.

    Args:
        source: (component, triggered output clock). target: (component, triggered input clock).
    """

    source: tuple[str, str]
    target: tuple[str, str]

    def __str__(self) -> str:
        return f"{'.'.join(self.source)} -> {'.'.join(self.target)}"


def connect_clocks(
    pairs: Sequence[Link], components: Mapping[str, Component]
) -> tuple[list[ClockConnection], list[Link]]:
    """Take the connections between clocks out of all connections.

    A connected input clock is no longer an event that somebody may announce (no balise event), and its clocked inputs
    may be connected like any others; to be called before `cosim.coupling.connection.connect`.

    Args:
        pairs: names of source and target. components: by name.

    Returns:
        The clock connections, and the other pairs.

    Raises:
        CouplingError: a clock joined to something else, a clock that ticks by itself, a component without Event Mode,
            or two sources for one clock.
    """
    clocks: list[ClockConnection] = []
    others: list[Link] = []
    taken: dict[tuple[str, str], str] = {}
    for pair in pairs:
        made = _clock_connection(pair, components)
        if made is None:
            others.append(pair)
            continue
        take_source(taken, made.target, pair[0], "clock")
        clocks.append(made)
        components[made.target[0]].events.pop(made.target[1], None)
    for _, target, *_ in others:
        _leave_to_connection(target, components)
    return clocks, others


def _leave_to_connection(target: str, components: Mapping[str, Component]) -> None:
    """An event whose count is connected is notified by its source, stamp and payload with it: the master has no part in
    it.
    """
    component, signal = split_name(target, components, "Connection target")
    events = components[component].events
    variable = components[component].variables.get(signal)
    for name, port in list(events.items()):
        if variable is not None and variable.valueReference == port.trigger:
            del events[name]


def _clock_connection(pair: Link, components: Mapping[str, Component]) -> ClockConnection | None:
    source = split_name(pair[0], components, "Connection source")
    target = split_name(pair[1], components, "Connection target")
    ends = [components[component].variable(name) for component, name in (source, target)]
    if all(variable.type != _CLOCK for variable in ends):
        return None
    where = f"Connection {pair[0]} -> {pair[1]}"
    if any(variable.type != _CLOCK for variable in ends):
        kinds = f"{pair[0]} is a {described(ends[0])}, {pair[1]} is a {described(ends[1])}"
        raise CouplingError(f"{where}: {kinds}; a clock is connected to a clock.")
    components[source[0]].variable(source[1], "output")
    components[target[0]].variable(target[1], "input")
    kind = ends[1].intervalVariability
    if kind != _TRIGGERED:
        raise CouplingError(
            f"{where}: {pair[1]} ticks at its own instants (intervalVariability '{kind}'); leave it unconnected."
        )
    for name in (source[0], target[0]):
        if not components[name].capabilities.hasEventMode:
            raise CouplingError(f"{where}: {name} has no Event Mode (hasEventMode), so its clocks never tick.")
    return ClockConnection(source, target)
