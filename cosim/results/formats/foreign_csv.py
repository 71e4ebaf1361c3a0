"""CSV tables of any tool as results: units from the headings, values in SI. Only reads the file it is given.

Most files are read by NumPy at once. Those that it refuses are read cell by cell, which also finds the line to blame.
An empty cell is NaN, ``true`` and ``false`` are 1 and 0, several numbers in one cell (arrays of fmpy) become
``name[1]``, ``name[2]``, ...
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from cosim.errors import OutputError
from cosim.results.formats.columns import result_of_columns
from cosim.results.formats.csv_dialect import COMMENTS, SEPARATORS, Dialect, csv_dialect, is_number
from cosim.results.formats.headings import split_unit
from cosim.results.result_data import ResultData

WORDS = {"true": 1.0, "false": 0.0} | dict.fromkeys(("", "na", "n/a", "#n/a", "null", "none"), float("nan"))
_OF_WINDOWS = re.compile(r"(?P<sign>[+-]?)1[.,]#(?P<what>inf|ind|q?nan|snan)\d*", re.IGNORECASE)
_TIME_UNITS = ("s", "ms", "min", "h")


def read_foreign_csv(path: Path) -> ResultData:
    """Read a table with a column ``time`` and columns of numbers; the separator, decimal comma, encoding and units are
    found out.

    Args:
        path: the file.

    Raises:
        OutputError: the file is no such table; the message names the line and the column.
        OSError: the file cannot be read.
    """
    dialect = csv_dialect(path)
    headings = [*dialect.headings]
    if len(headings) > 1 and headings[-1] == "":  # OpenModelica and spreadsheets close lines with a separator
        headings.pop()
    if all(is_number(heading) for heading in headings):
        raise OutputError(
            f"{path}, line {dialect.lines}: expected names of columns, 'time' first, got numbers only. Add them."
        )
    dialect, units = _units_line(dialect, headings)
    headings, values = _values(dialect, headings)
    names, found = zip(*map(split_unit, headings), strict=True)
    by_name = {name: unit or units.get(heading) for name, unit, heading in zip(names, found, headings, strict=True)}
    return result_of_columns(str(path), names, list(values.T), by_name)


def _units_line(dialect: Dialect, headings: list[str]) -> tuple[Dialect, dict[str, str]]:
    """Some tools write a second line of units: the dialect without it, and the units by heading."""
    number, line = next(dialect.numbered_rows(), (0, ""))
    cells = [cell.strip("[]() ") for cell in dialect.cells(line)]
    if not cells or cells[0] not in _TIME_UNITS or any(is_number(cell) for cell in cells if cell != "1"):
        return dialect, {}
    units = {heading: unit if unit not in ("", "-") else "1" for heading, unit in zip(headings, cells, strict=False)}
    return Dialect(dialect.path, dialect.encoding, dialect.separator, dialect.headings, number), units


def _values(dialect: Dialect, headings: list[str]) -> tuple[list[str], np.ndarray]:
    """Headings and values, shape (rows, columns)."""
    if next(dialect.rows(), None) is None:
        return headings, np.empty((0, len(headings)))
    try:
        values = np.loadtxt(dialect.rows(), delimiter=dialect.separator, ndmin=2, comments=None)
    except ValueError:
        return _cell_by_cell(dialect, headings)
    if values.shape[1] != len(headings):
        return _cell_by_cell(dialect, headings)
    return headings, values


def _cell_by_cell(dialect: Dialect, headings: list[str]) -> tuple[list[str], np.ndarray]:
    rows: list[list[float]] = []
    widths: list[int] = []
    for number, line in dialect.numbered_rows():
        cells = dialect.cells(line)
        if len(cells) == len(headings) + 1 and cells[-1] == "":
            cells.pop()
        if len(cells) != len(headings) and not rows:
            headings = _joined(headings, len(cells))
        if len(cells) != len(headings):
            raise OutputError(f"{dialect.path}, line {number}: {_expected(dialect, headings, not rows)} {len(cells)}.")
        parts = [_numbers(cell, dialect, number, heading) for cell, heading in zip(cells, headings, strict=True)]
        widths = widths or [len(part) for part in parts]
        wrong = next((h for h, part, width in zip(headings, parts, widths, strict=True) if len(part) != width), None)
        if wrong is not None:
            raise OutputError(
                f"{dialect.path}, line {number}, column {wrong!r}: expected as many numbers in a cell as above."
            )
        rows.append([value for part in parts for value in part])
    return _elements(headings, widths), np.array(rows)


def _expected(dialect: Dialect, headings: list[str], first: bool) -> str:
    """What a row with another number of cells than names differs from; `first`: it is the first one."""
    expected = f"expected {len(headings)} cells separated by {SEPARATORS[dialect.separator]}"
    if first:  # as likely the names are none
        expected += (
            f", as many as names in line {dialect.lines} (what stands before the names begins with "
            f"{' or '.join(COMMENTS)})"
        )
    return f"{expected}, got"


def _joined(headings: list[str], count: int) -> list[str]:
    """Headings as ``a[1`` and ``2]`` put together again, if there are then `count` of them."""
    joined: list[str] = []
    for heading in headings:
        if joined and joined[-1].count("[") > joined[-1].count("]"):
            joined[-1] += f",{heading}"
        else:
            joined.append(heading)
    return joined if len(joined) == count else headings


def _elements(headings: list[str], widths: list[int]) -> list[str]:
    names = []
    for heading, width in zip(headings, widths, strict=True):
        name, unit = split_unit(heading)
        unit = "" if unit is None else f" [{unit}]"
        names += [heading] if width == 1 else [f"{name}[{i + 1}]{unit}" for i in range(width)]
    return names


def _numbers(cell: str, dialect: Dialect, line: int, heading: str) -> list[float]:
    try:
        return [_number(part) for part in cell.split()] or [_number("")]
    except ValueError:
        where = f"{dialect.path}, line {line}, column {heading!r}"
        raise OutputError(
            f"{where}: expected a number, got {cell!r}. Correct the cell, or leave the column out."
        ) from None


def _number(text: str) -> float:
    text = text.strip().strip('"')
    if text.lower() in WORDS:
        return WORDS[text.lower()]
    match = _OF_WINDOWS.fullmatch(text)
    if match is not None:
        return float(match["sign"] + ("inf" if match["what"].lower() == "inf" else "nan"))
    return float(text if text.count(",") != 1 else text.replace(",", "."))
