"""The numbers of a result in the units that the FMUs declare, as a text table shows them; back in SI they are the same
to the last bit. NumPy only.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from cosim.results.result_data import SignalInfo
from cosim.results.si import CHUNK
from plant_models.hybrid.units import Unit, UnitError, parse_unit


def own_units(table: np.ndarray, signals: Sequence[SignalInfo]) -> dict[str, Unit]:
    """Units of the columns that can be shown in another unit than SI without a loss, by name.

    Args:
        table: structured array in SI, shape (rows,). signals: what the columns are.
    """
    declared = {s.name: parse_unit(s.declared_unit) for s in signals if s.declared_unit is not None}
    parts = [table[start : start + CHUNK] for start in range(0, len(table), CHUNK)]
    return {n: unit for n, unit in declared.items() if all(own_numbers(part[n], unit) is not None for part in parts)}


def own_numbers(values: np.ndarray, unit: Unit) -> np.ndarray | None:
    """Numbers in a unit that are these values in SI bit by bit; None where a value is no such number, which those of an
    FMU always are.

    Args:
        values: in SI, shape (rows,). unit: wanted.
    """
    found = np.asarray((values - unit.offset) / unit.factor)
    with np.errstate(invalid="ignore"):
        wrong = (unit.factor * found + unit.offset != values) & ~np.isnan(values)
    return None if wrong.any() else found


def in_own_units(rows: np.ndarray, units: Mapping[str, Unit]) -> np.ndarray:
    """Rows with these columns in their units, a copy where there are any.

    Args:
        rows: structured rows in SI. units: as of `own_units`.
    """
    shown = rows.copy() if units else rows
    for name, unit in units.items():
        numbers = own_numbers(rows[name], unit)
        assert numbers is not None  # by own_units
        shown[name] = numbers
    return shown


def in_si_only(signals: Sequence[SignalInfo]) -> list[SignalInfo]:
    """The same signals, shown in SI everywhere.

    Args:
        signals: what the columns are.
    """
    return [replace(signal, declared_unit=None, display_unit=None, display_scale=None) for signal in signals]


def meant_unit(name: str) -> Unit | None:
    """What a unit name stands for; None where that is SI as it is, or nobody understands it.

    Args:
        name: of the unit.
    """
    try:
        unit = parse_unit(name)
    except UnitError:
        return None
    return None if (unit.factor, unit.offset) == (1.0, 0.0) else unit
