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
    return table, [_convert(table, signal, unit_of) for signal in signals]


def si_name(unit: Unit) -> str:
    """A name for the SI unit of the same dimension, e.g. ``m/s`` for ``km/h``."""
    if unit.exponents in NAMED:
        return NAMED[unit.exponents]
    return ".".join(f"{s}{'' if e == 1 else e}" for s, e in zip(BASE_SYMBOLS, unit.exponents, strict=True) if e)


def _convert(table: np.ndarray, signal: SignalInfo, unit_of: Callable[[str], Unit | None]) -> SignalInfo:
    try:
        unit = unit_of(signal.name)
    except UnitError:
        return signal  # a unit nobody understands stays as it is, under its own name
    if unit is None or (unit.factor == 1.0 and unit.offset == 0.0):
        return signal
    table[signal.name] = unit.factor * table[signal.name] + unit.offset
    return replace(signal, unit=si_name(unit), display_unit=signal.display_unit or signal.unit)
