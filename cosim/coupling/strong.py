"""Graph work on plain nodes, in linear time: strongly connected groups, topological order, closed paths. Knows no
components.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from heapq import heapify, heappop, heappush
from typing import TypeVar

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

Node = TypeVar("Node", bound=Hashable)
Edges = Iterable[tuple[Node, Node]]


def strong_groups(nodes: Sequence[Node], edges: Edges[Node]) -> list[list[Node]]:
    """Strongly connected groups in topological order; ties, and the members of a group, in the order of `nodes`.

    Args:
        nodes: what is grouped. edges: pairs (first, second) of these nodes.

    Source: D. Pearce, An improved algorithm for finding the strongly connected components of a directed graph, 2005
    (SciPy).
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
    """A shortest path along the edges from a node that lies on a cycle back to itself, both ends included."""
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
    pairs = np.array([(place[a], place[b]) for a, b in edges], dtype=int).reshape(-1, 2)
    matrix = coo_array((np.ones(len(pairs), dtype=np.int8), (pairs[:, 0], pairs[:, 1])), shape=(len(place), len(place)))
    return [int(label) for label in connected_components(matrix.tocsr(), connection="strong")[1]]
