"""Writing: elements of SSP from plain data: connectors, connections, parameter sets, units. Knows no scenario."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import ceil
from typing import Any

from fmpy.model_description import ModelVariable
from lxml import etree

from cosim.balises.layout import TrackLayout
from cosim.run.balise_service import BALISE_EVENT
from cosim.scenario.scenario_tables import BalisesTable, ComponentTable
from cosim.ssp.annotation import LISTS
from cosim.ssp.common import FAMILIES, INTEGER, REAL, NamedUnit
from cosim.ssp.document import NAMESPACES, Node
from cosim.ssp.interfaces import Interface
from plant_models.hybrid.units import BASE_SYMBOLS, Unit
from plant_models.railway.track.balise_layout import UNUSED

TOOL = "fmu-observer"


NAME = "balise_reader"
READS_BALISES = "reads_balises"
"""Key of the annotation of the reader: it was added for other tools, and goes when the system is read back."""
TOLD = ("count", "time", "position")
PAGE = 16
_PARALLEL = 0
"""Tools that read SSP step all components with the outputs of the step before (OMSimulator, libcosim)."""


@dataclass(frozen=True)
class Reader:
    """A reader on its way into a package.

    Args:
        name: of its component. table: of that. links: its connections, as a scenario writes them.
    """

    name: str
    table: ComponentTable
    links: Sequence[str]


def make_reader(
    table: BalisesTable, layout: TrackLayout, interfaces: Mapping[str, Interface], taken: set[str], version: int
) -> Reader | None:
    """The reader that a system needs, or None where it has no observer that is notified by counts.

    Args:
        table: of the balises. layout: where they lie. interfaces: of all components.
        taken: inputs that have a source, as ``component.input``. version: of FMI.
    """
    listeners = [
        n
        for n, interface in interfaces.items()
        if is_told_by_counts(interface) and (table.receivers is None or n in table.receivers)
    ]
    listeners = [n for n in listeners if not {f"{n}.{BALISE_EVENT}_{field}" for field in TOLD} & taken]
    if not listeners or table.position is None or table.speed is None:
        return None
    name = NAME
    while name in interfaces:
        name += "_"
    links = [f"{table.position} -> {name}.position", f"{table.speed} -> {name}.speed"]
    links += [f"{name}.{BALISE_EVENT}_{field} -> {n}.{BALISE_EVENT}_{field}" for n in listeners for field in TOLD]
    options, parameters = _track(table, [float(position) for position in layout.positions])
    component: dict[str, Any] = {"model": "balise_reader", "as": f"fmu{version}", "options": options}
    component["parameters"] = {"input_instant": _PARALLEL, **parameters}
    return Reader(name, ComponentTable.model_validate(component), links)


def _track(table: BalisesTable, places: list[float]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Options and parameters of the reader for balises at these places."""
    if table.layout == "spacing":
        return {}, {"first_balise": places[0], "balise_spacing": table.spacing, "balise_total": len(places)}
    capacity = PAGE * ceil(len(places) / PAGE)  # few different FMUs, so that most need not be built
    return {"layout": "positions", "balise_capacity": capacity}, {
        "positions": places + [UNUSED] * (capacity - len(places))
    }


def is_told_by_counts(interface: Interface) -> bool:
    """Whether an FMU takes balises as a count, an instant and a position.

    Args:
        interface: of a component's FMU.
    """
    inputs = {v.name: FAMILIES[str(v.type)] for v in interface.variables.values() if v.causality == "input"}
    fields = [f"{BALISE_EVENT}_{field}" for field in TOLD]
    return all(field in inputs for field in fields) and inputs[fields[0]] == INTEGER


