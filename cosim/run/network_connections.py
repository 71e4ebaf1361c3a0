"""From the connections of a scenario with a network to those that the plan takes, and to who listens and reads.

A connection travels where a node owns its source and its target is a receiver. To a field of an event it comes by the
packet itself; any other input reads what arrived last.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from cosim.components.component import Component
from cosim.coupling.connection import Connection, Link, connect, event_connection, split_name
from cosim.errors import ScenarioError, nearest
from cosim.network.intervals import longest_interval
from cosim.network.outputs import NAME, NetworkOutputs, PacketReader, arrived_name
from cosim.network.service import Field, PacketListener
from cosim.network.settings import NetworkSettings
from cosim.run.component_models import make_system, values_in_use
from cosim.run.network import Network, NetworkReading, is_wired
from cosim.scenario.scenario_tables import ComponentTable
from cosim.scenario.schema import ScenarioTable

READINGS = "measured_", "odometer", "fix_position"
"""How the inputs begin by which an observer reads a measurement whenever it likes."""
ROUNDING = 1e-9  # relative, of times


def connect_over(
    network: Network, table: ScenarioTable, pairs: Sequence[Link], components: Mapping[str, Component], where: str
) -> tuple[Network, list[Connection], list[Connection]]:
    """The connections of a scenario with a network.

    Args:
        network: before its connections are known. table: the scenario. pairs: as they stand in it. components: by name.
        where: name of the scenario, for messages.

    Returns:
        The network, with who listens and reads; connections as they stand in the scenario, without those to fields of
        events; and the same as the plan takes them, with the network as source of what travels over it.

    Raises:
        ScenarioError: an event is to carry a signal that no node owns.
        CouplingError: as for `connect`.
    """
    assert table.network is not None
    direct: list[Link] = []
    readings: list[NetworkReading] = []
    fields: dict[tuple[str, str], list[Field]] = {}
    for pair in pairs:
        component, name = split_name(pair[1], components, "Connection target")
        event = _event_of(components[component], name)
        travels = _travels(pair[0], component, network.settings, table.network.receivers)
        if event is not None and not is_wired(pairs, component, event):
            field = _field(pair, name, event, components, network.settings, travels, where)
            fields.setdefault((component, event), []).append(field)
            continue
        direct.append(pair)
        if travels:
            one = components[component], table.components[component]
            readings.append(_reading(pair[0], name, event, *one, network, where))
    connections = connect(direct, components)
    arriving = {(r.component, r.name): r.leaves_out and (network.loses or r.repeats) for r in readings}
    outputs = NetworkOutputs(network.settings, components, _readers(connections, arriving, readings, network.settings))
    network = replace(network, outputs=outputs, listeners=_listeners(fields, network.settings), readings=readings)
    return network, connections, [_routed(c, arriving) for c in connections]


def _travels(source: str, component: str, settings: NetworkSettings, receivers: Sequence[str] | None) -> bool:
    return source in settings.signals and (receivers is None or component in receivers)


def _event_of(component: Component, name: str) -> str | None:
    """The event that an input belongs to as a field, or None."""
    if name not in component.variables:
        return None
    reference = component.variables[name].valueReference
    return next((event for event, port in component.events.items() if reference in port.payload.values()), None)


def _field(
    pair: Link,
    name: str,
    event: str,
    components: Mapping[str, Component],
    settings: NetworkSettings,
    travels: bool,
    where: str,
) -> Field:
    """The part of a packet that a field of an event takes."""
    if not travels:
        raise ScenarioError(
            f"{where}: {pair[1]} is delivered by the event '{event}', and no node of the network owns {pair[0]}; "
            f"{nearest(pair[0], set(settings.signals))}"
        )
    made = event_connection(pair, components)
    return Field(name.removeprefix(f"{event}_"), settings.signals.index(pair[0]), made.factor, made.offset)


def _reading(
    source: str,
    name: str,
    event: str | None,
    component: Component,
    table: ComponentTable,
    network: Network,
    where: str,
) -> NetworkReading:
    """What an input reads of a signal that travels."""
    # fields of a wired event are read when it occurs, and its count is not lost without them
    able = event is None and component.can_be_missing(name)
    samples = None if event else _samples(table, component, name, where)
    repeats = samples is not None and _is_faster(samples[0], network.settings, source)
    return NetworkReading(source, component.name, name, able, samples, repeats, event is not None)


def _readers(
    connections: Sequence[Connection],
    arriving: Mapping[tuple[str, str], bool],
    readings: Sequence[NetworkReading],
    settings: NetworkSettings,
) -> list[PacketReader]:
    """Inputs with an output of the network of their own, which is missing where nothing new arrived."""
    number_of = {signal: i for i, signal in enumerate(settings.signals)}
    sampled = {(r.component, r.name): r.samples for r in readings if r.leaves_out and r.samples is not None}
    return [
        PacketReader(".".join(c.target), number_of[".".join(c.source)], *sampled.get(c.target_variable, ()))
        for c in connections
        if arriving.get(c.target_variable)
    ]


def _listeners(fields: Mapping[tuple[str, str], Sequence[Field]], settings: NetworkSettings) -> list[PacketListener]:
    """Events by which components are notified of packets."""
    node_of = settings.node_of
    return [
        PacketListener(component, event, tuple(parts), frozenset(node_of[part.signal] for part in parts))
        for (component, event), parts in sorted(fields.items())
    ]


def _routed(connection: Connection, arriving: Mapping[tuple[str, str], bool]) -> Connection:
    """The connection as the plan takes it: from the network what arrived, where its target leaves out what did not, or
    the last value.
    """
    missing = arriving.get(connection.target_variable)
    if missing is None:
        return connection
    output = arrived_name(".".join(connection.target)) if missing else ".".join(connection.source)
    return replace(connection, source=(NAME, output), source_array="", exact=False)


def _samples(table: ComponentTable, component: Component, name: str, where: str) -> tuple[float, float] | None:
    """Period and offset [s] of the samples at which a component reads an input; None where it does not stop at them,
    reads it all the time, or nobody knows.
    """
    if not component.can_vary_step or table.every > 1:
        return None
    if table.filter is not None:
        period = table.filter.sample_period if name.startswith("measured_") else None
        return None if period is None else (period, period)
    system: Any = None if table.observer is None else make_system(table, where)
    if system is None:
        return None
    events = [e for e in system.periodic_events if name.partition("[")[0] in e.samples]
    if not events and name.startswith(READINGS):
        events = list(system.periodic_events)
    if len(events) != 1:
        return None
    values = values_in_use(table, system)
    period, offset = (0.0 if n is None else float(getattr(values, n)) for n in (events[0].period, events[0].offset))
    return (period, offset) if period > 0.0 else None


def _is_faster(period: float, settings: NetworkSettings, source: str) -> bool:
    """Whether samples every so often [s] may find nothing new of a signal that is not lost."""
    node = settings.node_of[settings.signals.index(source)]
    longest, _ = longest_interval(replace(settings, loss_fraction=0.0), [node])
    shortest, latest = settings.delay_range
    return longest is None or period * (1.0 + ROUNDING) < longest + latest - shortest
