"""Graph work on plain nodes, in linear time: strongly connected groups, topological order, closed paths. Knows no
components.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from heapq import heapify, heappop, heappush
from typing import TypeVar

Node = TypeVar("Node", bound=Hashable)
Edges = Iterable[tuple[Node, Node]]


def strong_groups(nodes: Sequence[Node], edges: Edges[Node]) -> list[list[Node]]:
    """Strongly connected groups in topological order; ties, and the members of a group, in the order of `nodes`.

    Args:
        nodes: what is grouped. edges: pairs (first, second) of these nodes.

    Source: Kosaraju's algorithm, after M. Sharir, A strong-connectivity algorithm and its applications in data flow
    analysis, 1981.
    """
    edges = list(edges)
    place = {node: i for i, node in enumerate(nodes)}
    labels = _labels(place, edges)
    members: dict[int, list[Node]] = {}
    for node in nodes:
        members.setdefault(labels[place[node]], []).append(node)
    between = ((labels[place[a]], labels[place[b]]) for a, b in edges)
    order = topological(list(members), (pair for pair in between if pair[0] != pair[1]))
    assert order is not None
    return [members[label] for label in order]


def topological(nodes: Sequence[Node], edges: Edges[Node]) -> list[Node] | None:
    """Kahn's order, of the free nodes the first one of `nodes`; None where the edges have a cycle."""
    place = {node: i for i, node in enumerate(nodes)}
    successors: list[list[int]] = [[] for _ in nodes]
    waiting_for = [0] * len(nodes)
    for a, b in set(edges):
        successors[place[a]].append(place[b])
        waiting_for[place[b]] += 1
    free = [i for i, count in enumerate(waiting_for) if not count]
    heapify(free)
    order: list[Node] = []
    while free:
        first = heappop(free)
        order.append(nodes[first])
        for following in successors[first]:
            waiting_for[following] -= 1
            if not waiting_for[following]:
                heappush(free, following)
    return order if len(order) == len(nodes) else None


def closed_path(start: Node, edges: Edges[Node]) -> list[Node]:
    """A shortest path along the edges from a node that lies on a cycle back to itself, both ends included.

    Args:
        start: a node of the loop.
    """
    successors: dict[Node, list[Node]] = {}
    for a, b in edges:
        successors.setdefault(a, []).append(b)
    came_from = _search(start, successors)
    path = [start]
    while len(path) == 1 or path[-1] != start:
        path.append(came_from[path[-1]])
    return path[::-1]


def _search(start: Node, successors: Mapping[Node, Sequence[Node]]) -> dict[Node, Node]:
    """Breadth first from `start` until it is met again: each node met, and from where."""
    came_from: dict[Node, Node] = {}
    frontier = [start]
    while frontier and start not in came_from:
        reached = []
        for node in frontier:
            for following in successors.get(node, ()):
                if following not in came_from:
                    came_from[following] = node
                    reached.append(following)
        frontier = reached
    return came_from


def _labels(place: Mapping[Node, int], edges: Sequence[tuple[Node, Node]]) -> list[int]:
    """For each node the number of its group: those that a search against the edges reaches, begun at the node that a
    search along them left last.
    """
    along: list[list[int]] = [[] for _ in place]
    against: list[list[int]] = [[] for _ in place]
    for a, b in edges:
        along[place[a]].append(place[b])
        against[place[b]].append(place[a])
    labels = [-1] * len(place)
    left = [i for search in _searches(range(len(place)), along) for i in search]
    for label, group in enumerate(_searches(reversed(left), against)):
        for i in group:
            labels[i] = label
    return labels


def _searches(starts: Iterable[int], successors: Sequence[Sequence[int]]) -> Iterator[list[int]]:
    """Depth first from each start that is not met yet: what each search meets, in the order in which it leaves it."""
    met: set[int] = set()
    for start in starts:
        if start in met:
            continue
        met.add(start)
        left: list[int] = []
        path = [(start, iter(successors[start]))]
        while path:
            rest = path[-1][1]
            following = next((i for i in rest if i not in met), None)
            if following is None:
                left.append(path.pop()[0])
            else:
                met.add(following)
                path.append((following, iter(successors[following])))
        yield left
