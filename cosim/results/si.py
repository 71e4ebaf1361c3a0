"""SI: a recorded table whose columns stand in the FMUs' own units, converted to the units a `Result` promises."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from cosim.results.result_data import SignalInfo
from cosim.results.shown_unit import own_scale
from plant_models.hybrid.units import BASE_SYMBOLS, Unit, UnitError, parse_unit

NAMED = {
    parse_unit(name).exponents: name
    for name in (
        "1",
        "m",
        "m/s",
        "m/s2",
        "m/s3",
        "kg",
        "kg.m2",
        "s",
        "1/s",
        "K",
        "A",
        "rad",
        "rad/s",
        "rad/s2",
        "N",
        "J",
        "W",
        "Pa",
        "V",
        "N/m",
        "N.s/m",
        "N.s2/m2",
        "kg/s",
    )
}

CHUNK = 65536  # rows converted at a time: a table may be larger than the memory
UnitOf = Callable[[str], Unit | None]


def in_si(table: np.ndarray, signals: Sequence[SignalInfo], unit_of: UnitOf) -> tuple[np.ndarray, list[SignalInfo]]:
    """The table with every column in SI; what was converted keeps its former unit as display unit.

    Args:
        table: structured array, changed in place. signals: its columns without ``time``.
        unit_of: the unit of a column, None where its FMU declares none.

    Returns:
        The table and the description of its columns.
    """
    units = foreign_units(signals, unit_of)
    for start in range(0, len(table) if units else 0, CHUNK):
        convert(table[start : start + CHUNK], units)
    return table, described(signals, units)


def foreign_units(signals: Sequence[SignalInfo], unit_of: UnitOf) -> dict[str, Unit]:
    """The units of the columns that are not in SI, by name; arguments as for `in_si`.

    Args:
        signals: what the columns are.
        unit_of: gives the unit of a column by its name; None where it is not known.
    """
    return {signal.name: unit for signal in signals if (unit := _to_convert(signal, unit_of)) is not None}


def convert(rows: np.ndarray, units: Mapping[str, Unit]) -> None:
    """Bring rows, shape (rows,), to SI in place; `units` as from `foreign_units`.

    Args:
        rows: structured rows; changed in place.
    """
    for name, unit in units.items():
        rows[name] = unit.factor * rows[name] + unit.offset


def described(signals: Sequence[SignalInfo], units: Mapping[str, Unit]) -> list[SignalInfo]:
    """What the columns are once they are in SI; `units` as from `foreign_units`.

    Args:
        signals: what the columns are.
    """
    return [_described(signal, units.get(signal.name)) for signal in signals]


class InFormerUnits:
    """A table in SI, read as it was recorded: whatever asks for a column gets it in the unit of its FMU.

    Args:
        table: structured array, shape (rows,). units: as from `foreign_units`.
    """

    def __init__(self, table: np.ndarray, units: Mapping[str, Unit]) -> None:
        self._table, self._units = table, units
        self.dtype = table.dtype

    def __len__(self) -> int:
        return len(self._table)

    def __getitem__(self, name: str) -> np.ndarray:
        """Values of a column, shape (rows,)."""
        unit = self._units.get(name)
        values = np.asarray(self._table[name])
        return values if unit is None else (values - unit.offset) / unit.factor


def _si_name(unit: Unit) -> str:
    """A name for the SI unit of the same dimension, e.g. ``m/s`` for ``km/h``."""
    if unit.exponents in NAMED:
        return NAMED[unit.exponents]
    return ".".join(f"{s}{'' if e == 1 else e}" for s, e in zip(BASE_SYMBOLS, unit.exponents, strict=True) if e)


def _to_convert(signal: SignalInfo, unit_of: UnitOf) -> Unit | None:
    try:
        unit = unit_of(signal.name)
    except UnitError:
        return None  # a unit nobody understands stays as it is, under its own name
    return None if unit is None or (unit.factor == 1.0 and unit.offset == 0.0) else unit


def _described(signal: SignalInfo, unit: Unit | None) -> SignalInfo:
    if unit is None:
        return signal
    names = [name for name in (signal.unit, signal.display_unit) if name is not None]
    declared = next((name for name in names if _is_called(unit, name)), None)
    found = replace(signal, unit=_si_name(unit), declared_unit=declared)
    if signal.display_unit:
        return found
    return replace(found, display_unit=signal.unit, display_scale=own_scale(signal.unit, unit))


def _is_called(unit: Unit, name: str) -> bool:
    """Whether everybody understands this unit by a name, but for its sign."""
    try:
        meant = parse_unit(name)
    except UnitError:
        return False
    same_size = meant.factor in (unit.factor, -unit.factor)
    return same_size and (meant.exponents, meant.offset) == (unit.exponents, unit.offset)
