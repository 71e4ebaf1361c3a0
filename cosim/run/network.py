"""The network of a scenario: which connections travel over it, and who is told of packets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from cosim.components.component import Component
from cosim.coupling.connection import Connection, Link, connect, event_connection, split_name
from cosim.coupling.plan import Plan
from cosim.errors import ScenarioError, nearest
from cosim.network.intervals import longest_interval
from cosim.network.outputs import NAME, NetworkOutputs, PacketReader, arrived_name
from cosim.network.service import Field, NetworkService, PacketListener, ages
from cosim.network.settings import NetworkSettings
from cosim.results.result_data import PacketRecord
from cosim.run.component_models import make_system, values_in_use
from cosim.scenario.network_table import network_settings
from cosim.scenario.scenario_tables import ComponentTable
from cosim.scenario.schema import ScenarioTable
from fmu_observer.event_protocol import DEFAULT_REPLAY_HORIZON

READINGS = "measured_", "odometer"
"""How the inputs begin by which an observer reads a measurement whenever it likes."""
ROUNDING = 1e-9  # relative, of times


@dataclass
class Network:
    """What a scenario's network does to its connections.

    Args:
        settings: of the network. outputs: its face among the components.
        listeners: who is told by events. held: by signal, who holds it.
        left_out, stale: ``component.input`` that leave out what is lost, and that hold what came before it.
        read_once, repeated: ``component.input`` that sample between two packets, and leave out what they have read; or
            that take it for a new reading, or of which nobody knows when they sample.
    """

    settings: NetworkSettings
    outputs: NetworkOutputs
    listeners: list[PacketListener] = field(default_factory=list)
    held: dict[str, list[str]] = field(default_factory=dict)
    left_out: list[str] = field(default_factory=list)
    stale: list[str] = field(default_factory=list)
    read_once: list[str] = field(default_factory=list)
    repeated: list[str] = field(default_factory=list)

    def service(self, plan: Plan, start: float) -> NetworkService:
        """The network for the master.

        Args:
            plan: with the network's outputs behind those of the components. start: of the run [s].
        """
        columns = np.array([plan.column(name) for name in self.settings.signals], dtype=np.intp)
        first = plan.column(f"{NAME}.{self.settings.signals[0]}")
        return NetworkService(self.settings, start, columns, first, self.listeners, self.held, self.outputs.readers)

    def notes(self) -> list[str]:
        """What is done where a packet is lost, and at samples between two packets."""
        told = (
            (self.read_once, "A reading is read once, and missing and left out until the next packet arrives, at"),
            (self.repeated, "Samples between two packets take the last reading for a new one, at"),
            (self.left_out, "A reading whose packet is lost is missing, and left out, at"),
            (self.stale, "Where a packet is lost the last reading stays, and is taken for a new one, at"),
        )
        return [f"{text} {', '.join(names)}." for names, text in told if names]

    def hidden(self, components: Mapping[str, Component]) -> dict[str, list[str]]:
        """Local variables that it measures, by component: they are read though no connection asks for them.

        Args:
            components: by name.
        """
        found: dict[str, list[str]] = {}
        for component, signal in self.outputs.sources:
            if components[component].variable(signal).causality == "local":
                found.setdefault(component, []).append(signal)
        return found


def make_network(table: ScenarioTable, components: Mapping[str, Component], folder: Path, where: str) -> Network | None:
    """The network of a scenario, before its connections are known; None where it has none.

    Args:
        table: the scenario. components: by name. folder: start of relative paths. where: name of the scenario, for
            messages.

    Raises:
        ScenarioError, CouplingError: a signal or receiver does not exist; delays that cannot be.
    """
    if table.network is None:
        return None
    if NAME in components:
        raise ScenarioError(f"{where}: a component cannot be called {NAME!r} where there is a network; rename it.")
    for name in table.network.receivers or ():
        if name not in components:
            raise ScenarioError(f"{where}: network.receivers: no component {name!r}; {nearest(name, components)}")
    settings = network_settings(table.network, folder, where)
    return Network(settings, NetworkOutputs(settings, components))


def connect_over(
    network: Network, table: ScenarioTable, pairs: Sequence[Link], components: Mapping[str, Component], where: str
) -> tuple[list[Connection], list[Connection]]:
    """The connections of a scenario with a network.

    Args:
        network: which is told who listens. table: the scenario. pairs: as they stand in it. components: by name.
        where: name of the scenario, for messages.

    Returns:
        Connections as they stand in the scenario, without those to fields of events; and the same as the plan takes
        them, with the network as source of what travels over it.

    Raises:
        ScenarioError: an event is to be told of a signal that no node owns, or of several networks' worth of nothing.
        CouplingError: as for `connect`.
    """
    assert table.network is not None
    owned, told = set(network.settings.signals), table.network.receivers
    direct: list[Link] = []
    over: dict[tuple[str, str], bool] = {}
    sampled: dict[tuple[str, str], tuple[float, float]] = {}
    loses = network.settings.loss_fraction > 0.0
    fields: dict[tuple[str, str], list[Field]] = {}
    for pair in pairs:
        source, target = pair[0], pair[1]
        component, name = split_name(target, components, "Connection target")
        event = _event_of(components[component], name)
        travels = source in owned and (told is None or component in told)
        if event is not None and not is_wired(pairs, component, event):
            if not travels:
                raise ScenarioError(
                    f"{where}: {target} is told by the event '{event}', and no node of the network owns {source}; "
                    f"{nearest(source, owned)}"
                )
            made = event_connection(pair, components)
            number = network.settings.signals.index(source)
            part = Field(name.removeprefix(f"{event}_"), number, made.factor, made.offset)
            fields.setdefault((component, event), []).append(part)
            continue
        direct.append(pair)
        if travels:
            # fields of a wired event are read when it occurs, and its count is not lost without them
            able = event is None and components[component].can_be_missing(name)
            samples = None if event else _samples(table.components[component], components[component], name, where)
            repeats = samples is not None and _is_faster(samples[0], network.settings, source)
            if able and samples is not None:
                sampled[component, name] = samples
            over[component, name] = able and (loses or repeats)
            network.held.setdefault(source, []).append(component)
            if repeats or (able and samples is None):
                (network.read_once if able and repeats else network.repeated).append(target)
            if loses and event is None:
                (network.left_out if able else network.stale).append(target)
    connections = connect(direct, components)
    number_of = {signal: i for i, signal in enumerate(network.settings.signals)}
    readers = [
        PacketReader(".".join(c.target), number_of[".".join(c.source)], *sampled.get(c.target_variable, ()))
        for c in connections
        if over.get(c.target_variable)
    ]
    network.outputs = NetworkOutputs(network.settings, components, readers)
    node_of = network.settings.node_of
    network.listeners += [
        PacketListener(component, event, tuple(parts), frozenset(node_of[part.signal] for part in parts))
        for (component, event), parts in sorted(fields.items())
    ]
    routed = [
        replace(c, source=(NAME, _received(c, over)), source_array="", exact=False) if c.target_variable in over else c
        for c in connections
    ]
    return connections, routed


def _received(connection: Connection, leaves_out: Mapping[tuple[str, str], bool]) -> str:
    """The network's output that a target takes: what arrived, where it leaves out what did not, or the last value."""
    leaves = leaves_out[connection.target_variable]
    return arrived_name(".".join(connection.target)) if leaves else ".".join(connection.source)


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


