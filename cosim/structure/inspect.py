"""Inspection: what components and their connections look like to the master. Reads descriptions only; nothing is
instantiated.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise

from fmpy.model_description import ModelVariable

from cosim.components.component import Component
from cosim.coupling.clocks import ClockConnection
from cosim.coupling.connection import Connection
from cosim.coupling.feedthrough import AlgebraicLoop, declared_feedthrough, undeclared_outputs
from cosim.coupling.instants import followed, held_signals
from cosim.master.algorithms.choose import AlgorithmChoice
from cosim.structure.structure_data import Link, Part, Port, Signal

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


def make_links(
    components: Mapping[str, Component],
    connections: Sequence[Connection],
    choice: AlgorithmChoice,
    order: Sequence[str],
    loops: Iterable[AlgebraicLoop],
) -> tuple[Link, ...]:
    """Connections with what becomes of them in a step; those between the elements of two arrays as one.

    Args:
        components: by name. connections: checked. choice: of the algorithm. order: of execution. loops: algebraic ones.
    """
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


def make_part(
    component: Component,
    connections: Sequence[Connection],
    group: int,
    rate: str = "",
    clocks: Iterable[ClockConnection] = (),
    chain: Sequence[str] = (),
) -> Part:
    """A component as data.

    Args:
        component: what is described. connections: of all components. group: number of its group. rate: of its steps, in
            words.
        clocks: connections between clocks. chain: how it moves over a step, in words.
    """
    description = component.description
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
        abilities(component),
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


def abilities(component: Component) -> tuple[str, ...]:
    """Capabilities that the component declares and a master can use, in words."""
    return tuple(text for flag, text in _ABILITIES.items() if getattr(component.capabilities, flag))


def rate_text(every: int, substeps: int) -> str:
    """How often a component is stepped, in words; empty for once in every communication step.

    Args:
        substeps: for one step of the master.
    """
    if every > 1:
        return f"every {every} steps"
    return f"{substeps} in each step" if substeps > 1 else ""


def group_index(groups: Iterable[Sequence[str]]) -> Mapping[str, int]:
    """Number of the group of each component.

    Args:
        groups: names of components that influence one another.
    """
    return {name: i for i, group in enumerate(groups) for name in group}


def _port(
    component: Component, variable: ModelVariable, connected: set[str], depends: tuple[str, ...] | None = None
) -> Port:
    shape = "x".join(map(str, variable.shape)) if variable.shape else ""
    kind = f"{variable.type}[{shape}]" if shape else str(variable.type)
    ticks = str(variable.intervalVariability) if variable.type == "Clock" and variable.causality == "input" else None
    return Port(variable.name, component.unit_name(variable.name), kind, variable.name in connected, depends, ticks)
