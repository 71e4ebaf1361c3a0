"""Nets: the connections of nested systems followed from each input back to what drives it, through every system on the
way.

Flattens; changes nothing. The directions follow the table "Allowed Connections" of SSP 2.0, section 5.4.2.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from cosim.components.description import read_description
from cosim.errors import FmuLoadError, nearest
from cosim.ssp.common import Step
from cosim.ssp.document import Node, fail
from cosim.ssp.interfaces import Interface
from cosim.ssp.lapses import Lapses
from cosim.ssp.package_data import (
    ComponentElement,
    Connector,
    DictionaryReference,
    End,
    SsdConnection,
    SsdElement,
    SystemElement,
)
from fmus.fmi.instance import shown
from fmus.fmi.sense import doubled_names
from fmus.fmi.units import NamedUnit

Path = tuple[str, ...]
"""Names of the elements from the root system downwards; the root itself is the empty path."""

_TO_ELEMENT: dict[str, set[str]] = {
    "constant": {"structuralParameter", "parameter", "input", "inout"},
    "structuralParameter": {"structuralParameter", "parameter", "input", "inout"},
    "calculatedParameter": {"parameter", "input", "inout"},
    "parameter": {"parameter", "input", "inout"},
    "input": {"input", "inout"},
    "output": {"input", "inout"},
    "local": {"input", "inout"},
    "inout": {"input"},
}
_TO_SYSTEM: dict[str, set[str]] = {
    "constant": {"constant", "calculatedParameter", "output", "local"},
    "structuralParameter": {"calculatedParameter", "output", "local"},
    "calculatedParameter": {"calculatedParameter", "output", "local"},
    "parameter": {"calculatedParameter", "output", "local"},
    "input": {"output", "local"},
    "output": {"output", "local"},
    "local": {"output", "local"},
    "inout": {"output", "local"},
}
SOURCES = {
    "system": {"structuralParameter", "parameter", "input"},
    "element": {"constant", "calculatedParameter", "output", "local", "inout"},
}
"""Kinds of connectors that can drive others, of the enclosing system and of its elements."""
_SIGNALS = ("input", "output", "inout")
_SINKS = ("input", "inout", "parameter", "structuralParameter")


@dataclass(frozen=True)
class Point:
    """A connector of one element, or one element of the array it is.

    Args:
        path: of the element. name: of the connector. indices: empty for the whole.
    """

    path: Path
    name: str
    indices: tuple[int, ...] = ()

    def __str__(self) -> str:
        return ".".join((*self.path, self.name)) + self.suffix

    @property
    def suffix(self) -> str:
        """The indices as a variable name has them."""
        return f"[{','.join(map(str, self.indices))}]" if self.indices else ""

    @property
    def whole(self) -> Point:
        """The whole array."""
        return Point(self.path, self.name)


@dataclass(frozen=True)
class _Hop:
    """A connection in the direction of its data."""

    source: Point
    target: Point
    suppress: bool
    step: Step | None
    node: Node


@dataclass(frozen=True)
class Chain:
    """The way into one input of a component.

    Args:
        root: what drives it, or the outermost connector that nothing drives. hops: from there to the input.
    """

    root: Point
    hops: tuple[_Hop, ...]

    @property
    def sink(self) -> Point:
        """The input at its end."""
        return self.hops[-1].target

    def after(self, point: Point) -> tuple[_Hop, ...] | None:
        """The hops behind a point on the way, or None where the way does not lead through it."""
        for number, hop in enumerate(self.hops):
            if hop.source.whole == point:
                return self.hops[number:]
        return None


class Nets:
    """All elements of a nested system by path, and the connections between their connectors.

    Args:
        root: the root system. lapses: receives names that an FMU gives twice.

    Raises:
        ScenarioError: a connector that does not exist or does not fit its FMU, a connection without direction, two
        drivers of
            one connector, or connections in a circle.
    """

    def __init__(self, root: SystemElement, lapses: Lapses) -> None:
        self.root = root
        self.elements: dict[Path, SsdElement] = dict(_walk(root, ()))
        self.interfaces: dict[Path, Interface] = {
            p: _interface_of(e, lapses) for p, e in self.elements.items() if isinstance(e, ComponentElement)
        }
        for path, interface in self.interfaces.items():
            self._leave_out(path, interface, lapses)
            for connector in self.elements[path].connectors.values():
                interface.check(connector)
        self.dictionaries = self._dictionaries()
        self.incoming: dict[Point, _Hop] = {}
        for path, element in self.elements.items():
            if isinstance(element, SystemElement):
                for wire in element.wires:
                    self._add(self._directed(path, element, wire))
        self.chains = [self._chain(point) for point in self.incoming if self._is_sink(point)]

    def connector(self, point: Point) -> Connector:
        """The connector at a point."""
        return self.elements[point.path].connectors[point.name]

    def kind(self, point: Point) -> str:
        """Kind of a connector; what an FMU's unspecified connector is, its variable says.

        Args:
            point: end of a connection.
        """
        kind = self.connector(point).kind
        if kind == "unspecified" and point.path in self.interfaces:
            return str(self.interfaces[point.path].variables[point.name].causality)
        return kind

    def unit(self, point: Point) -> NamedUnit | None:
        """Unit of a connector, its own or that of the FMU's variable.

        Args:
            point: end of a connection.
        """
        own = self.connector(point).type
        if own is not None and own.unit is not None:
            return own.unit
        return self.interfaces[point.path].unit(point.name) if point.path in self.interfaces else None

    def _leave_out(self, path: Path, interface: Interface, lapses: Lapses) -> None:
        """Leave out connectors that carry nothing: their FMU has no such variable, and no connection leads to them.

        Packages of Dymola have one for each parameter of the model, those that its FMU does not show included.
        """
        element, wires = self.elements[path], self._system(path[:-1]).wires
        connected = {end.connector for wire in wires for end in (wire.start, wire.end) if end.element == path[-1]}
        idle: dict[str, list[Connector]] = {}
        for connector in element.connectors.values():
            unknown = connector.name not in interface.variables and connector.name not in connected
            if unknown and connector.kind not in _SIGNALS:
                idle.setdefault(connector.kind, []).append(connector)
        for kind, left_out in idle.items():
            names = [connector.name for connector in left_out]
            several = len(names) > 1
            lapses.forgive(
                left_out[0].node,
                f"{len(names)} connector{'s' if several else ''} of kind {kind!r} of {interface.what} "
                f"{'have' if several else 'has'} no variable and no connection, and {'are' if several else 'is'} left "
                f"out: {shown(names)}.",
            )
            for name in names:
                del element.connectors[name]

    def _dictionaries(self) -> dict[tuple[Path, str, str], list[Point]]:
        """Connectors that stand for each entry of each dictionary."""
        members: dict[tuple[Path, str, str], list[Point]] = {}
        for path, element in self.elements.items():
            if isinstance(element, DictionaryReference):
                owner = self._owner(path, element)
                entries = self._system(owner).dictionaries[element.dictionary]
                for name, connector in element.connectors.items():
                    if name not in entries:
                        fail(
                            connector.node,
                            f"dictionary {element.dictionary!r} has no entry {name!r}; {nearest(name, entries)}",
                        )
                    members.setdefault((owner, element.dictionary, name), []).append(Point(path, name))
        return members

    def _owner(self, path: Path, reference: DictionaryReference) -> Path:
        """The system whose dictionary is meant: the nearest one outwards that has it."""
        for depth in range(len(path) - 1, -1, -1):
            if reference.dictionary in self._system(path[:depth]).dictionaries:
                return path[:depth]
        fail(reference.node, f"no system around {reference.name!r} has a signal dictionary {reference.dictionary!r}.")

    def _system(self, path: Path) -> SystemElement:
        element = self.elements[path]
        assert isinstance(element, SystemElement), "only systems hold elements"
        return element

    def _directed(self, path: Path, system: SystemElement, wire: SsdConnection) -> _Hop:
        start, end = (self._point(path, system, side, wire.node) for side in (wire.start, wire.end))
        forward, backward = self._allowed(path, start, end), self._allowed(path, end, start)
        if forward == backward:
            problem = "could lead either way" if forward else "is not one that SSP allows"
            kinds = f"kinds {self.kind(start)!r} and {self.kind(end)!r}"
            fail(wire.node, f"the connection between {start} and {end} {problem} ({kinds}): one must drive the other.")
        source, target = (start, end) if forward else (end, start)
        return _Hop(source, target, wire.suppress, wire.step, wire.node)

    def _point(self, path: Path, system: SystemElement, end: End, node: Node) -> Point:
        owner: SsdElement = system
        if end.element is not None:
            if end.element not in system.elements:
                what = f"system {system.name!r} has no element {end.element!r}"
                fail(node, f"connection: {what}; {nearest(end.element, system.elements)}")
            owner, path = system.elements[end.element], (*path, end.element)
        if end.connector not in owner.connectors:
            what = f"{owner.name!r} has no connector {end.connector!r}"
            fail(node, f"connection: {what}; {nearest(end.connector, owner.connectors)}")
        return Point(path, end.connector, end.indices)

    def _allowed(self, path: Path, source: Point, target: Point) -> bool:
        sides = ["system" if point.path == path else "element" for point in (source, target)]
        kinds = [self.kind(point) for point in (source, target)]
        table = _TO_SYSTEM if sides[1] == "system" else _TO_ELEMENT
        possible = SOURCES[sides[0]] if kinds[0] == "unspecified" else SOURCES[sides[0]] & {kinds[0]}
        return any(kinds[1] in table[kind] or kinds[1] == "unspecified" for kind in possible)

    def _add(self, hop: _Hop) -> None:
        other = self.incoming.setdefault(hop.target, hop)
        if other is not hop:
            fail(hop.node, f"{hop.target} has two sources, {other.source} and {hop.source}; remove one connection.")

    def _is_sink(self, point: Point) -> bool:
        return point.path in self.interfaces and self.kind(point) in _SINKS

    def _chain(self, sink: Point) -> Chain:
        hops: list[_Hop] = []
        point, seen = sink, {sink}
        while (hop := self._driver(point)) is not None:
            hops.insert(0, hop)
            point = hop.source
            if point in seen:
                fail(hop.node, f"the connections to {sink} lead in a circle through {point}; no component drives it.")
            seen.add(point)
            if point.path in self.interfaces:
                break
        return Chain(point, tuple(hops))

    def _driver(self, point: Point) -> _Hop | None:
        """The connection into a point: its own, that of the whole array, or that of the dictionary entry it stands
        for.
        """
        if point in self.incoming:
            return self.incoming[point]
        if point.indices and point.whole in self.incoming:
            hop = self.incoming[point.whole]
            if hop.source.indices:
                fail(hop.node, f"{point.whole} is driven by one element of an array only; {point} is none of it.")
            return _Hop(Point(hop.source.path, hop.source.name, point.indices), point, hop.suppress, hop.step, hop.node)
        for (_, dictionary, _), members in self.dictionaries.items():
            if point.whole in members:
                drivers = [m for m in members if m in self.incoming]
                if len(drivers) > 1:
                    names = " and ".join(map(str, drivers))
                    fail(
                        self.connector(point).node,
                        f"the signal {point.name!r} of {dictionary!r} has two sources, at {names}.",
                    )
                return _Hop(drivers[0], point, False, None, self.connector(point).node) if drivers else None
        return None


def _walk(element: SsdElement, path: Path) -> Iterator[tuple[Path, SsdElement]]:
    yield path, element
    if isinstance(element, SystemElement):
        for name, child in element.elements.items():
            yield from _walk(child, (*path, name))


def _interface_of(element: ComponentElement, lapses: Lapses) -> Interface:
    """The interface of a component's FMU."""
    try:
        description = read_description(element.fmu, element.name)
    except FmuLoadError as error:
        fail(element.node, str(error).replace(str(element.fmu), element.member))
    doubled = doubled_names(description)
    if doubled is not None:
        lapses.forgive(element.node, f"{element.member}: {doubled}")
    return Interface(description, f"component {element.name!r} ({element.member})")
