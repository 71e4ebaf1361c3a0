"""Order: in which order the components are stepped, and which of them hang together in loops. Pure graph work on names.

The connection graph of a controlled train has cycles; they are harmless where some output in the cycle follows from
states alone. Only a cycle of direct feedthrough is an algebraic loop (`cosim.coupling.feedthrough`).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from cosim.components.component import Component
from cosim.coupling.connection import Connection
from cosim.coupling.feedthrough import (
    AlgebraicLoop,
    algebraic_loops,
    declared_feedthrough,
    undeclared,
    undeclared_outputs,
)
from cosim.coupling.ordering import OrderedSignal, in_order, satisfied
from cosim.coupling.strong import strong_groups, topological
from cosim.errors import CouplingError

__all__ = [
    "Group",
    "declared_feedthrough",
    "execution_groups",
    "undeclared",
]

Pair = tuple[str, str]


@dataclass(frozen=True)
class Group:
    """Components that influence one another, directly or round about; mostly a single one.

    Args:
        names: in execution order.
        loop: whether there is a loop at all: several components, or one connected to itself.
        algebraic: loops of declared direct feedthrough in it.
        possible: loops that exist only if outputs without declared dependencies depend on every input.
        knots: the parts of `names` that share algebraic loops, each a consecutive run of it.
    """

    names: tuple[str, ...]
    loop: bool = False
    algebraic: tuple[AlgebraicLoop, ...] = ()
    possible: tuple[AlgebraicLoop, ...] = ()
    knots: tuple[tuple[str, ...], ...] = ()


def execution_groups(
    components: Mapping[str, Component],
    connections: Sequence[Connection],
    before: Iterable[Pair] = (),
    first: Iterable[str] = (),
    last: Iterable[str] = (),
) -> list[Group]:
    """Strongly connected groups in topological order, the members of each in Gauss-Seidel order.

    The order in which components and connections are listed does not matter. Inside a group the components of an
    algebraic loop stand together, and who takes their iterated signals comes after them; an input that acts directly on
    an output which is passed on comes after its source; where an FMU does not say what its outputs depend on, every
    input is taken to act on all of them as far as that contradicts nothing that is declared. What remains free is
    ordered as `first` and `last` say, then so that few signals are held (`cosim.coupling.instants`), rather those that
    are constant between their jumps; names decide last. The time it takes grows linearly with components and
    connections, but for a logarithm.

    Args:
        components: by name. connections: checked.
        before: pairs (first, second), e.g. the watched plant before the receivers of its balises; these hold always.
        first, last: who comes first, and last, where that is free.

    Raises:
        CouplingError: pairs in `before` that contradict each other.
    """
    rank = dict.fromkeys(components, 0) | dict.fromkeys(first, -1) | dict.fromkeys(last, 1)
    names = sorted(components, key=lambda name: (rank[name], name))
    components = {name: components[name] for name in names}
    connections = sorted(connections, key=lambda c: (c.source, c.target))
    must = {(a, b) for a, b in before if a != b}
    _check_consistent(names, must)
    algebraic = algebraic_loops(components, connections)
    possible = algebraic_loops(components, connections, possible=True)
    edges = {(c.source[0], c.target[0]) for c in connections}
    groups = strong_groups(names, edges | must)
    group_of = {name: i for i, group in enumerate(groups) for name in group}
    levels = [_split(level, group_of, len(groups)) for level in _levels(components, connections, must)]
    loops, maybe = _by_group(algebraic, group_of, len(groups)), _by_group(possible, group_of, len(groups))
    signals: list[list[OrderedSignal[str]]] = [[] for _ in groups]
    for signal in _signals(components, connections):
        inside = frozenset(name for name in signal.targets if group_of[name] == group_of[signal.source])
        signals[group_of[signal.source]].append(replace(signal, targets=inside))
    found = []
    for i, group in enumerate(groups):
        inner = Inside(group, [level[i] for level in levels], signals[i], rank)
        is_loop = len(group) > 1 or (group[0], group[0]) in edges
        found.append(_ordered_group(inner, is_loop, loops[i], maybe[i]))
    return found


def _by_group(loops: Iterable[AlgebraicLoop], group_of: Mapping[str, int], count: int) -> list[list[AlgebraicLoop]]:
    """The loops of each of `count` groups."""
    found: list[list[AlgebraicLoop]] = [[] for _ in range(count)]
    for loop in loops:
        found[group_of[loop.components[0]]].append(loop)
    return found


def _ordered_group(
    inner: Inside, is_loop: bool, loops: Sequence[AlgebraicLoop], maybe: Sequence[AlgebraicLoop]
) -> Group:
    """A group in Gauss-Seidel order, the components of each of its loops together."""
    blocks = inner.blocks([pair for loop in loops for pair in _round(loop.components)])
    tied = {name for loop in loops for name in loop.components}
    ordered = tuple(name for block in blocks for name in block)
    knots = tuple(block for block in blocks if not tied.isdisjoint(block))
    return Group(ordered, is_loop, tuple(loops), tuple(maybe), knots)


# -- order inside a group ------------------------------------------------------------------------------------------


def _levels(components: Mapping[str, Component], connections: Sequence[Connection], must: set[Pair]) -> list[set[Pair]]:
    """Pairs (first, second): all that one would like, without what is only possible, and those that hold always."""
    passed_on = {c.source_variable for c in connections}
    acting: dict[str, set[str]] = {}
    maybe: dict[str, set[str]] = {}
    for name, component in components.items():
        table = declared_feedthrough(component)
        acting[name] = {used for output, inputs in table.items() if (name, output) in passed_on for used in inputs}
        silent = any((name, output) in passed_on for output in undeclared_outputs(component))
        maybe[name] = set(component.variables) if silent else set()
    ends = [(c.source[0], *c.target_variable) for c in connections if c.source[0] != c.target[0]]
    hard = {(source, target) for source, target, name in ends if name in acting[target]}
    soft = {(source, target) for source, target, name in ends if name in maybe[target]}
    return [hard | soft | must, hard | must, must]


def _signals(components: Mapping[str, Component], connections: Sequence[Connection]) -> list[OrderedSignal[str]]:
    """What goes from component to component; an array is one signal."""
    targets: dict[tuple[str, str], set[str]] = {}
    for c in connections:
        targets.setdefault(c.source_variable, set()).add(c.target[0])
    return [
        OrderedSignal(
            name, frozenset(taking - {name}), components[name].variables[variable].variability in (None, "continuous")
        )
        for (name, variable), taking in targets.items()
    ]


@dataclass(frozen=True)
class Inside:
    """One group, to be ordered.

    Args:
        names: of its components. levels: pairs (first, second), as of `satisfied`; the last level holds always.
        signals: between its components. rank: of components.
    """

    names: Sequence[str]
    levels: Sequence[set[Pair]]
    signals: Sequence[OrderedSignal[str]]
    rank: Mapping[str, int]

    def blocks(self, ties: Sequence[Pair]) -> list[tuple[str, ...]]:
        """The components in order; those tied together into loops stand together.

        Args:
            ties: pairs of an input and an output that acts on it.
        """
        knots, after = self._knots(ties)
        if len(knots) == len(self.names):
            return [(name,) for name in self._arranged(self.names, self.levels, self.signals)]
        head = {name: knot[0] for knot in knots for name in knot}
        outer = [{(head[a], head[b]) for a, b in level | after if head[a] != head[b]} for level in self.levels]
        joined = [
            OrderedSignal(head[s.source], frozenset(head[n] for n in s.targets) - {head[s.source]}, s.flows)
            for s in self.signals
        ]
        members = {knot[0]: knot for knot in knots}
        return [self._inside(members[name]) for name in self._arranged(list(members), outer, joined)]

    def _knots(self, ties: Sequence[Pair]) -> tuple[list[list[str]], set[Pair]]:
        """Who is tied together, and pairs (first, second): who takes a signal that is iterated inside a knot comes
        after it.

        Where that contradicts what holds always, or two knots take such signals of one another, they are one knot.
        """
        joined = list(ties)
        while True:
            knots = strong_groups(self.names, joined)
            head = {name: knot[0] for knot in knots for name in knot}
            inner = [s for s in self.signals if any(head[name] == head[s.source] for name in s.targets)]
            iterated = [*inner, *(s for s in self.signals if (s.source, s.source) in joined)]
            after = {(s.source, name) for s in iterated for name in s.targets if head[name] != head[s.source]}
            outer = {(head[a], head[b]) for a, b in self.levels[-1] | after if head[a] != head[b]}
            tangled = [group for group in strong_groups([knot[0] for knot in knots], outer) if len(group) > 1]
            if not tangled:
                return knots, after
            joined += [pair for group in tangled for pair in _round(group)]

    def _inside(self, knot: Sequence[str]) -> tuple[str, ...]:
        own = set(knot)
        levels = [{(a, b) for a, b in level if a in own and b in own} for level in self.levels]
        signals = [replace(s, targets=s.targets & own) for s in self.signals if s.source in own]
        return tuple(self._arranged(knot, levels, signals) if len(knot) > 1 else knot)

    def _arranged(
        self, names: Sequence[str], levels: Sequence[set[Pair]], signals: Sequence[OrderedSignal[str]]
    ) -> list[str]:
        return in_order(names, satisfied(names, levels), signals, self.rank) if len(names) > 1 else list(names)


def _round(names: Sequence[str]) -> list[Pair]:
    return list(zip(names, [*names[1:], names[0]], strict=True))


def _split(edges: Iterable[Pair], group_of: Mapping[str, int], count: int) -> list[set[Pair]]:
    """The edges inside each group."""
    inside: list[set[Pair]] = [set() for _ in range(count)]
    for a, b in edges:
        if group_of[a] == group_of[b] and a != b:
            inside[group_of[a]].add((a, b))
    return inside


def _check_consistent(names: Sequence[str], must: set[Pair]) -> None:
    if topological(names, must) is not None:
        return
    tied = next(set(group) for group in strong_groups(names, must) if len(group) > 1)
    pairs = ", ".join(f"{a} before {b}" for a, b in sorted(must) if a in tied and b in tied)
    raise CouplingError(f"No order of stepping satisfies all of: {pairs}.")
