"""Direct feedthrough: which inputs act on which outputs at once, and the algebraic loops this makes. Reads descriptions
only.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import dataclass

from cosim.components.component import Component
from cosim.coupling.connection import Connection
from cosim.coupling.strong import closed_path, strong_groups

Node = tuple[str, str]
"""(component, signal)"""
Path = tuple[Node, ...]
Edge = tuple[Node, Node]


@dataclass(frozen=True)
class AlgebraicLoop:
    """A knot of direct feedthrough: outputs that depend on one another at the same instant.

    Args:
        path: a shortest closed way through it, along connections and feedthrough, first node = last node.
        components: all that take part, in the order in which they were given.
    """

    path: Path
    components: tuple[str, ...]

    def __str__(self) -> str:
        return " -> ".join(".".join(node) for node in self.path)


def declared_feedthrough(component: Component) -> dict[str, list[str]]:
    """Outputs and the inputs they declare to depend on directly; undeclared dependencies count as none.

    Args:
        component: an instantiated component.
    """
    table: dict[str, list[str]] = {}
    for unknown in component.description.outputs:
        if unknown.variable is not None and unknown.dependencies is not None:
            table[unknown.variable.name] = [v.name for v in unknown.dependencies if v.causality == "input"]
    return table


def acting_on_derivatives(component: Component) -> set[str] | None:
    """Inputs that act on derivatives of states, so over a whole step; None where the description does not say.

    Args:
        component: an instantiated component.
    """
    known = component.description.derivatives
    if not known or any(unknown.dependencies is None for unknown in known):
        return None
    return {v.name for unknown in known for v in unknown.dependencies if v.causality == "input"}


def undeclared_outputs(component: Component) -> list[str]:
    """Outputs and locals of which the description does not say what they depend on; by the standard that may be every
    input.

    Locals that are continuous states depend on none at once.

    Args:
        component: an instantiated component.
    """
    declared, variables = declared_feedthrough(component), component.description.modelVariables
    states = {v.derivative.valueReference for v in variables if v.derivative is not None}
    hidden = [v for v in variables if v.causality == "local" and v.valueReference not in states]
    outputs = [v for v in variables if v.causality == "output" and v.name not in declared]
    return [v.name for v in (*outputs, *hidden)]


def undeclared(components: Iterable[Component]) -> list[str]:
    """Components that declare no dependencies although they have inputs and outputs.

    Args:
        components: the components.
    """
    return [
        c.name
        for c in components
        if c.names("input") and c.names("output") and all(u.dependencies is None for u in c.description.outputs)
    ]


def algebraic_loops(
    components: Mapping[str, Component], connections: Sequence[Connection], *, possible: bool = False
) -> list[AlgebraicLoop]:
    """Cycles of direct feedthrough, one for each knot of them, in the order of the components.

    Args:
        components: by name. connections: checked.
        possible: count outputs without declared dependencies as depending on every input, as FMI 2.0 and 3.0 say
            (ModelStructure), and give only the knots in which declared feedthrough alone makes no loop.
    """
    joints, hubs = _joints(connections)
    edges = joints + [
        ((c.name, name), (c.name, output))
        for c in components.values()
        for output, used in declared_feedthrough(c).items()
        for name in used
    ]
    declared = _knots(components, edges, hubs, frozenset())
    if not possible:
        return declared
    linked = {node for edge in joints for node in edge}  # what is not connected is in no loop
    for c in components.values():
        inputs = [name for name in _input_variables(c) if (c.name, name) in linked]
        outputs = [output for output in undeclared_outputs(c) if (c.name, output) in linked]
        edges += [((c.name, name), (c.name, output)) for output in outputs for name in inputs]
    return _knots(components, edges, hubs, {node for loop in declared for node in loop.path})


def _joints(connections: Sequence[Connection]) -> tuple[list[Edge], set[Node]]:
    """Edges along connections; elements hang on their arrays, for which dependencies are declared. And those arrays."""
    edges: list[Edge] = []
    arrays: set[Node] = set()
    for connection in connections:
        edges.append((connection.source, connection.target))
        if connection.source != connection.source_variable:
            edges.append((connection.source_variable, connection.source))
            arrays.add(connection.source_variable)
        if connection.target != connection.target_variable:
            edges.append((connection.target, connection.target_variable))
            arrays.add(connection.target_variable)
    return edges, arrays


def _knots(
    components: Mapping[str, Component], edges: Sequence[Edge], arrays: Set[Node], known: Set[Node]
) -> list[AlgebraicLoop]:
    """Strongly connected signals, except those that hold a known one."""
    listed = {name: i for i, name in enumerate(components)}
    nodes = sorted({node for edge in edges for node in edge}, key=lambda node: (listed[node[0]], node[1]))
    knots = [group for group in strong_groups(nodes, edges) if len(group) > 1 and known.isdisjoint(group)]
    knot_of = {node: i for i, group in enumerate(knots) for node in group}
    inner: list[list[Edge]] = [[] for _ in knots]
    for a, b in edges:
        if a in knot_of and knot_of[a] == knot_of.get(b):
            inner[knot_of[a]].append((a, b))
    loops = []
    for group, own in zip(knots, inner, strict=True):
        members = tuple(sorted({node[0] for node in group}, key=listed.__getitem__))
        path = closed_path(next(node for node in group if node not in arrays), own)
        loops.append(AlgebraicLoop(tuple(node for node in path if node not in arrays), members))
    return sorted(loops, key=lambda loop: [listed[name] for name in loop.components])


def _input_variables(component: Component) -> list[str]:
    hidden = component.event_references()
    return [
        v.name
        for v in component.description.modelVariables
        if v.causality == "input" and v.valueReference not in hidden
    ]
