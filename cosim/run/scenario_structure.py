"""The structure of a scenario before its run: descriptions only, no FMU is built, loaded or instantiated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from cosim.components.component import Component
from cosim.components.loading import describe_fmu, describe_system
from cosim.components.recording import RecordingComponent
from cosim.coupling.clocks import connect_clocks
from cosim.coupling.connection import Connection, connect, unconnected_inputs
from cosim.coupling.graph import Group, undeclared
from cosim.coupling.instants import settle_recordings
from cosim.errors import CosimError, CouplingError
from cosim.master.algorithms.choose import AlgorithmChoice, choose_algorithm
from cosim.network.outputs import NAME as NETWORK
from cosim.run.backends import intended
from cosim.run.balise_service import find_receivers, watched_plant
from cosim.run.component_models import filter_component, make_system, open_recording, python_component
from cosim.run.connections import parse_connections
from cosim.run.master_setup import stepping_groups
from cosim.run.movement import movement_chains
from cosim.run.network import Network, connect_over, make_network
from cosim.run.starts import given_values
from cosim.scenario.scenario_tables import ComponentTable
from cosim.scenario.schema import ScenarioTable
from cosim.structure.inspect import group_index, make_links, make_part, rate_text
from cosim.structure.run_structure import Structure
from cosim.structure.structure_data import Balises, Link, Packets


def scenario_structure(table: ScenarioTable, name: str, folder: Path, where: str) -> Structure:
    """The structure of a validated scenario.

    Args:
        table: the scenario. name: its name. folder: start of relative paths. where: place for messages.

    Raises:
        CosimError: a component, connection or balise role that cannot be. A loop that nothing here solves is told, not
        refused.
    """
    try:
        return _structure(table, name, folder, where)
    except CosimError as error:
        raise error if str(error).startswith(where) else type(error)(f"{where}: {error}") from error


def _structure(table: ScenarioTable, name: str, folder: Path, where: str) -> Structure:
    span = table.start, table.stop
    places = {n: f"{where}: components.{n}" for n in table.components}
    components = {n: describe_component(n, t, folder, places[n], span) for n, t in table.components.items()}
    clocks, pairs = connect_clocks(parse_connections(table.connections, where), components)
    network = make_network(table, components, folder, where)
    routed = connections = connect(pairs, components) if network is None else []
    if network is not None:
        connections, routed = connect_over(network, table, pairs, components, where)
    settle_recordings(components, routed)
    stepped = [c for c in routed if c.source[0] != NETWORK]
    balises = _balises(table, components, where)
    plant, receivers = ("", ()) if balises is None else (balises.plant, balises.receivers)
    groups = stepping_groups(table, components, stepped, plant, receivers)
    choice, refusal = _choice(table, groups, components)
    order = [n for group in groups for n in group.names]
    loops = [loop for group in groups for loop in group.algebraic]
    number = group_index(group.names for group in groups)
    rates = {n: rate_text(t.every, t.substeps) for n, t in table.components.items()}
    listeners = None if network is None else [listener.component for listener in network.listeners]
    chains = movement_chains(table, {n: components[n] for n in order}, routed, clocks, choice, balises, listeners)
    return Structure(
        name=name,
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
        network=None if network is None else _network(network),
        warnings=(*_warnings(table, components, connections), *choice.notes, *refusal),
    )


def describe_component(
    name: str, table: ComponentTable, folder: Path, where: str, span: tuple[float, float] | None = None
) -> Component:
    """A component that can be asked and not stepped.

    Args:
        name: of the component. table: its table. folder: start of relative paths. where: place for messages.
        span: start and stop of the run [s], which a recording must cover; None where it does not matter.

    Raises:
        ScenarioError, FmuLoadError: the component cannot be made.
    """
    system = make_system(table, where)
    component: Component
    if table.recording is not None:
        component = RecordingComponent(name, open_recording(name, table, folder, where, span))
    elif table.filter is not None:
        component = filter_component(name, table, folder, where)
    elif system is None and table.fmu is None:
        component = python_component(name, table, where)
    elif system is None:
        component = describe_fmu((folder / str(table.fmu)).resolve(), name)
    else:
        backend = intended(table, system)
        version: Any = int(backend[-1])
        # the exported FMU carries the same description
        component = describe_system(system, name, version, table.preset)
        component.kind = "block" if backend.startswith("block") else "FMU"
    component.configure(table.parameters)
    component.declare_missing(table.can_be_missing, where)
    return component


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


def _balises(table: ScenarioTable, components: Mapping[str, Component], where: str) -> Balises | None:
    balises = table.balises
    if balises is None:
        return None
    plant = watched_plant(balises, components, where)
    told = find_receivers(balises, components, plant, where)
    watched = balises.position or "", balises.speed or ""
    return Balises(plant, *watched, tuple(told), balises.method, balises.timing, balises.odometer)


def _network(network: Network) -> Packets:
    settings = network.settings
    told = [f"{one.component} ({one.event})" for one in network.listeners]
    held = sorted({name for names in network.held.values() for name in names})
    nodes = {node.name: node.signals for node in settings.nodes}
    return Packets(nodes, settings.protocol, settings.period, settings.delay_model, tuple(told), tuple(held))


def _warnings(table: ScenarioTable, components: Mapping[str, Component], connections: list[Connection]) -> list[str]:
    free = unconnected_inputs(connections, components.values(), given_values(table))
    silent = undeclared(components.values())
    texts = [f"Unconnected inputs keep their start values: {', '.join(free)}."] if free else []
    return texts + (
        [f"Declare no dependencies, direct feedthrough assumed absent: {', '.join(silent)}."] if silent else []
    )
