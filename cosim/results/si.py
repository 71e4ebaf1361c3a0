"""SI: a recorded table whose columns stand in the FMUs' own units, converted to the units a `Result` promises."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from cosim.results.result import SignalInfo
from plant_models.hybrid.units import BASE_SYMBOLS, Unit, UnitError, parse_unit

NAMED = {
    parse_unit(name).exponents: name
    for name in ("1", "m", "m/s", "m/s2", "m/s3", "kg", "kg.m2", "s", "1/s", "K", "A", "rad", "rad/s", "rad/s2", "N", "J", "W",
                 "Pa", "V", "N/m", "N.s/m", "N.s2/m2", "kg/s")
}  # fmt: skip

CHUNK = 65536  # rows converted at a time: a table may be larger than the memory


def in_si(
    table: np.ndarray, signals: Sequence[SignalInfo], unit_of: Callable[[str], Unit | None]
) -> tuple[np.ndarray, list[SignalInfo]]:
    """The table with every column in SI; what was converted keeps its former unit as display unit.

    Args:
        table: structured array, changed in place. signals: its columns without ``time``.
        unit_of: the unit of a column, None where its FMU declares none.

    Returns:
        The table and the description of its columns.
    """
    units = {signal.name: unit for signal in signals if (unit := _to_convert(signal, unit_of)) is not None}
    for start in range(0, len(table) if units else 0, CHUNK):
        rows = table[start : start + CHUNK]
        for name, unit in units.items():
            rows[name] = unit.factor * rows[name] + unit.offset
    return table, [_described(signal, units.get(signal.name)) for signal in signals]


def si_name(unit: Unit) -> str:
    """A name for the SI unit of the same dimension, e.g. ``m/s`` for ``km/h``."""
    if unit.exponents in NAMED:
        return NAMED[unit.exponents]
    return ".".join(f"{s}{'' if e == 1 else e}" for s, e in zip(BASE_SYMBOLS, unit.exponents, strict=True) if e)


def _to_convert(signal: SignalInfo, unit_of: Callable[[str], Unit | None]) -> Unit | None:
    try:
        unit = unit_of(signal.name)
    except UnitError:
        return None  # a unit nobody understands stays as it is, under its own name
    return None if unit is None or (unit.factor == 1.0 and unit.offset == 0.0) else unit


def _described(signal: SignalInfo, unit: Unit | None) -> SignalInfo:
    if unit is None:
        return signal
    return replace(signal, unit=si_name(unit), display_unit=signal.display_unit or signal.unit)
