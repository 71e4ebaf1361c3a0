"""From a network to what to know of late packets before the run, and what became of packets after it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from math import inf
from typing import Any

from cosim.components.component import Component
from cosim.errors import ScenarioError
from cosim.evaluation.event_counts import USED
from cosim.network.service import ages
from cosim.network.settings import NetworkSettings
from cosim.results.result_data import PacketRecord
from cosim.run.network import Network
from cosim.run.observer_findings import GapSeen
from cosim.scenario.scenario_tables import ComponentTable
from cosim.scenario.schema import ScenarioTable
from fmu_observer.event_protocol import DEFAULT_REPLAY_HORIZON


def network_warnings(
    network: Network, table: ScenarioTable, components: Mapping[str, Component], where: str
) -> list[str]:
    """What to know of late packets before the run.

    Args:
        network: of the scenario. table: the scenario. components: by name. where: name of the scenario, for messages.

    Raises:
        ScenarioError: packets take longer than a receiver can go back.
    """
    sources = sorted({name for name, _ in network.outputs.sources})
    warnings = [
        f"{name} takes whole steps: packets sent between two of its points carry what it was at the earlier one."
        for name in sources
        if not components[name].can_vary_step or table.components[name].every > 1
    ]
    for name in sorted({listener.component for listener in network.listeners}):
        warnings += _one_a_step(components[name], network.settings.period, table.step)
        warnings += _too_late(components[name], table.components[name], network.settings, where)
    return warnings


def _one_a_step(component: Component, period: float, step: float) -> list[str]:
    """A receiver that can be notified once in a step, of packets that come more often."""
    one_a_step = component.event_needs_step and not component.can_vary_step
    if not one_a_step or period >= step:
        return []
    return [
        f"{component.name} takes whole communication steps and can be notified of one packet in each: of packets every "
        f"{period:g} s ever more wait. Use a step that is no longer."
    ]


def _too_late(component: Component, own: ComponentTable, settings: NetworkSettings, where: str) -> list[str]:
    """A receiver that cannot go back to the stamps of late packets, or does not say what it does with them."""
    name, (shortest, longest) = component.name, settings.delay_range
    if component.kind == "FMU" and "late_policy" not in component.variables:
        text = (
            f"{name} is notified of packets late, and is an FMU without the parameter late_policy: what it does with "
            f"their stamps is its own choice."
        )
        return [text] if longest > 0.0 else []
    if own.late_policy not in (None, "replay"):
        return []
    horizon = DEFAULT_REPLAY_HORIZON if own.replay_horizon is None else own.replay_horizon
    if shortest > horizon:
        raise ScenarioError(
            f"{where}: packets take {shortest:g} s at least, and {name} can go back {horizon:g} s: it would reject "
            f"all of them. Set components.{name}.replay_horizon to {shortest:g} s or more."
        )
    text = f"Packets take up to {longest:g} s, and {name} can go back {horizon:g} s: what is older is rejected."
    return [text] if horizon < longest < inf else []


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


def packet_gaps(network: Network, records: Sequence[PacketRecord], start: float) -> dict[str, GapSeen]:
    """The longest time between packets that a component used, of those that are notified of packets.

    Args:
        network: of the run. records: of the run. start: of the run [s].
    """
    names, found = [node.name for node in network.settings.nodes], dict[str, GapSeen]()
    for listener in network.listeners:
        name, nodes = listener.component, {names[i] for i in listener.nodes}
        stamps = sorted(r.stamp for r in records if r.node in nodes and r.outcomes.get(name) in USED)
        gap = max((b - a for a, b in pairwise([start, *stamps])), default=None)
        found[name] = max(found.get(name, GapSeen(None, "packets")), GapSeen(gap, "packets"), key=lambda g: g[0] or 0.0)
    return found


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
