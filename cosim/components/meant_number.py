"""What number a text means that stands in place of one: with a decimal comma, or with a unit behind it."""

from __future__ import annotations

import re

from plant_models.hybrid.units import UnitError, conversion, parse_unit

_COMMA = re.compile(r"\s*([-+]?\d+),(\d+(?:[eE][-+]?\d+)?)\s*")
_WITH_UNIT = re.compile(r"\s*([-+]?\d+(?:[.,]\d+)?(?:[eE][-+]?\d+)?)\s*([A-Za-zµ°%][\w/.°%]*)\s*")


def meant_number(stated: str, unit: str = "") -> str:
    """What to write in place of a text, as the end of a sentence that begins with 'expected a number'.

    Args:
        stated: the text. unit: name of the unit in which the number is expected; empty for SI units.

    Returns:
        Empty where the text means no number.
    """
    comma = _COMMA.fullmatch(stated)
    if comma is not None:
        return f"; write a point in place of the comma: {comma[1]}.{comma[2]}"
    found = _WITH_UNIT.fullmatch(stated)
    return "" if found is None else _without_unit(float(found[1].replace(",", ".")), found[2], unit)


def _without_unit(value: float, stated: str, unit: str) -> str:
    expected = f"in {unit}" if unit else "in SI units"
    try:
        source = parse_unit(stated.replace("km/h", "km.h-1"))
        factor, offset = conversion(source, parse_unit(unit)) if unit else (source.factor, source.offset)
    except UnitError:
        return f" without a unit, {expected}"
    return f" without its unit, {expected}: {value * factor + offset:.10g}"
