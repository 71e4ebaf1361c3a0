"""Common content (SSC): types, units, enumerations, transformations, as all parts of SSP write them. Reads elements
only.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from cosim.ssp.document import Node, fail, find, find_all, short
from cosim.ssp.lapses import Lapses
from fmus.fmi.units import NamedUnit
from plant_models.hybrid.units import BASE_SYMBOLS, Unit, UnitError, parse_unit

REAL, INTEGER = "Real", "Integer"
FAMILIES: dict[str, str] = {
    **dict.fromkeys(("Real", "Float64", "Float32"), REAL),
    **dict.fromkeys(("Integer", *(f"{sign}Int{bits}" for sign in ("", "U") for bits in (8, 16, 32, 64))), INTEGER),
    **{name: name for name in ("Boolean", "String", "Enumeration", "Binary", "Clock")},
}
"""What a type of SSP or FMI is, whatever its size."""
_RAD = BASE_SYMBOLS.index("rad")  # the last one
_TRANSFORMATIONS = (
    "LinearTransformation",
    "BooleanMappingTransformation",
    "IntegerMappingTransformation",
    "EnumerationMappingTransformation",
)


@dataclass(frozen=True)
class Type:
    """Type of a connector, a dictionary entry or a parameter.

    Args:
        name: as written, for example ``Float64``. unit: of a real number, where one is given. enumeration: name of its
            type.
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


class UnitTable:
    """The units that a file defines, by name.

    A file that uses what it does not define is read as far as that has one meaning: no name is no unit, and brackets
    around a name are not part of it. What is left is a name only, whatever others mean by it: a number with it can go
    where the name is the same or none, and nowhere else.

    Args:
        root: root element of the file. prefix: of its own namespace. lapses: receives what is used and not defined.

    Raises:
        ScenarioError: a name is given twice.
    """

    def __init__(self, root: Node, prefix: str, lapses: Lapses) -> None:
        self._lapses = lapses
        self._units: dict[str, Unit] = {}
        for node in find_all(root, f"{prefix}:Units/ssc:Unit"):
            base = find(node, "ssc:BaseUnit")
            name = node.get("name")
            if name in self._units:
                fail(node, f"unit {name!r} is defined twice.")
            powers = tuple(int(base.get(symbol, "0")) for symbol in BASE_SYMBOLS)
            self._units[name] = Unit(powers, float(base.get("factor", "1")), float(base.get("offset", "0")))
            self._compare(name, node)

    def named(self, node: Node) -> NamedUnit | None:
        """The unit that the attribute ``unit`` of an element names; None where it names none.

        Args:
            node: element of the document.
        """
        name = node.get("unit")
        if name is None or name in self._units:
            return None if name is None else NamedUnit(name, self._units[name])
        bare = name.strip().removeprefix("[").removesuffix("]").strip()
        if not bare:
            self._lapses.forgive(
                node, f"unit {name!r} is not defined in this file; taken as no unit: no number is converted."
            )
            return None
        unit = self._units.get(bare)
        taken = f"taken as {bare!r}" + (
            "" if unit else ", whose numbers go only where the unit has the same name or none"
        )
        known = ", ".join(map(repr, self._units)) or "none"
        self._lapses.forgive(
            node, f"unit {name!r} is not defined in this file, whose Units element has {known}; {taken}."
        )
        return NamedUnit(bare, unit)

    def _compare(self, name: str, node: Node) -> None:
        """Warn of a unit that is defined otherwise than everybody understands its name: numbers follow the
        definition.
        """
        usual, defined = _usual(name), self._units[name]
        if usual is not None and not _equal(usual, defined):
            meant = f"unit {name!r} is defined as {_formula(defined)}, usually it is {_formula(usual)}"
            self._lapses.note(node, f"{meant}; values are converted by the definition of the package.")


def read_type(node: Node, units: UnitTable, prefix: str = "ssc") -> Type | None:
    """The type written within an element, or None where it has none.

    Args:
        node: connector, dictionary entry or parameter. units: those of its file. prefix: of the type's namespace.

    Raises:
        ScenarioError: it names a unit that the file does not define, and the reading is strict.
    """
    for child in node:
        name = short(child.tag)
        if name in FAMILIES and find(node, f"{prefix}:{name}") is child:
            return Type(name, units.named(child), child.get("name") if name == "Enumeration" else None)
    return None


def read_transformation(node: Node) -> Step | None:
    """The transformation of a connection or a mapping entry.

    Args:
        node: element of the document.

    Raises:
        ScenarioError: a mapping has two targets for one source.
    """
    for child in node:
        name = short(child.tag)
        if name == "LinearTransformation":
            return Linear(float(child.get("factor", "1")), float(child.get("offset", "0")))
        if name in _TRANSFORMATIONS:
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


def _usual(name: str) -> Unit | None:
    """What everybody takes a name for, or None."""
    try:
        return parse_unit(name)
    except UnitError:
        return None


def _equal(one: Unit, other: Unit) -> bool:
    close = [
        math.isclose(a, b, rel_tol=1e-6, abs_tol=1e-12)
        for a, b in ((one.factor, other.factor), (one.offset, other.offset))
    ]
    return all(close) and one.exponents[:_RAD] == other.exponents[:_RAD]  # a radian is a number: written or not


def _formula(unit: Unit) -> str:
    powers = zip(BASE_SYMBOLS, unit.exponents, strict=True)
    base = ".".join(f"{symbol}{power}" if power != 1 else symbol for symbol, power in powers if power) or "1"
    return f"{unit.factor:g} {base}" + (f" + {unit.offset:g}" if unit.offset else "")
