"""What number a text means, in the unit in which it is expected."""

from __future__ import annotations

from plant_models.hybrid.units import UnitError, conversion, parse_unit
from plant_models.meant_number import meant_number


def meant_in_unit(stated: str, unit: str = "", *, whole: bool = False) -> str:
    """See `meant_number`; a number with a unit behind it is converted.

    Args:
        stated: the text. unit: name of the unit in which the number is expected; empty for SI units. whole: whether a
            whole number is expected.
    """

    def converted(value: float, its: str) -> str:
        expected = f"in {unit}" if unit else "in SI units"
        try:
            source = parse_unit(its.replace("km/h", "km.h-1"))
            factor, offset = conversion(source, parse_unit(unit)) if unit else (source.factor, source.offset)
        except UnitError:
            return f" without a unit, {expected}"
        return f" without its unit, {expected}: {value * factor + offset:.10g}"

    return meant_number(stated, whole=whole, with_unit=converted)
