"""Order: in which order the components are stepped, and which direct-feedthrough loops there are.

The connection graph of a controlled train has cycles; they are harmless where some output in the cycle follows from states
alone. Only a cycle of declared direct feedthrough is an algebraic loop. Pure graph work on names.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TypeVar

from cosim.components.component import Component
from cosim.coupling.connection import Connection
from cosim.errors import CouplingError

Node = tuple[str, str]
T = TypeVar("T")


def execution_order(
    components: Mapping[str, Component], connections: Sequence[Connection], before: Iterable[tuple[str, str]] = ()
) -> list[str]:
    """Component names in Gauss-Seidel order: a source before its targets, where the graph allows it.

    Strongly connected groups are taken in topological order. Inside a group an input that acts directly on an output which
    is passed on comes after its source; what remains free follows the order in which the components were listed, so list the
    plant first: the connection into the first component of a loop is the one that is held over a step.

    Args:
        components: by name, in the order listed.
        connections: checked connections.
        before: further pairs (first, second), e.g. the watched plant before the receivers of its balises; these hold always.

    Raises:
        CouplingError: an algebraic loop, with its signals named, or pairs in `before` that contradict each other.
    """
    must = {(a, b) for a, b in before if a != b}
    check_algebraic_loops(components, connections)
    names = list(components)
    edges = {(c.source[0], c.target[0]) for c in connections if c.source[0] != c.target[0]}
    passed_on = {c.source for c in connections}
    hard = {(c.source[0], c.target[0]) for c in connections if _feeds_through(components[c.target[0]], c.target[1], passed_on)}
    order: list[str] = []
    for group in _groups(names, edges | must):
        listed = sorted(group, key=names.index)
        arranged = _topological(listed, _within(group, hard | must)) or _topological(listed, _within(group, must))
        if arranged is None:
            pairs = ", ".join(f"{a} before {b}" for a, b in sorted(_within(group, must)))
            raise CouplingError(f"No order of stepping satisfies all of: {pairs}.")
        order += arranged
    return order


def _within(group: set[str], edges: set[tuple[str, str]]) -> set[tuple[str, str]]:
    return {(a, b) for a, b in edges if a in group and b in group and a != b}


def check_algebraic_loops(components: Mapping[str, Component], connections: Sequence[Connection]) -> None:
    """Refuse cycles of declared direct feedthrough.

    Raises:
        CouplingError: there is one; its signals are named in order.
    """
    successors: dict[Node, list[Node]] = {}
    for connection in connections:
        successors.setdefault(connection.source, []).append(connection.target)
    for component in components.values():
        for output, inputs in declared_feedthrough(component).items():
            for name in inputs:
                successors.setdefault((component.name, name), []).append((component.name, output))
    loop = _find_cycle(successors)
    if loop:
        path = " -> ".join(".".join(node) for node in loop)
        raise CouplingError(
            f"Algebraic loop without a method: {path}. Break it with a component that holds a state or a sample "
            "(for instance a sampled sensor), or merge the components."
        )


def declared_feedthrough(component: Component) -> dict[str, list[str]]:
    """Outputs and the inputs they declare to depend on directly; undeclared dependencies count as none."""
    table: dict[str, list[str]] = {}
    for unknown in component.description.outputs:
        if unknown.variable is not None and unknown.dependencies is not None:
            table[unknown.variable.name] = [v.name for v in unknown.dependencies if v.causality == "input"]
    return table


def undeclared(components: Iterable[Component]) -> list[str]:
    """Components that declare no dependencies although they have inputs and outputs."""
    return [
        c.name
        for c in components
        if c.names("input") and c.names("output") and all(u.dependencies is None for u in c.description.outputs)
    ]


def _feeds_through(component: Component, name: str, passed_on: set[Node]) -> bool:
    """Whether an input acts directly on an output that some other component uses."""
    table = declared_feedthrough(component)
    return any(name in inputs for output, inputs in table.items() if (component.name, output) in passed_on)


def _find_cycle(successors: Mapping[Node, Sequence[Node]]) -> list[Node]:
    """A cycle as a closed list of nodes, or an empty list: peel off what has no successor, then follow what remains."""
    remaining = {node: set(following) for node, following in successors.items()}
    while True:
        leaves = {node for following in remaining.values() for node in following if not remaining.get(node)}
        leaves |= {node for node, following in remaining.items() if not following}
        if not leaves:
            break
        remaining = {n: f - leaves for n, f in remaining.items() if n not in leaves}
    path: list[Node] = []
    node = next(iter(remaining), None)
    while node is not None and node not in path:
        path.append(node)
        node = min(remaining[node])
    return [] if node is None else [*path[path.index(node) :], node]


def _groups(names: Sequence[str], edges: set[tuple[str, str]]) -> list[set[str]]:
    """Strongly connected groups in topological order; ties in listing order."""
    reach = {name: _reachable(name, edges) for name in names}
    groups: list[set[str]] = []
    for name in names:
        if not any(name in group for group in groups):
            groups.append({name} | {other for other in reach[name] if name in reach[other]})
    links = {
        (i, j) for i, a in enumerate(groups) for j, b in enumerate(groups) if i != j and any(x in a and y in b for x, y in edges)
    }
    order = _topological(list(range(len(groups))), links)
    assert order is not None
    return [groups[i] for i in order]


def _reachable(start: str, edges: set[tuple[str, str]]) -> set[str]:
    seen: set[str] = set()
    frontier = [start]
    while frontier:
        node = frontier.pop()
        for a, b in edges:
            if a == node and b not in seen:
                seen.add(b)
                frontier.append(b)
    return seen


def _topological(items: Sequence[T], edges: set[tuple[T, T]]) -> list[T] | None:
    """Kahn's order, the earliest listed item first; None where the edges have a cycle."""
    remaining = list(items)
    order: list[T] = []
    while remaining:
        free = next((i for i in remaining if not any(b == i and a in remaining for a, b in edges)), None)
        if free is None:
            return None
        remaining.remove(free)
        order.append(free)
    return order
