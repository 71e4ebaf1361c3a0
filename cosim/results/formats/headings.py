"""Column headings of text tables: a name and, where it is given, a unit in brackets. Touches no file."""

from __future__ import annotations

import re

from plant_models.hybrid.units import UnitError, parse_unit

_BRACKETED = re.compile(r"(?P<name>.*\S)(?P<gap>\s*)\[(?P<unit>[^\[\]]*)\]", re.DOTALL)
_IN_PARENTHESES = re.compile(r"(?P<name>.*\S)\s+\((?P<unit>[^()]*)\)", re.DOTALL)
_TYPED = str.maketrans("²³⁴¹⁻·×", "2341-..")
_INDEX = re.compile(r"\s*-?\d+\s*(?:[,;]\s*-?\d+\s*)*")


def split_unit(heading: str) -> tuple[str, str | None]:
    """Name and unit of a heading such as ``speed [m/s]``, ``speed[m/s]`` or ``speed (m/s)``.

    Brackets right behind a name are a unit only if they can be read as one; ``a[1]``, ``a[1,2]`` and ``a[left]`` are
    elements of arrays. Brackets after a space are a unit whatever they hold.

    Args:
        heading: of a column.

    Returns:
        The name, and the unit or None where the heading names none; ``[-]`` and ``[]`` are pure numbers, ``1``.
    """
    match = _BRACKETED.fullmatch(heading)
    if match is None:
        match = _IN_PARENTHESES.fullmatch(heading)
        return (
            (match["name"], _plain(match["unit"]))
            if match is not None and _is_unit(_plain(match["unit"]))
            else (heading, None)
        )
    index = _INDEX.fullmatch(match["unit"]) is not None or not match["unit"].strip()
    if match["gap"] or (not index and _is_unit(_plain(match["unit"]))):
        return match["name"], _plain(match["unit"])
    return heading, None


def with_unit(name: str, unit: str) -> str:
    """The heading of which `split_unit` gives back both; a pure number gets no brackets unless its name needs them.

    Args:
        name: of the column.
        unit: its unit.
    """
    return name if unit == "1" and split_unit(name) == (name, None) else f"{name} [{unit}]"


def _plain(unit: str) -> str:
    unit = unit.strip()
    typed = unit.replace("°C", "degC").replace("°", "deg").translate(_TYPED)
    return "1" if unit in ("", "-", "1") else typed if typed != unit and _is_unit(typed) else unit


def _is_unit(text: str) -> bool:
    try:
        parse_unit(text)
    except UnitError:
        return False
    return True
