"""Transformations: what a connection does to a number on its way, besides units. Standard library only.

The words are those of SSP (GTransformationChoice): a linear transformation, or a table of values.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Transformation:
    """``target = factor * source + offset``, or the table's value where it has one for the source.

    Args:
        factor, offset: linear transformation, of the source in the unit of the target.
        convert_units: whether the source is converted to the unit of the target first; if not, its number is taken as
            it is.
        table: (source, target) values of a discrete signal; a value without an entry passes unchanged.
    """

    factor: float = 1.0
    offset: float = 0.0
    convert_units: bool = True
    table: tuple[tuple[float, float], ...] = ()

    def of(self, value: float) -> float:
        """The value of the target, for a value in its unit."""
        return dict(self.table).get(value, self.factor * value + self.offset)

    def after(self, factor: float, offset: float) -> tuple[float, float]:
        """``(factor, offset)`` of a unit conversion and this linear transformation in a row."""
        if (self.factor, self.offset) == (1.0, 0.0):
            return factor, offset
        return self.factor * factor, self.factor * offset + self.offset

    def of_converted(self, factor: float, offset: float) -> Transformation:
        """The same for a source that was converted already, ``factor * source + offset``.

        Args:
            factor, offset: of that conversion.
        """
        if self.convert_units or (factor, offset) == (1.0, 0.0):
            return self
        table = tuple((factor * source + offset, target) for source, target in self.table)
        return Transformation(*self.after(1.0 / factor, -offset / factor), False, table)

    def instead_of(self, other: Transformation) -> Transformation:
        """What is left to be done of it where the other linear transformation was done already."""
        ratio = self.factor / other.factor
        return Transformation(ratio, self.offset - ratio * other.offset, self.convert_units, self.table)


def as_affine(table: Mapping[float, float], domain: frozenset[float]) -> tuple[float, float] | None:
    """``(factor, offset)`` that does the same as a table on every value of a finite domain, or None where there is
    none.

    Args:
        table: target by source value; a value without an entry stays.
        domain: all values the source can have.
    """
    points = sorted((value, table.get(value, value)) for value in domain)
    if not points:
        return None
    (x0, y0), (x1, y1) = points[0], points[-1]
    factor = 1.0 if x1 == x0 else (y1 - y0) / (x1 - x0)
    offset = y0 - factor * x0
    fits = all(factor * x + offset == y for x, y in points)
    return (factor, offset) if fits else None
