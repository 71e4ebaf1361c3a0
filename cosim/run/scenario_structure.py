"""From the task of a run to its structure: descriptions only, no FMU is built, loaded or instantiated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from cosim.components.component import Component
from cosim.coupling.connection import Connection, unconnected_inputs
from cosim.coupling.graph import Group, undeclared
from cosim.errors import CouplingError
from cosim.master.algorithms.choose import AlgorithmChoice, choose_algorithm
from cosim.run.balise_service import BaliseRoles, balise_roles
from cosim.run.connections import parse_connections
from cosim.run.coupled import Coupled, couple
from cosim.run.described_components import describe_component
from cosim.run.movement import movement_chains
from cosim.run.network import Network
from cosim.run.starts import names_with_starts
from cosim.run.step_schedule import stepping_groups
from cosim.run.task import RunTask
from cosim.scenario.schema import ScenarioTable
from cosim.structure.inspect import group_index, make_links, make_part, rate_text
from cosim.structure.run_structure import Structure
from cosim.structure.structure_data import Balises, Link, Packets


def scenario_structure(task: RunTask) -> Structure:
    """The structure of a validated scenario.

    Args:
        task: that would be run.

    Raises:
        CosimError: a component, connection or balise role that cannot be. A loop that nothing here solves is a warning
        of the structure.
    """
    with task.named_in_errors():
        table, where = task.table, task.where
        span = table.start, table.stop
        places = {n: f"{where}: components.{n}" for n in table.components}
        components = {n: describe_component(n, t, task.folder, places[n], span) for n, t in table.components.items()}
        coupled = couple(task, parse_connections(table.connections, where), components)
        roles = balise_roles(table.balises, components, where)
        return _structure(task, coupled, stepping_groups(table, coupled, roles), _balises(table, roles))


def _structure(task: RunTask, coupled: Coupled, groups: Sequence[Group], balises: Balises | None) -> Structure:
    table, components, connections, clocks = task.table, coupled.components, coupled.connections, coupled.clocks
    choice, refusal = _choice(table, groups, components)
    order = [n for group in groups for n in group.names]
    loops = [loop for group in groups for loop in group.algebraic]
    number = group_index(group.names for group in groups)
    rates = {n: rate_text(t.every, t.substeps) for n, t in table.components.items()}
    chains = movement_chains(table, coupled, order, choice, balises)
    return Structure(
        name=task.name,
        title=table.title,
        start=table.start,
        stop=table.stop,
        step=table.step,
        parts=tuple(make_part(components[n], connections, number[n], rates[n], clocks, chains[n]) for n in order),
        links=make_links(components, connections, choice, order, loops),
        clocks=tuple(Link(c.source, c.target) for c in clocks),
        groups=tuple(group.names for group in groups),
        loops=tuple(loop.path for loop in loops),
        algorithm=choice.algorithm,
        reason=choice.reason,
        balises=balises,
        network=None if coupled.network is None else _network(coupled.network),
        warnings=(*_warnings(table, components, connections), *choice.notes, *refusal),
    )


def _choice(
    table: ScenarioTable, groups: Sequence[Group], components: Mapping[str, Component]
) -> tuple[AlgorithmChoice, tuple[str, ...]]:
    """What steps the components, and why the run would be refused, if it would."""
    try:
        return choose_algorithm(table.master.algorithm, groups, components), ()
    except CouplingError as error:
        names = tuple(group.names for group in groups)
        refused = AlgorithmChoice(table.master.algorithm, "This run would be refused, see the warnings.", (), names)
        return replace(refused, algorithm="none" if refused.algorithm == "auto" else refused.algorithm), (str(error),)


def _balises(table: ScenarioTable, roles: BaliseRoles) -> Balises | None:
    balises = table.balises
    if balises is None:
        return None
    watched = balises.position or "", balises.speed or ""
    return Balises(roles.plant, *watched, tuple(roles.receivers), balises.method, balises.timing, balises.odometer)


def _network(network: Network) -> Packets:
    settings = network.settings
    listeners = [f"{one.component} ({one.event})" for one in network.listeners]
    held = sorted({name for names in network.held.values() for name in names})
    nodes = {node.name: node.signals for node in settings.nodes}
    return Packets(nodes, settings.protocol, settings.period, settings.delay_model, tuple(listeners), tuple(held))


def _warnings(table: ScenarioTable, components: Mapping[str, Component], connections: list[Connection]) -> list[str]:
    free = unconnected_inputs(connections, components.values(), names_with_starts(table))
    silent = undeclared(components.values())
    texts = [f"Unconnected inputs keep their start values: {', '.join(free)}."] if free else []
    return texts + (
        [f"Declare no dependencies, direct feedthrough assumed absent: {', '.join(silent)}."] if silent else []
    )
