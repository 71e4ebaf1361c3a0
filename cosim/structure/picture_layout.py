"""Where the boxes and wires of a structure's picture go. Pure geometry in inches, y pointing down; standard library
only.

Columns follow the flow: a group of components that influence one another keeps together, in columns of its own and in a
band of its own height, so that frames around groups never meet. A wire forward passes columns through gaps left free
for it; a wire back runs below its group.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import TYPE_CHECKING, TypeVar

from cosim.structure.shapes import Box, Edge, Frame, Layout, Size, Wire

if TYPE_CHECKING:
    from cosim.structure.structure_data import StructureData

_BOX_GAP, _BAND_GAP, PASS = 0.28, 0.34, 0.16  # between boxes and bands; height left free for a wire that passes
# of group frames, and the room of a wire that runs back
_FRAME, _FRAME_TITLE, _LANE, TRACK, _TIP = 0.16, 0.26, 0.14, 0.12, 0.08
_CURVE = 0.62  # room for a wire to swing from one height to another
_PER_WIRE, _MOST_WIRES = 0.06, 15
SWEEPS = 6
EVENT_PORT = "(balises)"
Node = TypeVar("Node", bound=Hashable)

Net = tuple[str, str]
"""(component, output): the origin of wires that run together."""


@dataclass
class _Item:
    """Something stacked in a column of a band: a box, or the free height for a wire that passes."""

    key: tuple[str, str]
    height: float
    y: float = 0.0


@dataclass
class _Band:
    """A group, or wires crossing a layer, with a height of its own over the columns of the layer."""

    names: tuple[str, ...]
    columns: dict[int, list[_Item]] = field(default_factory=dict)
    lanes: dict[Net, int] = field(default_factory=dict)
    y: float = 0.0

    @property
    def framed(self) -> bool:
        return len(self.names) > 1

    @property
    def body(self) -> float:
        return max((_height(items, _BOX_GAP) for items in self.columns.values()), default=0.0)

    @property
    def height(self) -> float:
        extra = _FRAME_TITLE + _FRAME if self.framed else 0.0
        return self.body + extra + self.lane_room

    @property
    def lane_room(self) -> float:
        return _LANE * (len(self.lanes) + 1) if self.lanes else 0.0


def lay_out(structure: StructureData, sizes: Mapping[str, Size], edges: Sequence[Edge]) -> Layout:
    """Place the boxes and lay the wires.

    Args:
        structure: groups and execution order. sizes: of the boxes, by name. edges: wires to lay.
    """
    return _Placing(structure, sizes, edges).result()


class _Placing:
    """The parts of one layout while it is made."""

    def __init__(self, structure: StructureData, sizes: Mapping[str, Size], edges: Sequence[Edge]) -> None:
        self.edges = edges
        pairs = {(e.source[0], e.target[0]) for e in edges if e.source[0] != e.target[0]}
        self.layers, columns = _columns(structure, pairs)
        self.boxes = {name: Box(name, sizes[name], column) for name, column in columns.items()}
        self.layer_of_column = {c: i for i, (_, first, last) in enumerate(self.layers) for c in range(first, last + 1)}
        self.bands: list[list[_Band]] = [[_Band(g) for g in groups] for groups, _, _ in self.layers]
        self.band_of = {n: band for layer in self.bands for band in layer for n in band.names}
        for name, box in self.boxes.items():
            self.band_of[name].columns.setdefault(box.column, []).append(_Item((name, ""), box.size.height))
        self.crossing: dict[tuple[Net, int], _Item] = {}
        for edge in sorted(edges, key=self._reach):  # short ways back lie above long ones
            self._reserve(edge)

    def _reach(self, edge: Edge) -> int:
        return self.boxes[edge.source[0]].column - self.boxes[edge.target[0]].column

    def result(self) -> Layout:
        best = None
        for _ in range(SWEEPS):
            self._stack_up()
            cost = self._cost()
            if best is None or cost < best[0] - 1e-9:
                best = cost, self._ordering()
            self._sort_by_neighbours()
        assert best is not None
        self._restore(best[1])
        self._stack_up()
        return self._laid()

    # -- room for wires ---------------------------------------------------------------------------------------------

    def is_back(self, edge: Edge) -> bool:
        """Whether a wire must run back below its group."""
        return self.boxes[edge.target[0]].column <= self.boxes[edge.source[0]].column

    def _reserve(self, edge: Edge) -> None:
        if self.is_back(edge):
            lanes = self.band_of[edge.source[0]].lanes
            lanes.setdefault(edge.source, len(lanes))
            return
        source, target = edge.source[0], edge.target[0]
        for column in range(self.boxes[source].column + 1, self.boxes[target].column):
            if (edge.source, column) not in self.crossing:
                item = _Item(edge.source, PASS)
                self.crossing[edge.source, column] = item
                self._band_for(column, source, target, edge.source).columns.setdefault(column, []).append(item)

    def _band_for(self, column: int, source: str, target: str, net: Net) -> _Band:
        layer = self.bands[self.layer_of_column[column]]
        for name in (source, target):
            if self.band_of[name] in layer:
                return self.band_of[name]
        for band in layer:
            if not band.names and any(item.key == net for items in band.columns.values() for item in items):
                return band
        layer.append(_Band(()))
        return layer[-1]

    # -- heights ----------------------------------------------------------------------------------------------------

    def _stack_up(self) -> None:
        total = max(_height(layer, _BAND_GAP) for layer in self.bands)
        for layer in self.bands:
            y = (total - _height(layer, _BAND_GAP)) / 2
            for band in layer:
                band.y = y
                self._stack_band(band)
                y += band.height + _BAND_GAP

    def _stack_band(self, band: _Band) -> None:
        top = band.y + (_FRAME_TITLE if band.framed else 0.0)
        for items in band.columns.values():
            y = top + (band.body - _height(items, _BOX_GAP)) / 2
            for item in items:
                item.y = y
                if not item.key[1]:
                    self.boxes[item.key[0]].y = y
                y += item.height + _BOX_GAP

    def _ends(self, edge: Edge) -> tuple[float, float]:
        source, target = self.boxes[edge.source[0]], self.boxes[edge.target[0]]
        return source.row(source.size.outputs, edge.source[1]), target.row(target.size.inputs, edge.target[1])

    def _heights(self, edge: Edge) -> list[float]:
        """Heights of a forward wire at its output, in the columns it passes, and at its input."""
        start, end = self._ends(edge)
        columns = range(self.boxes[edge.source[0]].column + 1, self.boxes[edge.target[0]].column)
        items = [self.crossing[edge.source, c] for c in columns]
        return [start, *(item.y + item.height / 2 for item in items), end]

    def _cost(self) -> float:
        """Up and down of all forward wires, and their crossings."""
        ways: list[tuple[int, float, float]] = []
        for edge in self.edges:
            if not self.is_back(edge):
                heights, first = self._heights(edge), self.boxes[edge.source[0]].column
                ways += [(first + i, a, b) for i, (a, b) in enumerate(pairwise(heights))]
        crossings = sum(c == d and (a - x) * (b - y) < 0 for i, (c, a, b) in enumerate(ways) for d, x, y in ways[:i])
        return sum(abs(b - a) for _, a, b in ways) + 0.7 * crossings

    # -- order within columns ---------------------------------------------------------------------------------------

    def _ordering(self) -> list[tuple[list[_Band], list[dict[int, list[_Item]]]]]:
        return [
            (list(layer), [{c: list(items) for c, items in b.columns.items()} for b in layer]) for layer in self.bands
        ]

    def _restore(self, ordering: list[tuple[list[_Band], list[dict[int, list[_Item]]]]]) -> None:
        self.bands = [bands for bands, _ in ordering]
        for bands, columns in ordering:
            for band, saved in zip(bands, columns, strict=True):
                band.columns = saved

    def _sort_by_neighbours(self) -> None:
        """Move everything towards the mean height of what it is wired to on its left, or where there is nothing, on its
        right.
        """
        pulls: dict[int, list[float]] = {}
        for edge in self.edges:
            if self.is_back(edge):
                continue
            heights = self._heights(edge)
            chain: list[int] = [id(self.boxes[edge.source[0]])]
            first, last = self.boxes[edge.source[0]].column, self.boxes[edge.target[0]].column
            chain += [id(self.crossing[edge.source, c]) for c in range(first + 1, last)]
            for before, node in zip(heights, [*chain[1:], id(self.boxes[edge.target[0]])], strict=False):
                pulls.setdefault(node, []).append(before)

        def pull(item: _Item) -> float:
            wanted = pulls.get(id(item) if item.key[1] else id(self.boxes[item.key[0]]), [])
            return sum(wanted) / len(wanted) if wanted else item.y + item.height / 2

        for layer in self.bands:
            for band in layer:
                for items in band.columns.values():
                    items.sort(key=pull)
            layer.sort(key=lambda band: _mean(pull(item) for items in band.columns.values() for item in items))
            for band in layer:
                self._stack_band(band)

    # -- widths and wires -------------------------------------------------------------------------------------------

    def _laid(self) -> Layout:
        count = max(box.column for box in self.boxes.values()) + 1
        rights = [
            sorted({e.source for e in self.edges if self.is_back(e) and self._column(e.source) == c})
            for c in range(count)
        ]
        lefts = [
            sorted({e.source for e in self.edges if self.is_back(e) and self._column(e.target) == c}, key=self._lane_of)
            for c in range(count)
        ]
        widths = [max((b.size.width for b in self.boxes.values() if b.column == c), default=0.0) for c in range(count)]
        begins = {min(self.boxes[n].column for n in b.names) for layer in self.bands for b in layer if b.framed}
        ends = {max(self.boxes[n].column for n in b.names) for layer in self.bands for b in layer if b.framed}
        left_edges, x = [], 0.0
        for c in range(count):
            x += (_FRAME if c in begins else 0.0) + _tracks(len(lefts[c]))
            left_edges.append(x)
            x += widths[c] + TRACK * (len(rights[c]) + bool(rights[c])) + (_FRAME if c in ends else 0.0)
            x += _CURVE + _PER_WIRE * self._swinging(c) if c < count - 1 else 0.0
        for box in self.boxes.values():
            box.x, box.size = left_edges[box.column], replace(box.size, width=widths[box.column])
        spans = [(a, a + w) for a, w in zip(left_edges, widths, strict=True)]
        wires = tuple(
            self._back(e, spans, lefts, rights) if self.is_back(e) else self._forward(e, spans) for e in self.edges
        )
        frames = tuple(self._frame(b, spans, lefts, rights) for layer in self.bands for b in layer if b.framed)
        height = max(band.y + band.height for layer in self.bands for band in layer)
        return Layout(self.boxes, wires, frames, x, height)

    def _swinging(self, column: int) -> int:
        """How many forward wires swing in the gap after a column, beyond the few that fit anyway."""
        places = [(self.boxes[e.source[0]].column, self.boxes[e.target[0]].column) for e in self.edges]
        return max(min(sum(a <= column < b for a, b in places), _MOST_WIRES) - 3, 0)

    def _column(self, end: tuple[str, str]) -> int:
        return self.boxes[end[0]].column

    def _lane_of(self, net: Net) -> int:
        return -self.band_of[net[0]].lanes[net]

    def _forward(self, edge: Edge, spans: Sequence[tuple[float, float]]) -> Wire:
        source, target = self.boxes[edge.source[0]], self.boxes[edge.target[0]]
        heights = self._heights(edge)
        points = [(source.right, heights[0]), (spans[source.column][1], heights[0])]
        for column, y in enumerate(heights[1:-1], start=source.column + 1):
            points += [(spans[column][0], y), (spans[column][1], y)]
        return Wire(edge, (*points, (spans[target.column][0], heights[-1]), (target.x, heights[-1])), False)

    def _back(
        self,
        edge: Edge,
        spans: Sequence[tuple[float, float]],
        lefts: Sequence[Sequence[Net]],
        rights: Sequence[Sequence[Net]],
    ) -> Wire:
        source, target = self.boxes[edge.source[0]], self.boxes[edge.target[0]]
        band = self.band_of[source.name]
        start, end = self._ends(edge)
        lane = band.y + (_FRAME_TITLE if band.framed else 0.0) + band.body + _LANE * (band.lanes[edge.source] + 1)
        out = spans[source.column][1] + TRACK * (rights[source.column].index(edge.source) + 1)
        back = spans[target.column][0] - _TIP - TRACK * (lefts[target.column].index(edge.source) + 1)
        return Wire(
            edge, ((source.right, start), (out, start), (out, lane), (back, lane), (back, end), (target.x, end)), True
        )

    def _frame(
        self,
        band: _Band,
        spans: Sequence[tuple[float, float]],
        lefts: Sequence[Sequence[Net]],
        rights: Sequence[Sequence[Net]],
    ) -> Frame:
        columns = [self.boxes[n].column for n in band.names]
        first, last = min(columns), max(columns)
        x = spans[first][0] - _tracks(len(lefts[first])) - _FRAME / 2
        right = spans[last][1] + TRACK * (len(rights[last]) + bool(rights[last])) + _FRAME / 2
        return Frame(band.names, x, band.y, right - x, band.height)


def _columns(
    structure: StructureData, pairs: set[tuple[str, str]]
) -> tuple[list[tuple[list[tuple[str, ...]], int, int]], dict[str, int]]:
    """Layers of groups with their first and last column, and the column of each component."""
    of = {name: group for group in structure.groups for name in group}
    group_pairs = {(of[a], of[b]) for a, b in pairs if of[a] != of[b]}
    depth = _depths(structure.groups, group_pairs)
    place = {name: i for i, name in enumerate(structure.order)}
    forward = {(a, b) for a, b in pairs if of[a] == of[b] and place[a] < place[b]}
    inner = _depths(structure.order, forward)
    layers: list[tuple[list[tuple[str, ...]], int, int]] = []
    columns: dict[str, int] = {}
    first = 0
    for number in range(max(depth.values()) + 1):
        groups = [g for g in structure.groups if depth[g] == number]
        last = first + max(inner[n] for g in groups for n in g)
        columns |= {n: first + inner[n] for g in groups for n in g}
        layers.append((groups, first, last))
        first = last + 1
    return layers, columns


def _depths(nodes: Sequence[Node], edges: set[tuple[Node, Node]]) -> dict[Node, int]:
    """Longest way to each node over `edges`, which have no cycle."""
    depth = dict.fromkeys(nodes, 0)
    for _ in nodes:
        late = [(b, depth[a] + 1) for a, b in edges if depth[b] <= depth[a]]
        if not late:
            break
        for node, at_least in late:
            depth[node] = max(depth[node], at_least)
    return depth


def _tracks(count: int) -> float:
    """Room for wires that come back to the left of a column, and for their tips."""
    return _TIP + TRACK * (count + 1) if count else 0.0


def _height(parts: Sequence[_Item | _Band], gap: float) -> float:
    return sum(part.height for part in parts) + gap * max(len(parts) - 1, 0)


def _mean(values: Iterable[float]) -> float:
    collected = list(values)
    return sum(collected) / len(collected) if collected else 0.0
