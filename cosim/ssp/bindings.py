"""Parameter bindings: from parameter sets at any level of nested systems to start values of FMU variables.

Names are resolved and precedence is decided as SSP 2.0, section 5.3.3 says: later bindings before earlier ones, outer
systems before inner ones. Values are converted to the units of the variables.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from cosim.errors import nearest
from cosim.ssp.annotation import LISTS
from cosim.ssp.common import FAMILIES, INTEGER, REAL
from cosim.ssp.document import Node, fail
from cosim.ssp.lapses import Lapses
from cosim.ssp.nets import Nets, Path, Point
from cosim.ssp.package_data import Binding, ComponentElement, Parameter, SsdElement, SsdEntry, SystemElement
from cosim.ssp.pipe import BOOLEANS, Pipe
from fmus.fmi.instance import shown
from fmus.fmi.units import NamedUnit

Scalar = float | str
Value = Scalar | list[Scalar]
"""A start value as a scenario writes it."""
Starts = dict[Path, dict[str, Value]]
"""Start values by path of the component and name of the variable."""
_ACCEPTED: dict[str, set[str]] = {
    REAL: {REAL, INTEGER},
    INTEGER: {INTEGER},
    "Boolean": {"Boolean"},
    "String": {"String"},
    "Enumeration": {"Enumeration", INTEGER},
    "Binary": {"Binary"},
}
"""Types of parameters by the type of the variable that they may set; nothing may be lost."""


@dataclass(frozen=True)
class _StatedParameter:
    """One value on its way to a variable.

    Args:
        parameter: as written. entry: of the mapping it goes through, where there is one.
    """

    parameter: Parameter
    entry: SsdEntry | None = None

    @property
    def node(self) -> Node:
        """Where it is written, for messages."""
        return self.parameter.node if self.entry is None else self.entry.node

    def arrives(self, unit: NamedUnit | None) -> Pipe:
        """What becomes of its numbers up to a target with this unit."""
        suppress, step = (False, None) if self.entry is None else (self.entry.suppress, self.entry.step)
        return Pipe(self.parameter.type.unit).through(unit, suppress, step, self.node)


def start_values(nets: Nets, lapses: Lapses) -> Starts:
    """Start values that the bindings of all elements give.

    Args:
        nets: the elements. lapses: receives parameters that nothing is called.

    Raises:
        ScenarioError: a value that does not fit its variable, or a mapping to what does not exist.
    """
    applying = _Applying(nets, lapses)
    # what is applied later counts, and outer systems count most
    for path in sorted(nets.elements, key=len, reverse=True):
        for binding in nets.elements[path].bindings:
            applying.apply(binding, path)
    return applying.starts


class _Applying:
    """Applies bindings one after the other."""

    def __init__(self, nets: Nets, lapses: Lapses) -> None:
        self.nets, self.lapses = nets, lapses
        self.starts: Starts = {}

    def apply(self, binding: Binding, path: Path) -> None:
        """All parameters of a binding of the element at `path`, or those that its mapping names."""
        parameters = {p.name: p for p in binding.parameters}
        if binding.mapping is None:
            for name, parameter in parameters.items():
                if not self.assign(_StatedParameter(parameter), name, path):
                    self.lapses.note(
                        parameter.node, f"parameter {name!r} is {self.nothing(name, path)}, so it is ignored."
                    )
            return
        mapped = {entry.source for entry in binding.mapping}
        if unmapped := [name for name in parameters if name not in mapped]:
            self.lapses.note(
                parameters[unmapped[0]].node,
                f"no entry of the parameter mapping takes {shown(unmapped)}, so "
                f"{'they are' if len(unmapped) > 1 else 'it is'} not set.",
            )
        for entry in binding.mapping:
            if entry.source not in parameters:
                known = nearest(entry.source, parameters)
                self.lapses.note(entry.node, f"{entry.source!r} is mapped and not in the parameter set; {known}")
            elif not self.assign(_StatedParameter(parameters[entry.source], entry), entry.target, path):
                fail(entry.node, f"{entry.source!r} is mapped to {entry.target!r}, {self.nothing(entry.target, path)}.")

    def assign(self, stated: _StatedParameter, name: str, path: Path) -> bool:
        """Set everything that `name` can mean within the element at `path`; whether there was anything."""
        points = [p for p in _targets(self.nets.elements[path], path, name) if self.exists(p)]
        for point in points:
            arrived = stated.arrives(self.unit(point))
            if point.path in self.nets.interfaces:
                self.set(stated, arrived, point)
            else:
                self.spread(stated, arrived, point)
        return bool(points)

    def spread(self, stated: _StatedParameter, pipe: Pipe, point: Point) -> None:
        """A value for a connector of a system goes to all inputs behind it."""
        for chain in self.nets.chains:
            hops = chain.after(point)
            if hops is None:
                continue
            final = pipe
            for hop in hops:
                final = final.through(self.nets.unit(hop.target), hop.suppress, hop.step, hop.node)
            self.set(stated, final.through(self.unit(chain.sink), False, None, stated.node), chain.sink)

    def set(self, stated: _StatedParameter, pipe: Pipe, point: Point) -> None:
        """Set one variable of one component."""
        parameter, node = stated.parameter, stated.node
        interface, name = self.nets.interfaces[point.path], self.variable(point)
        kind, family = interface.variables[name].type, FAMILIES[interface.variables[name].type]
        if parameter.type.family not in _ACCEPTED.get(family, set()):
            fail(node, f"parameter {parameter.name!r} is a {parameter.type.name}, {point} is a {kind}.")
        values = [_value(text, parameter, pipe, node) for text in parameter.values]
        if family == "Enumeration":
            _check_items(values, interface.items(name), point, node)
        self.starts.setdefault(point.path, {})[point.name + point.suffix] = values if parameter.array else values[0]

    def exists(self, point: Point) -> bool:
        """Whether the component has this variable, or an array of this name as variables of their own."""
        return (
            point.path not in self.nets.interfaces or self.variable(point) in self.nets.interfaces[point.path].variables
        )

    def variable(self, point: Point) -> str:
        """Name of a variable that says what the point is."""
        return point.name if point.name in self.nets.interfaces[point.path].variables else f"{point.name}[1]"

    def unit(self, point: Point) -> NamedUnit | None:
        """The unit in which a value is set: the FMU's own, whatever the connector shows."""
        if point.path in self.nets.interfaces:
            return self.nets.interfaces[point.path].unit(self.variable(point))
        return self.nets.unit(point)

    def nothing(self, name: str, path: Path) -> str:
        """That there is nothing of this name, and what there is."""
        return f"nothing of {'.'.join(path) or 'the root system'} ({nearest(name, self.names(path)).rstrip('.')})"

    def names(self, path: Path) -> list[str]:
        """Everything a parameter of this element can be called."""
        element = self.nets.elements[path]
        names = list(self.nets.interfaces[path].variables if path in self.nets.interfaces else element.connectors)
        if isinstance(element, SystemElement):
            names += [f"{child}.{inner}" for child in element.elements for inner in self.names((*path, child))]
        return names


def _targets(element: SsdElement, path: Path, name: str) -> Iterator[Point]:
    """What a hierarchical name can mean: a variable of a component, or connectors of systems and all that lies
    below.
    """
    if isinstance(element, ComponentElement) or name in element.connectors:
        yield Point(path, name)
    if isinstance(element, SystemElement):
        for child_name, child in element.elements.items():
            if name.startswith(f"{child_name}."):
                yield from _targets(child, (*path, child_name), name.removeprefix(f"{child_name}."))


def _value(text: str, parameter: Parameter, pipe: Pipe, node: Node) -> Scalar:
    family = parameter.type.family
    if family in LISTS:
        return pipe.item(text, node)
    number = BOOLEANS[text] if family == "Boolean" else int(text) if family == INTEGER else float(text)
    return pipe.number(number, node)


def _check_items(values: list[Scalar], items: dict[str, int], point: Point, node: Node) -> None:
    for value in values:
        if isinstance(value, str) and value not in items:
            fail(node, f"{point} has no item {value!r}; {nearest(value, items)}")
