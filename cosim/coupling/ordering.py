"""Ordering: an order of nodes that satisfies edges as far as they allow it, and holds few signals. Plain graph work.

A signal goes from a source to targets. It is held where a target comes before the source.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence, Set
from dataclasses import dataclass
from heapq import heapify, heappop, heappush
from typing import Generic, TypeVar

from cosim.coupling.strong import strong_groups

Node = TypeVar("Node", bound=Hashable)
Pair = tuple[Node, Node]


@dataclass(frozen=True)
class OrderedSignal(Generic[Node]):
    """What one node gives to others.

    Args:
        source: the node that gives it. targets: those that take it, without the source.
        flows: whether it changes all the time; one that is constant between its jumps is rather held.
    """

    source: Node
    targets: frozenset[Node]
    flows: bool


def satisfied(nodes: Sequence[Node], levels: Sequence[Set[Pair[Node]]]) -> set[Pair[Node]]:
    """Edges without a cycle: those of the first level; where these have cycles, inside each cycle those of the next
    level.

    Args:
        nodes: all of them. levels: sets of edges, each a subset of the one before.
    """
    if not levels:
        return set()
    groups = strong_groups(nodes, levels[0])
    group_of = {node: i for i, group in enumerate(groups) for node in group}
    found = {(a, b) for a, b in levels[0] if group_of[a] != group_of[b]}
    inner: list[list[set[Pair[Node]]]] = [[set() for _ in levels[1:]] if len(group) > 1 else [] for group in groups]
    for depth, edges in enumerate(levels[1:]):
        for a, b in edges:
            if group_of[a] == group_of[b] and a != b:
                inner[group_of[a]][depth].add((a, b))
    for group, remaining in zip(groups, inner, strict=True):
        found |= satisfied(group, remaining) if len(group) > 1 else set()
    return found


def in_order(
    nodes: Sequence[Node], edges: Set[Pair[Node]], signals: Iterable[OrderedSignal[Node]], rank: Mapping[Node, int]
) -> list[Node]:
    """The nodes in an order that satisfies the edges and holds few signals, found node by node.

    Of the nodes that the edges leave free the next one is of lowest rank; of these the one that makes the fewest
    signals held, flowing ones first; of these the one that gives to most others; of these the first one of `nodes`.
    Takes linear time but for a heap.

    Args:
        nodes: all of them. edges: without a cycle. signals: between nodes. rank: of each node.
    """
    search = _Search(nodes, edges, list(signals), rank)
    order = []
    while search.heap:
        node = search.pop()
        if node is not None:
            order.append(node)
    assert len(order) == len(nodes)
    return order


class _Search(Generic[Node]):
    """The state of `in_order`. What a node costs only ever falls; the heap keeps what was, which is passed over."""

    def __init__(
        self,
        nodes: Sequence[Node],
        edges: Set[Pair[Node]],
        signals: Sequence[OrderedSignal[Node]],
        rank: Mapping[Node, int],
    ) -> None:
        self._nodes, self._signals, self._rank = nodes, signals, rank
        self._place = {node: i for i, node in enumerate(nodes)}
        self._successors: dict[Node, list[Node]] = {node: [] for node in nodes}
        self._waits_for = dict.fromkeys(nodes, 0)
        for a, b in edges:
            self._successors[a].append(b)
            self._waits_for[b] += 1
        self._stated: dict[Node, list[int]] = {node: [] for node in nodes}
        self._taken: dict[Node, list[int]] = {node: [] for node in nodes}
        self._cost = {node: [0, 0] for node in nodes}
        for i, signal in enumerate(signals):
            self._stated[signal.source].append(i)
            for target in signal.targets:
                self._taken[target].append(i)
                self._cost[target][not signal.flows] += 1
        self._settled = [False] * len(signals)
        self._done: set[Node] = set()
        self.heap = [self._key(node) for node in nodes if not self._waits_for[node]]
        heapify(self.heap)

    def pop(self) -> Node | None:
        """Place the best free node and return it; None where the best entry of the heap is out of date."""
        entry = heappop(self.heap)
        node = self._nodes[entry[-1]]
        if node in self._done or entry != self._key(node):
            return None
        self._done.add(node)
        for i in (*self._stated[node], *self._taken[node]):
            self._settle(i)
        for following in self._successors[node]:
            self._waits_for[following] -= 1
            self._offer(following)
        return node

    def _settle(self, i: int) -> None:
        """Signal number `i` is held, or its source is placed: no further target makes any difference to it."""
        if self._settled[i]:
            return
        self._settled[i] = True
        for target in self._signals[i].targets:
            self._cost[target][not self._signals[i].flows] -= 1
            self._offer(target)

    def _offer(self, node: Node) -> None:
        if node not in self._done and not self._waits_for[node]:
            heappush(self.heap, self._key(node))

    def _key(self, node: Node) -> tuple[int, int, int, int, int]:
        flowing, constant = self._cost[node]
        reach = sum(len(self._signals[i].targets) for i in self._stated[node])
        return self._rank[node], flowing, constant, -reach, self._place[node]
