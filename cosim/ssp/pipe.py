"""Pipes: what becomes of a number on its way from one variable to another: units, linear transformations, tables of
values.

Pure functions on numbers and units; knows neither systems nor FMUs.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from cosim.ssp.common import Linear, Step, ValueMap
from cosim.ssp.document import Node, fail
from fmus.fmi.units import NamedUnit
from plant_models.hybrid.units import UnitError

BOOLEANS = {"true": 1.0, "1": 1.0, "false": 0.0, "0": 0.0}


@dataclass(frozen=True)
class Pipe:
    """``target = factor * source + offset``, then the tables in turn.

    Args:
        unit: what the number is in at the end, where that is known.
        factor, offset: units and linear transformations so far. maps: tables of values so far.
    """

    unit: NamedUnit | None = None
    factor: float = 1.0
    offset: float = 0.0
    maps: tuple[ValueMap, ...] = ()

    @property
    def is_identity(self) -> bool:
        """Whether every number passes unchanged."""
        return (self.factor, self.offset) == (1.0, 0.0) and not self.maps

    def through(self, unit: NamedUnit | None, suppress: bool, step: Step | None, node: Node) -> Pipe:
        """This pipe with one connection or mapping more.

        Args:
            unit: of the far end, None where it has none of its own. suppress: whether units are left alone.
            step: the transformation, in the unit of the far end. node: for messages.

        Raises:
            ScenarioError: units that do not fit, or transformations that cannot follow one another.
        """
        pipe = self if suppress else self._converted(unit, node)
        pipe = replace(pipe, unit=unit or (None if suppress else pipe.unit))
        if isinstance(step, Linear):
            if pipe.maps:
                fail(node, "a linear transformation behind a table of values cannot be carried out.")
            return pipe._affine(step.factor, step.offset)
        if isinstance(step, ValueMap):
            if (pipe.factor, pipe.offset) != (1.0, 0.0):
                fail(
                    node, "a table of values behind a unit conversion or a linear transformation cannot be carried out."
                )
            return replace(pipe, maps=(*pipe.maps, step))
        return pipe

    def number(self, value: float, node: Node) -> float:
        """What becomes of a number; a whole number stays one where nothing is done to it.

        Args:
            value: number before the transformation. node: element of the document.
        """
        if self.maps:
            return numeric(self.maps, node).get(float(value), value)
        return value if self.is_identity else self.factor * value + self.offset

    def item(self, name: str, node: Node) -> str:
        """What becomes of the name of an item.

        Args:
            node: element of the document.

        Raises:
            ScenarioError: there is a transformation for numbers in the pipe.
        """
        if (self.factor, self.offset) != (1.0, 0.0) or any(m.kind != "Enumeration" for m in self.maps):
            fail(node, f"{name!r} is a name; a transformation of numbers cannot be applied to it.")
        for entry in self.maps:
            name = entry.entries.get(name, name)
        return name

    def _converted(self, unit: NamedUnit | None, node: Node) -> Pipe:
        if self.unit is None or unit is None:
            return self
        try:
            return self._affine(*self.unit.to(unit))
        except UnitError as error:
            fail(node, f"units {self.unit.name!r} and {unit.name!r} do not fit: {error}.")

    def _affine(self, factor: float, offset: float) -> Pipe:
        return replace(self, factor=factor * self.factor, offset=factor * self.offset + offset)


def numeric(maps: tuple[ValueMap, ...], node: Node) -> dict[float, float]:
    """Tables of booleans or integers in a row as one table; a value without an entry passes unchanged.

    Args:
        node: element of the document.

    Raises:
        ScenarioError: one of them is not numeric, or maps one value twice.
    """
    table: dict[float, float] = {}
    for step in maps:
        entries = _numbers(step, node)
        keys = {**table, **entries}
        table = {key: entries.get(table.get(key, key), table.get(key, key)) for key in keys}
    return table


def _numbers(step: ValueMap, node: Node) -> dict[float, float]:
    if step.kind == "Enumeration":
        fail(node, "a table of item names can only connect enumerations.")
    numbers: dict[float, float] = {}
    for source, target in step.entries.items():
        first, second = (BOOLEANS[t.strip()] if step.kind == "Boolean" else float(int(t)) for t in (source, target))
        if first in numbers:
            fail(node, f"two entries map the value {source!r}; a mapping must be unambiguous.")
        numbers[first] = second
    return numbers
