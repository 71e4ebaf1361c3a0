"""System structures (SSD): from a package to plain data, nested systems, structures and packages included."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TypeVar

from cosim.errors import nearest
from cosim.scenario.package_names import split_variant
from cosim.ssp.annotation import read_extras, read_parameter_set
from cosim.ssp.common import UnitTable, read_transformation, read_type
from cosim.ssp.document import Node, fail, find, find_all, flag, parse, short, validated
from cosim.ssp.lapses import Lapses
from cosim.ssp.package import DEFAULT_VARIANT, Package
from cosim.ssp.package_data import (
    Binding,
    ComponentElement,
    Connector,
    DictionaryReference,
    End,
    SsdConnection,
    SsdElement,
    SsdEntry,
    SsdStructure,
    SystemElement,
)
from fmus.fmi.standard import Interface

FMU = "application/x-fmu-sharedlibrary"
_DEFINITION, _PACKAGE = "application/x-ssp-definition", "application/x-ssp-package"
_IMPLEMENTATIONS: dict[str, Interface | None] = {
    "any": None,
    "CoSimulation": None,  # what is stepped where an FMU offers both
    "ModelExchange": "model-exchange",
}
"""Which interface of an FMU is stepped, by what a package says of its component; None where nothing is to be said."""

_DEEPEST = 64
Kind = TypeVar("Kind")


_FIXED = ("FixedStepAlgorithm", "FixedStepMaster")
_VARIABLE = ("VariableStepAlgorithm", "VariableStepMaster", "VariableStepSolver")
_LENGTHS = ("baseStepSize", "stepSize")
_HOLDERS = ("ssd:DefaultExperiment/ssd:Annotations", "ssd:System/ssd:Annotations", "ssd:Annotations")
"""Where they stand: of the whole run, in the order in which they count. Those of nested systems and of components do
not.
"""


def _read_step(root: Node, lapses: Lapses) -> float | None:
    """The communication step that an annotation of a structure asks for [s]; None where none does."""
    for node in _annotated(root):
        name = short(node.tag)
        length = next((node.get(key) for key in _LENGTHS if node.get(key) is not None), "")
        if name in _VARIABLE:
            lapses.note(
                node, f"the annotation asks for {name}, which is not carried out; the communication step is fixed."
            )
        elif name in _FIXED:
            try:
                step = float(length)
            except ValueError:
                step = 0.0
            if 0.0 < step < float("inf"):
                return step
            lapses.note(node, f"the annotation's {name} has the step {length!r}, expected seconds; it is not used.")
    return None


def _annotated(root: Node) -> Iterator[Node]:
    for holder in _HOLDERS:
        for annotation in find_all(root, f"{holder}/ssc:Annotation"):
            yield from (node for node in annotation.iter() if isinstance(node.tag, str))


def read_structure(package: Package, member: str, outer: tuple[str, ...] = ()) -> SsdStructure:
    """A system structure of a package.

    Args:
        package: the package. member: name of the ``.ssd`` file. outer: structures that it is nested in.

    Raises:
        ScenarioError: with file and line.
    """
    root = _parsed(package, member, "ssd")
    experiment = find(root, "ssd:DefaultExperiment")
    start, stop = (None, None) if experiment is None else (experiment.get("startTime"), experiment.get("stopTime"))
    return SsdStructure(
        name=root.get("name"),
        description=root.get("description", ""),
        version=root.get("version"),
        system=_Reader(package, member, root, (*outer, f"{package.path}#{member}")).system(find(root, "ssd:System")),
        start=None if start is None else float(start),
        stop=None if stop is None else float(stop),
        extras=read_extras(root),
        step=_read_step(root, package.lapses),
    )


class _Reader:
    """Reads the elements of one file.

    Args:
        package, member: where it is. root: its root element. outer: this structure and those it is nested in.
    """

    def __init__(self, package: Package, member: str, root: Node, outer: tuple[str, ...]) -> None:
        self.package, self.member, self.root, self.outer = package, member, root, outer
        self.units = UnitTable(root, "ssd", package.lapses)
        self.readers: dict[str, Callable[[Node], SsdElement]] = {
            "Component": self.component,
            "System": self.system,
            "SignalDictionaryReference": self.reference,
        }

    def system(self, node: Node) -> SystemElement:
        """A system and all it holds."""
        elements: dict[str, SsdElement] = {}
        for child in find_all(node, "ssd:Elements/*"):
            element = self.readers[short(child.tag)](child)
            if element.name in elements:
                fail(child, f"system {node.get('name')!r} has two elements named {element.name!r}.")
            elements[element.name] = element
        return SystemElement(
            node.get("name"),
            self.connectors(node),
            self.bindings(node),
            node,
            elements=elements,
            wires=[self.wire(child) for child in find_all(node, "ssd:Connections/ssd:Connection")],
            dictionaries=self.dictionaries(node),
        )

    def component(self, node: Node) -> SsdElement:
        """A component: an FMU, or a structure of its own."""
        kind, source = node.get("type", FMU).partition(";")[0].strip(), node.get("source")
        if kind not in (FMU, _DEFINITION, _PACKAGE):
            fail(
                node,
                f"component {node.get('name')!r} is of type {kind!r}; FMUs ({FMU}) and nested structures can be run.",
            )
        if source is None:
            fail(node, f"component {node.get('name')!r} has no source: nothing says what it does, so it cannot be run.")
        if kind != FMU:
            return self._nested(node, kind, source)
        implementation = node.get("implementation", "any")
        if implementation not in _IMPLEMENTATIONS:
            fail(
                node,
                f"component {node.get('name')!r} asks for {implementation}; expected {', '.join(_IMPLEMENTATIONS)}.",
            )
        member = self.package.member(node, source, self.member)
        return ComponentElement(
            node.get("name"),
            self.connectors(node),
            self.bindings(node, member),
            node,
            fmu=self.package.file(member),
            member=member,
            extras=read_extras(node),
            interface=_IMPLEMENTATIONS[implementation],
        )

    def reference(self, node: Node) -> DictionaryReference:
        """A signal dictionary reference."""
        return DictionaryReference(
            node.get("name"), self.connectors(node), self.bindings(node), node, dictionary=node.get("dictionary")
        )

    def connectors(self, node: Node) -> dict[str, Connector]:
        """The connectors of an element by name."""
        found: dict[str, Connector] = {}
        for child in find_all(node, "ssd:Connectors/ssd:Connector"):
            name = child.get("name")
            if name in found:
                fail(child, f"{node.get('name')!r} has two connectors named {name!r}.")
            kind = read_type(child, self.units)
            found[name] = Connector(name, child.get("kind"), kind, len(find_all(child, "ssc:Dimension")), child)
        return found

    def wire(self, node: Node) -> SsdConnection:
        """A connection."""
        start, end = (
            End(
                self.element(node, f"{side}Element"),
                node.get(f"{side}Connector"),
                _indices(node.get(f"{side}Indices", "")),
            )
            for side in ("start", "end")
        )
        return SsdConnection(start, end, flag(node, "suppressUnitConversion"), read_transformation(node), node)

    def element(self, node: Node, key: str) -> str | None:
        """The element that one end of a connection names; None for the system itself."""
        name: str | None = node.get(key)
        if name == "":  # no element can have that name
            self.package.lapses.forgive(
                node, f'{key}="" names no element; taken as the system itself, for which it is left out.'
            )
        return name or None

    def bindings(self, node: Node, component: str | None = None) -> list[Binding]:
        """The parameter bindings of an element in their order. `component`: the member that is the component's
        source.
        """
        return [
            self._binding(child, component) for child in find_all(node, "ssd:ParameterBindings/ssd:ParameterBinding")
        ]

    def dictionaries(self, node: Node) -> dict[str, dict[str, Connector]]:
        """The signal dictionaries of a system, their entries by name."""
        found: dict[str, dict[str, Connector]] = {}
        for child in find_all(node, "ssd:SignalDictionaries/ssd:SignalDictionary"):
            if child.get("name") in found:
                fail(child, f"system {node.get('name')!r} has two signal dictionaries named {child.get('name')!r}.")
            root = self._part(child, "ssb", None)
            units = UnitTable(root, "ssb", self.package.lapses)
            entries = find_all(root, "ssb:DictionaryEntry")
            found[child.get("name")] = {
                e.get("name"): Connector(
                    e.get("name"), "inout", read_type(e, units), len(find_all(e, "ssc:Dimension")), e
                )
                for e in entries
            }
        return found

    def _binding(self, node: Node, component: str | None) -> Binding:
        holder = find(node, "ssd:ParameterValues")
        parameters = read_parameter_set(
            self._part(node, "ssv", component, holder), node.get("prefix", ""), self.package.lapses
        )
        mapping: tuple[SsdEntry, ...] | None = None
        mapped = find(node, "ssd:ParameterMapping")
        if mapped is not None:
            mapping = _read_mapping(self._part(mapped, "ssm", component, mapped))
        return Binding(parameters, mapping, node)

    def _part(self, node: Node, kind: str, component: str | None, holder: Node | None = None) -> Node:
        """The root of a part that is written inline or in a file of its own."""
        holder = node if holder is None else holder
        source, what = node.get("source"), short(node.tag)
        media = {"ssv": "parameter-set", "ssm": "parameter-mapping", "ssb": "signal-dictionary"}[kind]
        if node.get("type", f"application/x-ssp-{media}") != f"application/x-ssp-{media}":
            fail(node, f"{what} of type {node.get('type')!r} cannot be read; application/x-ssp-{media} can.")
        if source is None:
            inline = [child for child in holder if short(child.tag) != "Annotations"]
            if not inline:
                fail(node, f"{what} has neither a source nor inline content.")
            return validated(inline[0], _title(self.package, self.member), kind)
        if node.get("sourceBase", "SSD") != "SSD" and component is not None:
            fail(node, f"{what}: sources within the component ({component}) are not read; put {source!r} beside it.")
        member = self.package.member(node, source, self.member)
        return _parsed(self.package, member, kind)

    def _nested(self, node: Node, kind: str, source: str) -> SystemElement:
        """A component that is a structure of its own: its system takes its place, its bindings come last."""
        if len(self.outer) >= _DEEPEST:
            fail(node, f"systems are nested more than {_DEEPEST} deep.")
        inner = self._referenced(node, kind, source)
        inner.name = node.get("name")
        inner.bindings = [*inner.bindings, *self.bindings(node)]
        return inner

    def _referenced(self, node: Node, kind: str, source: str) -> SystemElement:
        path, fragment = split_variant(source)
        if not path:
            return self._equal_document(node, fragment)
        member = self.package.member(node, path, self.member)
        package = self.package
        if kind == _PACKAGE:
            package = Package(
                self.package.file(member), _title(self.package, member), self.package.unpacked, self.package.lapses
            )
            member = fragment or DEFAULT_VARIANT
            if member not in package.sizes:
                fail(node, f"{path} has no {member!r}; {nearest(member, package.variants)}")
        key = f"{package.path}#{member}"
        if key in self.outer:
            fail(node, f"component {node.get('name')!r} nests {source!r} within itself.")
        return read_structure(package, member, self.outer).system

    def _equal_document(self, node: Node, identity: str) -> SystemElement:
        """A system of this file used once more."""
        key = f"{self.package.path}#{self.member}#{identity}"
        systems = [s for s in self.root.iter(f"{{{node.nsmap[node.prefix]}}}System") if s.get("id") == identity]
        if not systems:
            fail(node, f"source '#{identity}': this file has no system with that id.")
        if key in self.outer or systems[0] in list(node.iterancestors()):
            fail(node, f"component {node.get('name')!r} nests the system '#{identity}' within itself.")
        return _Reader(self.package, self.member, self.root, (*self.outer, key)).system(systems[0])


def _parsed(package: Package, member: str, kind: str) -> Node:
    title = _title(package, member)

    def undeclared(prefix: str, namespace: str) -> None:
        package.lapses.forgive(title, f"prefix {prefix!r} is used and not declared; taken as {namespace!r}.")

    return parse(package.read(member), title, kind, undeclared)


def _indices(text: str) -> tuple[int, ...]:
    return tuple(int(index) for index in text.split())


def _title(package: Package, member: str) -> str:
    return f"{package.title}: {member}"


def _read_mapping(root: Node) -> tuple[SsdEntry, ...]:
    """The entries of a valid ParameterMapping."""
    entries: dict[str, SsdEntry] = {}
    for node in find_all(root, "ssm:MappingEntry"):
        source, target = node.get("source"), node.get("target")
        if target in entries:
            fail(node, f"two parameters are mapped to {target!r}; map one.")
        entries[target] = SsdEntry(
            source, target, flag(node, "suppressUnitConversion"), read_transformation(node), node
        )
    return tuple(entries.values())
