"""Writing: elements of SSP from plain data: connectors, connections, parameter sets, units. Knows no scenario."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from fmpy.model_description import ModelVariable
from lxml import etree

from cosim.ssp.annotation import LISTS
from cosim.ssp.common import FAMILIES, INTEGER, REAL
from cosim.ssp.document import NAMESPACES, Node
from fmus.fmi.units import NamedUnit
from plant_models.hybrid.units import BASE_SYMBOLS, Unit

TOOL = "fmu-observer"


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
