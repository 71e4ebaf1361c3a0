"""From the components and connections of a scenario to what is coupled, checked; from that to the plan of a run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from cosim.components.component import Component
from cosim.coupling.clocks import ClockConnection, connect_clocks
from cosim.coupling.connection import Connection, Link, connect
from cosim.coupling.instants import settle_recordings
from cosim.coupling.plan import Plan, make_plan
from cosim.network.outputs import NAME as NETWORK
from cosim.run.network import Network, make_network
from cosim.run.network_connections import connect_over
from cosim.run.signal_roles import ROLES
from cosim.run.task import RunTask
from cosim.scenario.schema import ScenarioTable
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
    settle_recordings(components, routed)
    return Coupled(components, connections, routed, clocks, network)


def plan_run(table: ScenarioTable, coupled: Coupled, order: Sequence[str]) -> Plan:
    """The plan of a run; the components must be instantiated.

    Args:
        table: the scenario, with its roles. coupled: its components and connections. order: of execution.

    Raises:
        CouplingError: a variable to record does not exist or is not a number.
    """
    recorded, network = _signals_to_record(table), coupled.network
    if network is not None:
        for name, signals in network.hidden(coupled.components).items():
            recorded[name] += [signal for signal in signals if signal not in recorded[name]]
    outputs = None if network is None else network.outputs
    return make_plan(coupled.sources, coupled.routed, order, recorded, coupled.clocks, outputs)


def _signals_to_record(table: ScenarioTable) -> dict[str, list[str]]:
    """What is recorded besides the outputs, by component: what its table, balises, report and expectations name."""
    record = {name: list(component.record) for name, component in table.components.items()}
    used = [getattr(table.report, role) for role in ROLES]
    used += [] if table.balises is None else [table.balises.position, table.balises.speed, table.balises.odometer]
    used += [getattr(item, key, None) for item in table.expect for key in ("signal", "reference")]
    for name in filter(None, used):
        component, _, signal = name.partition(".")
        if component in record and signal not in record[component]:
            record[component].append(signal)
    return record
