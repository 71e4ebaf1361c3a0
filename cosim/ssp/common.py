"""Common content (SSC): types, units, enumerations, transformations, as all parts of SSP write them. Reads elements only."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from cosim.ssp.document import Node, fail, find, find_all, short
from plant_models.hybrid.units import BASE_SYMBOLS, Unit

REAL, INTEGER = "Real", "Integer"
FAMILIES: dict[str, str] = {
    **dict.fromkeys(("Real", "Float64", "Float32"), REAL),
    **dict.fromkeys(("Integer", *(f"{sign}Int{bits}" for sign in ("", "U") for bits in (8, 16, 32, 64))), INTEGER),
    **{name: name for name in ("Boolean", "String", "Enumeration", "Binary", "Clock")},
}
"""What a type of SSP or FMI is, whatever its size."""
TRANSFORMATIONS = (
    "LinearTransformation", "BooleanMappingTransformation", "IntegerMappingTransformation", "EnumerationMappingTransformation",
)  # fmt: skip


@dataclass(frozen=True)
class NamedUnit:
    """A unit and what a file calls it."""

    name: str
    unit: Unit


@dataclass(frozen=True)
class Type:
    """Type of a connector, a dictionary entry or a parameter.

    Args:
        name: as written, for example ``Float64``. unit: of a real number, where one is given. enumeration: name of its type.
    """

    name: str
    unit: NamedUnit | None = None
    enumeration: str | None = None

    @property
    def family(self) -> str:
        """``Real``, ``Integer``, ``Boolean``, ``String``, ``Enumeration``, ``Binary`` or ``Clock``."""
        return FAMILIES[self.name]


@dataclass(frozen=True)
class ValueMap:
    """A table of values: by number, or by the names of items.

    Args:
        kind: ``Boolean``, ``Integer`` or ``Enumeration``. entries: target by source, both as written.
    """

    kind: str
    entries: Mapping[str, str]


@dataclass(frozen=True)
class Linear:
    """``target = factor * source + offset``, the source already in the unit of the target."""

    factor: float = 1.0
    offset: float = 0.0


Step = Linear | ValueMap
"""One transformation as it is written."""


def read_units(root: Node, prefix: str) -> dict[str, Unit]:
    """The units that a file defines, by name.

    Args:
        root: its root element. prefix: of its own namespace.

    Raises:
        ScenarioError: a name is given twice.
    """
    units: dict[str, Unit] = {}
    for node in find_all(root, f"{prefix}:Units/ssc:Unit"):
        base = find(node, "ssc:BaseUnit")
        name = node.get("name")
        if name in units:
            fail(node, f"unit {name!r} is defined twice.")
        powers = tuple(int(base.get(symbol, "0")) for symbol in BASE_SYMBOLS)
        units[name] = Unit(powers, float(base.get("factor", "1")), float(base.get("offset", "0")))
    return units


def read_type(node: Node, units: Mapping[str, Unit], prefix: str = "ssc") -> Type | None:
    """The type written within an element, or None where it has none.

    Args:
        node: connector, dictionary entry or parameter. units: those of its file. prefix: of the type's namespace.

    Raises:
        ScenarioError: it names a unit that the file does not define.
    """
    for child in node:
        name = short(child.tag)
        if name in FAMILIES and find(node, f"{prefix}:{name}") is child:
            return Type(name, _unit(child, units), child.get("name") if name == "Enumeration" else None)
    return None


def read_transformation(node: Node) -> Step | None:
    """The transformation of a connection or a mapping entry.

    Raises:
        ScenarioError: a mapping has two targets for one source.
    """
    for child in node:
        name = short(child.tag)
        if name == "LinearTransformation":
            return Linear(float(child.get("factor", "1")), float(child.get("offset", "0")))
        if name in TRANSFORMATIONS:
            return ValueMap(name.removesuffix("MappingTransformation"), _entries(child))
    return None


def _entries(node: Node) -> dict[str, str]:
    entries: dict[str, str] = {}
    for entry in find_all(node, "ssc:MapEntry"):
        source = entry.get("source")
        if source in entries:
            fail(entry, f"two entries map the value {source!r}; a mapping must be unambiguous.")
        entries[source] = entry.get("target")
    return entries


def _unit(node: Node, units: Mapping[str, Unit]) -> NamedUnit | None:
    name = node.get("unit")
    if name is None:
        return None
    if name not in units:
        fail(node, f"unit {name!r} is not defined in this file; its Units element has {', '.join(map(repr, units)) or 'none'}.")
    return NamedUnit(name, units[name])
