"""From the task of a run to its structure: descriptions only, no FMU is built, loaded or instantiated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, replace

from cosim.balises.service import localiser_stage_text, receiver_stage_text
from cosim.components.component import Component
from cosim.components.fmi3 import FMI3Component
from cosim.coupling.chain import COMPILED_STAGE_TEXT, plain_way
from cosim.coupling.connection import Connection, unconnected_inputs
from cosim.coupling.graph import Group, undeclared
from cosim.coupling.instants import followed
from cosim.errors import CouplingError
from cosim.master.algorithms.choose import AlgorithmChoice, choose_algorithm
from cosim.master.control.multirate import rate_stage_text
from cosim.master.events.choose import taking_part
from cosim.master.events.participant import interrupts
from cosim.master.events.stride import event_stage_text
from cosim.network.service import PACKET_STAGE_TEXT
from cosim.run.balise_service import BaliseRoles, balise_roles
from cosim.run.connections import parse_connections
from cosim.run.coupled import Coupled, couple
from cosim.run.described_components import describe_component
from cosim.run.network import Network
from cosim.run.starts import names_with_starts
from cosim.run.step_schedule import stepping_groups
from cosim.run.task import RunTask
from cosim.scenario.schema import ScenarioTable
from cosim.structure.inspect import group_index, make_links, make_part, rate_text
from cosim.structure.run_structure import Structure
from cosim.structure.structure_data import Balises, Link, Packets

_AT_SET_UP = "chosen at set-up"
_COMPILED = f"{COMPILED_STAGE_TEXT} (where the run can use it)"


@dataclass(frozen=True, slots=True)
class _Steps:
    """How components are brought over a step.

    Args:
        part: which take part in events, and whether each gives some. divided: whether others halt within steps.
        returns: whether a component may end a step early, so that others must go back.
        lines: components with inputs that follow lines. compiled: whether the compiled stepper may take them.
    """

    part: Mapping[str, bool]
    divided: bool
    returns: bool
    lines: Set[str]
    compiled: bool


def _movement_chains(
    table: ScenarioTable, coupled: Coupled, order: Sequence[str], choice: AlgorithmChoice, balises: Balises | None
) -> dict[str, tuple[str, ...]]:
    """The chain of each component in words, outermost stage first; what a probe decides is named as such."""
    steps = _steps(table, coupled, order, choice, balises)
    connected = {c.target[0] for c in coupled.routed}
    listeners = [] if coupled.network is None else [listener.component for listener in coupled.network.listeners]
    chains = {}
    for name in order:
        own = table.components[name]
        stages = [rate_stage_text(own.every)] if own.every > 1 else []
        stages += _event_stage(coupled.components[name], steps)
        stages += _balise_stage(name, balises) or ([PACKET_STAGE_TEXT] if name in listeners else [])
        stages += [_COMPILED] if steps.compiled else []
        interpolator = _AT_SET_UP if name in steps.lines else None
        chains[name] = (
            *stages,
            plain_way(interpolator, own.substeps, inputs=name in connected, gated=name in steps.part),
        )
    return chains


def _steps(
    table: ScenarioTable, coupled: Coupled, order: Sequence[str], choice: AlgorithmChoice, balises: Balises | None
) -> _Steps:
    components, events = {name: coupled.components[name] for name in order}, table.master.events
    part = taking_part(components, coupled.routed, coupled.clocks, events, _alone(table, balises))
    propagated = bool(part) and events == "propagate"
    returns = propagated and any(
        isinstance(c, FMI3Component) and interrupts(c, gives=part[name])
        for name, c in components.items()
        if name in part
    )
    ahead = followed(components, coupled.routed)
    every_line = table.master.inputs != "hold"
    lines = set(order) if every_line else {c.target[0] for c in coupled.routed if c.source_variable in ahead}
    compiled = not part and not lines and _may_compile(table, components, coupled.routed, choice)
    return _Steps(part, propagated or coupled.network is not None, returns, lines, compiled)


def _event_stage(component: Component, steps: _Steps) -> list[str]:
    whole = not component.can_vary_step
    return [event_stage_text(whole=whole)] if steps.divided and (steps.returns or whole) else []


def _balise_stage(name: str, balises: Balises | None) -> list[str]:
    if balises is None:
        return []
    if name == balises.plant:
        return [localiser_stage_text(_AT_SET_UP if balises.method == "auto" else balises.method)]
    return [receiver_stage_text(balises.timing)] if name in balises.receivers else []


def _alone(table: ScenarioTable, balises: Balises | None) -> str | None:
    """A watched plant that reports balises by early return."""
    if balises is None or table.balises is None or table.balises.layout == "recorded":
        return None
    early = balises.method == "early-return" or (balises.method == "auto" and table.balises.clock is not None)
    return balises.plant if early else None


def _may_compile(
    table: ScenarioTable,
    components: Mapping[str, Component],
    connections: Sequence[Connection],
    choice: AlgorithmChoice,
) -> bool:
    """Whether nothing that is known before the run keeps it from the compiled stepper."""
    master = table.master
    rates = any(t.every > 1 or t.substeps > 1 for t in table.components.values())
    python = any(c.kind != "FMU" for c in components.values()) or any(c.exact or c.table for c in connections)
    steps = master.control == "fixed" and choice.algorithm in ("gauss-seidel", "jacobi") and master.threads == 1
    return master.stepper != "python" and steps and not rates and not python


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
    chains = _movement_chains(table, coupled, order, choice, balises)
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
