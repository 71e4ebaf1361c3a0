"""Tables as CSV, to the last bit and readable by ``fmpy.util.read_csv``. Touches only the file it is given.

The first line holds the quoted names with their units, ``train.speed [km/h]``: those that the FMUs declare, else SI; a
column without a unit is in SI. Read, all are in SI, with the bits that they had. Numbers are the shortest decimals that
read back as the same float64, so nothing is lost; rows with the same time (before and after an event) stay as they are.
Only the payload bits of a NaN are not kept. FMPy splits lines at every comma, so names such as ``a[1,2]`` are read by
`read_csv` but not by FMPy.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Sequence
from importlib import import_module
from itertools import chain
from pathlib import Path

import numpy as np

from cosim.results.declared_units import in_own_units, meant_unit, own_units
from cosim.results.formats.about import signals_of
from cosim.results.formats.format import Format, bare
from cosim.results.formats.headings import split_unit, with_unit
from cosim.results.result_data import ResultData, SignalInfo
from cosim.results.si import convert
from cosim.results.table_layout import column_names, table_dtype

CHUNK = 4096  # rows turned into text at a time, so that memory stays flat
MANY = 50_000
"""Numbers from which on a compiled function writes them; it has to be loaded, or even compiled first."""


def write_csv(
    path: str | Path,
    table: np.ndarray,
    headings: Sequence[str] | None = None,
    shown: Callable[[np.ndarray], np.ndarray] = np.asarray,
) -> None:
    """Write a result table as CSV.

    Args:
        path: file to write.
        table: structured array, shape (rows,), float64 fields, ``time`` first.
        headings: what to write above the columns instead of their names, e.g. names with units.
        shown: what of some rows is written, e.g. their numbers in other units.

    Raises:
        ValueError: `table` is not a result table.
        OSError: the file cannot be written.
    """
    names = column_names(table)
    rows = rows_as_text(len(table) * len(names))
    with Path(path).open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, quoting=csv.QUOTE_ALL, lineterminator="\n").writerow(headings or names)
    with Path(path).open("ab") as file:
        for start in range(0, len(table), CHUNK):
            part = np.ascontiguousarray(shown(table[start : start + CHUNK]), dtype=table_dtype(names))
            file.write(rows(part.view(np.float64).reshape(len(part), len(names))))


def rows_as_text(count: int) -> Callable[[np.ndarray], bytes]:
    """A function that writes rows, shape (rows, columns), as lines of text: compiled where `count` numbers are worth it
    and there is a compiler, else in Python, with the same bytes.

    Args:
        count: of numbers in all.
    """
    native = import_module("cosim.results.formats.csv_numbers").native_rows() if count >= MANY else None
    return native or _rows_in_python


def _rows_in_python(rows: np.ndarray) -> bytes:
    return "".join([",".join(map(repr, row)) + "\n" for row in rows.tolist()]).encode()


def _heading(signal: SignalInfo, is_own: bool) -> str:
    """A name with its unit; without it where it would be read as another one than it is."""
    if is_own and signal.declared_unit is not None:
        return with_unit(signal.name, signal.declared_unit)
    heading = with_unit(signal.name, signal.unit)
    name, unit = split_unit(heading)
    return heading if name == signal.name and meant_unit(unit or "1") is None else with_unit(signal.name, "1")


class CsvFormat(Format):
    """Text, for every program."""

    name = "csv"
    endings = (".csv",)
    keeps = False
    speed = 0

    @staticmethod
    def write(path: Path, result: ResultData) -> None:  # noqa: D102 - see Format
        units = own_units(result.table, result.signals)
        headings = [_heading(signal, signal.name in units) for signal in signals_of(result)]
        write_csv(path, result.table, ["time", *headings], lambda rows: in_own_units(rows, units))

    @staticmethod
    def read(path: Path) -> ResultData:  # noqa: D102 - see Format
        with path.open(encoding="utf-8", newline="") as file:
            names = next(csv.reader(file), [])
            if not names or names[0] != "time":
                raise ValueError(f"{path} is not a result table: its first column must be 'time', got {names[:1]}.")
            first = file.readline()
            headings = dict(map(split_unit, names))
            if len(headings) < len(names):
                twice = max(headings, key=[split_unit(name)[0] for name in names].count)
                raise ValueError(f"{path} is not a result table: column {twice!r} stands twice.")
            if not first:
                return bare(np.empty(0, table_dtype(list(headings))))
            try:
                values = np.loadtxt(chain([first], file), delimiter=",", ndmin=2, comments=None)
            except ValueError as error:
                raise ValueError(f"{path} is not a result table: {error}") from error
        if values.shape[1] != len(names):
            raise ValueError(
                f"{path} is not a result table: {len(names)} names but {values.shape[1]} numbers in a row."
            )
        table = values.view(table_dtype(list(headings)))[:, 0]
        meant = {name: meant_unit(unit) for name, unit in headings.items() if unit is not None}
        convert(table, {name: unit for name, unit in meant.items() if unit is not None})
        return bare(table)
