"""From the task of a run to its structure: descriptions only, no FMU is built, loaded or instantiated."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from itertools import pairwise

from fmpy.model_description import ModelVariable

from cosim.balises.service import localiser_stage_text, receiver_stage_text
from cosim.components.component import Component
from cosim.components.fmi3 import FMI3Component
from cosim.coupling.chain import COMPILED_STAGE_TEXT, plain_way
from cosim.coupling.clocks import ClockConnection
from cosim.coupling.connection import Connection, unconnected_inputs
from cosim.coupling.feedthrough import AlgebraicLoop, declared_feedthrough, undeclared_outputs
from cosim.coupling.graph import Group, undeclared
from cosim.coupling.instants import followed, held_signals
from cosim.errors import CouplingError
from cosim.master.algorithms.choose import AlgorithmChoice, choose_algorithm
from cosim.master.control.multirate import rate_stage_text
from cosim.master.events.choose import taking_part
from cosim.master.events.participant import interrupts
from cosim.master.events.stride import event_stage_text
from cosim.network.service import PACKET_STAGE_TEXT
from cosim.run.balise_service import BaliseRoles, balise_roles
from cosim.run.code_not_run import NOT_RUN, code_warnings
from cosim.run.connections import parse_connections
from cosim.run.coupled import Coupled, couple
from cosim.run.described_components import describe_component
from cosim.run.loaded_components import names_with_starts
from cosim.run.network import Network
from cosim.run.step_schedule import listeners_that_reorder, stepping_groups
from cosim.run.task import RunTask
from cosim.scenario.schema import ScenarioTable
from cosim.structure.run_structure import Structure
from cosim.structure.structure_data import Balises, Link, Packets, Part, Port, Signal
from fmus.exchange.description import SolvedCoSimulation

_AT_SET_UP = "chosen at set-up"
_COMPILED = f"{COMPILED_STAGE_TEXT} (where the run can use it)"


_ABILITIES = {
    "canHandleVariableCommunicationStepSize": "variable step",
    "canGetAndSetFMUState": "saves state",
    "canInterpolateInputs": "input derivatives",
    "hasEventMode": "event mode",
    "mightReturnEarlyFromDoStep": "early return",
    "providesIntermediateUpdate": "intermediate update",
    "providesDirectionalDerivatives": "directional derivatives",
    "needsExecutionTool": "needs its tool",
    "canBeInstantiatedOnlyOncePerProcess": "once per process",
}
"""Capability flags that decide what a master can do, in words."""


def _make_links(
    components: Mapping[str, Component],
    connections: Sequence[Connection],
    choice: AlgorithmChoice,
    order: Sequence[str],
    loops: Iterable[AlgebraicLoop],
) -> tuple[Link, ...]:
    """Connections with what becomes of them in a step; those between the elements of two arrays as one."""
    every, ahead = choice.algorithm == "jacobi", followed(components, connections)
    kept = held_signals(components, connections, order, choice.iterated)
    in_loops = {pair for loop in loops for pair in pairwise(loop.path)}
    links: dict[tuple[Signal, Signal], Link] = {}
    for c in connections:
        whole = bool(c.source_array and c.target_array)
        source, target = (c.source_variable, c.target_variable) if whole else (c.source, c.target)
        line = c.source_variable in ahead
        held = (every and not line) or c.source_variable in kept
        iterated = not held and any(source[0] in loop and target[0] in loop for loop in choice.iterated)
        in_loop = (c.source, c.target) in in_loops or (c.source_variable, c.target_variable) in in_loops
        known = links.get((source, target))
        looped = in_loop or (known is not None and known.in_loop)
        links[source, target] = Link(
            source, target, c.factor, c.offset, held, looped, iterated, mapped=bool(c.table), line=line
        )
    return tuple(links.values())


def _abilities(component: Component) -> tuple[str, ...]:
    """What decides what a master can do, in words."""
    solved = isinstance(component.description.coSimulation, SolvedCoSimulation)
    found = tuple(text for flag, text in _ABILITIES.items() if getattr(component.capabilities, flag))
    return ("model exchange, moved by CVODE here", *found) if solved else found


def _make_part(
    component: Component,
    connections: Sequence[Connection],
    group: int,
    rate: str = "",
    clocks: Iterable[ClockConnection] = (),
    chain: Sequence[str] = (),
) -> Part:
    """A component as data."""
    description = component.description
    abilities = () if component.kind == NOT_RUN else _abilities(component)
    taken, used = _connected(component.name, connections, clocks)
    hidden = component.event_references()
    inputs = [v for v in description.modelVariables if v.causality == "input" and v.valueReference not in hidden]
    outputs = [
        v for v in description.modelVariables if v.causality == "output" or (v.causality == "local" and v.name in used)
    ]
    silent, table = set(undeclared_outputs(component)), declared_feedthrough(component)
    return Part(
        component.name,
        component.kind,
        description.fmiVersion,
        description.modelName or "",
        component.source,
        tuple(_port(component, v, taken) for v in inputs),
        tuple(_port(component, v, used, None if v.name in silent else tuple(table.get(v.name, ()))) for v in outputs),
        tuple(component.events),
        abilities,
        group,
        rate,
        tuple(chain),
    )


def _connected(
    name: str, connections: Sequence[Connection], clocks: Iterable[ClockConnection]
) -> tuple[set[str], set[str]]:
    """Names of the inputs and of the outputs of a component that have a connection, elements and whole arrays."""
    clocked = list(clocks)
    taken = {n for c in connections if c.target[0] == name for n in (c.target[1], c.target_variable[1])}
    used = {n for c in connections if c.source[0] == name for n in (c.source[1], c.source_variable[1])}
    taken |= {c.target[1] for c in clocked if c.target[0] == name}
    used |= {c.source[1] for c in clocked if c.source[0] == name}
    return taken, used


def _rate_text(every: int, substeps: int) -> str:
    """How often a component is stepped, in words; empty for once in every communication step."""
    if every > 1:
        return f"every {every} steps"
    return f"{substeps} in each step" if substeps > 1 else ""


def _port(
    component: Component, variable: ModelVariable, connected: set[str], depends: tuple[str, ...] | None = None
) -> Port:
    shape = "x".join(map(str, variable.shape)) if variable.shape else ""
    kind = f"{variable.type}[{shape}]" if shape else str(variable.type)
    ticks = str(variable.intervalVariability) if variable.type == "Clock" and variable.causality == "input" else None
    return Port(variable.name, component.unit_name(variable.name), kind, variable.name in connected, depends, ticks)


@dataclass(frozen=True, slots=True)
class _Steps:
    """How components are brought over a step.

    Args:
        part: which take part in events, and whether each gives some. divided: whether others halt within steps.
        returns: whether a component may end a step early, so that others must go back.
        lines: components with inputs that follow lines. compiled: those that the compiled stepper may take.
    """

    part: Mapping[str, bool]
    divided: bool
    returns: bool
    lines: Set[str]
    compiled: Set[str]


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
        stages += [_COMPILED] if name in steps.compiled else []
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
    compiled = _may_be_compiled(table, components, coupled.routed, choice) - lines
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


def _may_be_compiled(
    table: ScenarioTable,
    components: Mapping[str, Component],
    connections: Sequence[Connection],
    choice: AlgorithmChoice,
) -> set[str]:
    """The components that nothing which is known before the run keeps from the compiled stepper."""
    master = table.master
    if master.stepper == "python" or master.control != "fixed" or master.threads != 1:
        return set()
    if choice.algorithm not in ("gauss-seidel", "jacobi"):
        return set()
    no_numbers = {end for c in connections if c.exact for end in (c.source[0], c.target[0])}
    mapped = {c.target[0] for c in connections if c.table}
    native = {n for n, c in components.items() if c.kind == "FMU" and table.components[n].substeps == 1}
    return native - no_numbers - mapped


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
        links = parse_connections(table.connections, where)
        components = {
            n: describe_component(n, t, task.folder, places[n], span, links) for n, t in table.components.items()
        }
        coupled = couple(task, links, components)
        roles = balise_roles(table.balises, components, where)
        groups = stepping_groups(table, coupled, roles)
        notes = listeners_that_reorder(table, coupled, roles, groups)
        return _structure(task, coupled, groups, _balises(table, roles), notes)


def _structure(
    task: RunTask, coupled: Coupled, groups: Sequence[Group], balises: Balises | None, notes: Sequence[str]
) -> Structure:
    table, components, connections, clocks = task.table, coupled.components, coupled.connections, coupled.clocks
    choice, refusal = _choice(table, groups, components)
    order = [n for group in groups for n in group.names]
    loops = [loop for group in groups for loop in group.algebraic]
    number = {name: i for i, group in enumerate(groups) for name in group.names}
    rates = {n: _rate_text(t.every, t.substeps) for n, t in table.components.items()}
    chains = _movement_chains(table, coupled, order, choice, balises)
    return Structure(
        name=task.name,
        title=table.title,
        start=table.start,
        stop=table.stop,
        step=table.step,
        parts=tuple(_make_part(components[n], connections, number[n], rates[n], clocks, chains[n]) for n in order),
        links=_make_links(components, connections, choice, order, loops),
        clocks=tuple(Link(c.source, c.target) for c in clocks),
        groups=tuple(group.names for group in groups),
        loops=tuple(loop.path for loop in loops),
        algorithm=choice.algorithm,
        reason=choice.reason,
        balises=balises,
        network=None if coupled.network is None else _network(coupled.network),
        warnings=(
            *code_warnings(components),
            *_warnings(table, components, connections),
            *choice.notes,
            *notes,
            *refusal,
        ),
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