@dataclass
class Definitions:
    """Units and enumerations that one file uses; where two FMUs mean different things by one name, the second gets a
    new name.
    """

    units: dict[str, Unit] = field(default_factory=dict)
    enumerations: dict[str, Mapping[str, int]] = field(default_factory=dict)

    def unit(self, unit: NamedUnit) -> str:
        """The name of a unit in this file."""
        return _register(self.units, unit.name, unit.unit)

    def enumeration(self, name: str, items: Mapping[str, int]) -> str:
        """The name of an enumeration in this file.

        Args:
            items: numbers by name.
        """
        return _register(self.enumerations, name, dict(items))

    def write(self, root: Node, prefix: str) -> None:
        """Append the definitions to a root element, in the order of the schema.

        Args:
            prefix: of the namespace.
        """
        if self.enumerations:
            holder = child(root, prefix, "Enumerations")
            for name, items in self.enumerations.items():
                outer = child(holder, "ssc", "Enumeration", name=name)
                for item, value in items.items():
                    child(outer, "ssc", "Item", name=item, value=str(value))
        if self.units:
            holder = child(root, prefix, "Units")
            for name, unit in self.units.items():
                powers = {s: str(p) for s, p in zip(BASE_SYMBOLS, unit.exponents, strict=True) if p}
                scale = ({"factor": repr(unit.factor)} if unit.factor != 1.0 else {}) | (
                    {"offset": repr(unit.offset)} if unit.offset != 0.0 else {}
                )
                child(child(holder, "ssc", "Unit", name=name), "ssc", "BaseUnit", **powers, **scale)


def root_of(kind: str, tag: str, version: str, **attributes: str) -> Node:
    """A root element, for example ``root_of("ssv", "ParameterSet", "2.0", name="plant")``.

    Args:
        kind: of the document. tag: name of the element with its namespace.
        version: of the standard, ``1.0`` or ``2.0``. attributes: by name.
    """
    used = {prefix: NAMESPACES[prefix] for prefix in ("ssc", kind)}
    return etree.Element(f"{{{NAMESPACES[kind]}}}{tag}", nsmap=used, version=version, **attributes)


def child(parent: Node, prefix: str, tag: str, **attributes: str) -> Node:
    """A new last child.

    Args:
        parent: element that gets the child. prefix: of the namespace.
        tag: name of the element with its namespace. attributes: by name.
    """
    return etree.SubElement(parent, f"{{{NAMESPACES[prefix]}}}{tag}", attributes)


def text_of(root: Node) -> bytes:
    """The file.

    Args:
        root: element of the document.
    """
    etree.indent(root, space="  ")
    return etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)  # type: ignore[no-any-return]


def add_connector(
    parent: Node,
    variable: ModelVariable,
    definitions: Definitions,
    unit: NamedUnit | None,
    items: Mapping[str, int],
) -> None:
    """A connector for a variable of an FMU.

    Args:
        parent: ``Connectors`` element. variable: the variable. definitions: of the file.
        unit: of a real number. items: of an enumeration.
    """
    node = child(parent, "ssd", "Connector", name=variable.name, kind=str(variable.causality))
    kind = str(variable.type)
    attributes = {}
    if FAMILIES[kind] == REAL and unit is not None:
        attributes["unit"] = definitions.unit(unit)
    if kind == "Enumeration" and items:
        attributes["name"] = definitions.enumeration(
            getattr(variable.declaredType, "name", None) or variable.name, items
        )
    if kind == "Clock" and variable.intervalVariability:
        attributes["intervalVariability"] = str(variable.intervalVariability)
    if kind != "Enumeration" or items:  # the schema knows no enumeration without items; a type may be left out
        child(node, "ssc", kind, **attributes)
    for size in variable.shape or ():
        child(node, "ssc", "Dimension", size=str(size))


def add_parameter(parent: Node, name: str, kind: str, values: Sequence[Any], shape: Sequence[int]) -> None:
    """A parameter of a parameter set.

    Args:
        parent: ``Parameters`` element. kind: type in the words of SSP. values: in row-major order. shape: empty for a
            scalar.
        name: of the element.
    """
    node = child(parent, "ssv", "Parameter", name=name)
    texts = [_text(value, FAMILIES[kind]) for value in values]
    if FAMILIES[kind] in LISTS and shape:
        holder = child(node, "ssv", kind)
        for text in texts:
            child(holder, "ssv", "Value", value=text)
    else:
        child(node, "ssv", kind, value=" ".join(texts))
    for size in shape:
        child(node, "ssc", "Dimension", size=str(size))


def _text(value: Any, family: str) -> str:
    if family == REAL:
        return repr(float(value))
    if family == INTEGER:
        return str(int(value))
    return str(bool(value)).lower() if family == "Boolean" else str(value)


def _register(known: dict[str, Any], name: str, meaning: Any) -> str:
    chosen, number = name, 2
    while known.setdefault(chosen, meaning) != meaning:
        chosen, number = f"{name} ({number})", number + 1
    return chosen