def network_warnings(
    network: Network, table: ScenarioTable, components: Mapping[str, Component], where: str
) -> list[str]:
    """What to know of late packets before the run.

    Args:
        network: of the scenario. table: the scenario. components: by name. where: name of the scenario, for messages.

    Raises:
        ScenarioError: packets take longer than a receiver can go back.
    """
    shortest, longest = network.settings.delay_range
    sources = sorted({name for name, _ in network.outputs.sources})
    warnings = [
        f"{name} takes whole steps: packets sent between two of its points carry what it was at the earlier one."
        for name in sources
        if not components[name].can_vary_step or table.components[name].every > 1
    ]
    for name in sorted({listener.component for listener in network.listeners}):
        component, own = components[name], table.components[name]
        one_a_step = component.event_needs_step and not component.can_vary_step
        if one_a_step and network.settings.period < table.step:
            warnings.append(
                f"{name} takes whole communication steps and can be told of one packet in each: of packets every "
                f"{network.settings.period:g} s ever more wait. Use a step that is no longer."
            )
        sealed = component.kind == "FMU" and "late_policy" not in component.variables
        if sealed:
            if longest > 0.0:
                warnings.append(
                    f"{name} is told of packets late, and is an FMU without the parameter late_policy: what it does "
                    f"with their stamps is its own choice."
                )
            continue
        if own.late_policy not in (None, "replay"):
            continue
        horizon = DEFAULT_REPLAY_HORIZON if own.replay_horizon is None else own.replay_horizon
        if shortest > horizon:
            raise ScenarioError(
                f"{where}: packets take {shortest:g} s at least, and {name} can go back {horizon:g} s: it would reject "
                f"all of them. Set components.{name}.replay_horizon to {shortest:g} s or more."
            )
        if horizon < longest < inf:
            warnings.append(
                f"Packets take up to {longest:g} s, and {name} can go back {horizon:g} s: what is older is rejected."
            )
    return warnings


def network_summary(network: Network, records: Sequence[PacketRecord], start: float, stop: float) -> dict[str, Any]:
    """What became of the packets, for the summary.

    Args:
        network: of the run. records: of the run. start, stop: of the run [s].
    """
    settings = network.settings
    old = ages(records, settings, start, stop)
    return {
        "protocol": settings.protocol,
        "period": settings.period,
        "nodes": {node.name: list(node.signals) for node in settings.nodes},
        "packets": {
            node.name: _counts([r for r in records if r.node == node.name]) | old[node.name] for node in settings.nodes
        },
    }


def _counts(records: Sequence[PacketRecord]) -> dict[str, Any]:
    kinds = [record.kind for record in records]
    outcomes = [set(record.outcomes.values()) for record in records]
    arrived = sorted((r.delivered_at, r.stamp) for r in records if r.kind != "lost")
    stamps = [r.stamp for r in records if r.kind != "duplicate"]
    return {
        "sent": kinds.count("sent") + kinds.count("lost"),
        "lost": kinds.count("lost"),
        "duplicates": kinds.count("duplicate"),
        "overtaken": sum(1 for a, b in pairwise(arrived) if b[1] < a[1]),
        "undelivered": sum("undelivered" in found for found in outcomes),
        "largest_gap": max((b - a for a, b in pairwise(stamps)), default=None),
    }


def _event_of(component: Component, name: str) -> str | None:
    """The event that an input belongs to as a field, or None."""
    if name not in component.variables:
        return None
    reference = component.variables[name].valueReference
    return next((event for event, port in component.events.items() if reference in port.payload.values()), None)


def is_wired(pairs: Sequence[Link], component: str, event: str) -> bool:
    """Whether somebody else tells of an event: its count or clock has a source.

    Args:
        pairs: connections of the scenario. component: whose event. event: its name.
    """
    return any(pair[1] in (f"{component}.{event}", f"{component}.{event}_count") for pair in pairs)
