"""From the components and connections of a scenario to what is coupled, checked; from that to the plan of a run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from cosim.components.component import Component
from cosim.components.recording import RecordingComponent
from cosim.coupling.clocks import ClockConnection, connect_clocks
from cosim.coupling.connection import Connection, Link, connect
from cosim.network.outputs import NAME as NETWORK
from cosim.run.network import Network, make_network
from cosim.run.network_connections import connect_over
from cosim.run.task import RunTask
from fmus.fmi.types import is_continuous
from plant_models.hybrid.units import Unit


@dataclass(frozen=True)
class Coupled:
    """What hangs together in a run.

    Args:
        components: by name. connections: as they stand in the scenario. routed: the same as the plan takes them, with
            the network as source of what travels over it. clocks: connections between clocks. network: None without.
    """

    components: Mapping[str, Component]
    connections: list[Connection]
    routed: list[Connection]
    clocks: list[ClockConnection]
    network: Network | None

    @property
    def sources(self) -> Mapping[str, Component]:
        """All that has outputs: the components, and the network where there is one."""
        return self.components if self.network is None else {**self.components, NETWORK: self.network.outputs}

    def unit(self, name: str) -> Unit | None:
        """Unit of a recorded signal; None where it has none.

        Args:
            name: ``component.signal``.
        """
        component, _, signal = name.partition(".")
        return self.sources[component].unit(signal)

    @property
    def stepped(self) -> list[Connection]:
        """Connections between components that are stepped."""
        return [c for c in self.routed if c.source[0] != NETWORK]


def couple(task: RunTask, links: Sequence[Link], components: Mapping[str, Component]) -> Coupled:
    """Check the connections of a scenario, and lead over its network what travels over it.

    Args:
        task: of the run. links: as they stand in the scenario. components: by name, loaded or described.

    Raises:
        ScenarioError, CouplingError: a connection, clock or network that cannot be.
    """
    clocks, pairs = connect_clocks(links, components)
    network = make_network(task.table, components, task.folder, task.where)
    if network is None:
        connections = routed = connect(pairs, components)
    else:
        network, connections, routed = connect_over(network, task.table, pairs, components, task.where)
    _settle_recordings(components, routed)
    return Coupled(components, connections, routed, clocks, network)


def _settle_recordings(components: Mapping[str, Component], connections: Sequence[Connection]) -> None:
    """Columns of tables of which nobody said whether they are held: they are where a target of theirs is discrete."""
    for c in connections:
        source = components.get(c.source[0])
        if isinstance(source, RecordingComponent):
            target = components[c.target[0]].variables[c.target[1]]
            flows = is_continuous(target) and not c.table
            source.connected(c.source[1], flows=flows, target=".".join(c.target))
