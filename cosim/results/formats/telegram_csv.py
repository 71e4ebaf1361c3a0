"""Telegrams as a table of any origin: a column ``stamp``, a column ``position``, others as far as they are known.

Only reads the file it is given.
"""

from __future__ import annotations

from dataclasses import MISSING, fields
from math import nan
from pathlib import Path
from typing import Any

from cosim.errors import OutputError, nearest
from cosim.results.formats.csv_dialect import csv_dialect
from cosim.results.formats.headings import split_unit
from cosim.results.record_rows import TELEGRAM_ROWS, TELEGRAM_UNITS, parse_outcomes, require_accuracy
from cosim.results.result_data import BaliseRecord
from plant_models.hybrid.units import UnitError, conversion, parse_unit

_NEEDED = ("stamp", "position")
_DEFAULTS = {f.name: f.default for f in fields(BaliseRecord) if f.default is not MISSING} | {"true_position": nan}
_KINDS = ("true", "missed", "false")


def holds_telegrams(path: Path) -> bool:
    """Whether a file is a CSV with a column ``stamp``.

    Args:
        path: the file.
    """
    if path.suffix.lower() != ".csv" or not path.is_file():
        return False
    return "stamp" in [split_unit(heading)[0] for heading in csv_dialect(path).headings]


def read_telegrams(path: Path) -> list[BaliseRecord]:
    """Read a table of telegrams, one a line.

    What is not given: ``delivered_at`` is the stamp, ``identity`` is ``T1``, ``T2``, ... in the order of the file,
    ``kind`` is ``true``, the location accuracy is zero, the odometer reading and the true position are unknown. Units
    in brackets behind the names are converted; without one it is the SI unit.

    Args:
        path: the file.

    Raises:
        ValueError: a column is missing or unknown, or a cell cannot be read; the line is named.
        OSError: the file cannot be read.
    """
    dialect = csv_dialect(path)
    factors = _columns(path, dialect.headings)
    events: list[BaliseRecord] = []
    for line, text in dialect.numbered_rows():
        row = dict(zip(factors, dialect.cells(text), strict=False))
        try:
            events.append(_record(row, factors, f"T{len(events) + 1}"))
        except ValueError as error:
            raise ValueError(f"{path}, line {line}: {error}") from error
    return events


def _columns(path: Path, headings: tuple[str, ...]) -> dict[str, float]:
    """Factors to the SI unit, by name of the column."""
    factors: dict[str, float] = {}
    for heading in headings:
        name, unit = split_unit(heading)
        if name not in TELEGRAM_ROWS.columns:
            raise OutputError(f"{path}: unknown column {heading!r}; {nearest(name, TELEGRAM_ROWS.columns)}")
        try:
            factors[name] = (
                1.0 if unit is None else conversion(parse_unit(unit), parse_unit(TELEGRAM_UNITS.get(name, "1")))[0]
            )
        except UnitError as error:
            raise OutputError(f"{path}: column {heading!r}: {error}.") from error
    lacking = [name for name in _NEEDED if name not in factors]
    if lacking:
        raise OutputError(f"{path}: telegrams need the columns 'stamp' and 'position'; missing: {', '.join(lacking)}.")
    return factors


def _record(row: dict[str, str], factors: dict[str, float], identity: str) -> BaliseRecord:
    values: dict[str, Any] = {**_DEFAULTS, "identity": identity, "outcomes": {}}
    for name, text in row.items():
        if text == "":
            continue
        if name in TELEGRAM_ROWS.numbers:
            try:
                values[name] = float(text) * factors[name]
            except ValueError:
                raise ValueError(f"{name}: expected a number, got {text!r}.") from None
        else:
            values[name] = parse_outcomes(text) if name == "outcomes" else text
    for name in _NEEDED:
        if name not in values:
            raise ValueError(f"{name} is empty.")
    require_accuracy(values["location_accuracy"])
    if values["kind"] not in _KINDS:
        raise ValueError(f"kind {values['kind']!r}: expected one of {', '.join(_KINDS)}.")
    values.setdefault("delivered_at", nan if values["kind"] == "missed" else values["stamp"])
    return BaliseRecord(**values)
