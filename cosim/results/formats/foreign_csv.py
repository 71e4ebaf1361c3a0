"""CSV tables of any tool as results: units from the headings, values in SI. Only reads the file it is given.

Most files are read by NumPy at once. Those that it refuses are read cell by cell, which also finds the line to blame.
An empty cell is NaN, ``true`` and ``false`` are 1 and 0, texts are numbered where they are taken, several numbers in
one cell (arrays of fmpy) become ``name[1]``, ``name[2]``, ...
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from cosim.errors import OutputError
from cosim.results.formats.columns import result_of_columns
from cosim.results.formats.csv_dialect import COMMENTS, SEPARATORS, Dialect, csv_dialect, is_number
from cosim.results.formats.headings import split_unit
from cosim.results.result_data import ResultData

TRUTH = {"true": 1.0, "false": 0.0}
MISSING = dict.fromkeys(("", "na", "n/a", "#n/a", "null", "none"), float("nan"))
WORDS = TRUTH | MISSING
NUMBER, TRUTHS, TEXT = "number", "truth value", "text"
EXPECTED = {NUMBER: "a number", TRUTHS: "true or false", TEXT: "a text"}
_OF_WINDOWS = re.compile(r"(?P<sign>[+-]?)1[.,]#(?P<what>inf|ind|q?nan|snan)\d*", re.IGNORECASE)
_TIME_UNITS = ("s", "ms", "min", "h")


def read_foreign_csv(path: Path, *, texts: bool = False) -> ResultData:
    """Read a table with a column ``time`` and columns of numbers; the separator, decimal comma, encoding and units are
    found out.

    Args:
        path: the file. texts: whether columns of texts are taken, see `cosim.results.load_result.load_result`.

    Raises:
        OutputError: the file is no such table, or what a column holds changes on the way; the message names the line
            and the column.
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
    headings, values, items = _values(dialect, headings, texts)
    names, found = zip(*map(split_unit, headings), strict=True)
    by_name = {name: unit or units.get(heading) for name, unit, heading in zip(names, found, headings, strict=True)}
    stand_for = {name: items[heading] for name, heading in zip(names, headings, strict=True) if heading in items}
    return result_of_columns(str(path), names, list(values.T), by_name, texts=stand_for)


def _units_line(dialect: Dialect, headings: list[str]) -> tuple[Dialect, dict[str, str]]:
    """Some tools write a second line of units: the dialect without it, and the units by heading."""
    number, line = next(dialect.numbered_rows(), (0, ""))
    cells = [cell.strip("[]() ") for cell in dialect.cells(line)]
    if not cells or cells[0] not in _TIME_UNITS or any(is_number(cell) for cell in cells if cell != "1"):
        return dialect, {}
    units = {heading: unit if unit not in ("", "-") else "1" for heading, unit in zip(headings, cells, strict=False)}
    return Dialect(dialect.path, dialect.encoding, dialect.separator, dialect.headings, number), units


class _Values(NamedTuple):
    """Headings, values, shape (rows, columns), and by heading what the numbers of a column of texts stand for."""

    headings: list[str]
    values: np.ndarray
    items: Mapping[str, tuple[str, ...]] = MappingProxyType({})


def _values(dialect: Dialect, headings: list[str], texts: bool) -> _Values:
    if next(dialect.rows(), None) is None:
        return _Values(headings, np.empty((0, len(headings))))
    try:
        values = np.loadtxt(dialect.rows(), delimiter=dialect.separator, ndmin=2, comments=None)
    except ValueError:
        return _cell_by_cell(dialect, headings, texts)
    if values.shape[1] != len(headings):
        return _cell_by_cell(dialect, headings, texts)
    return _Values(headings, values)


def _cell_by_cell(dialect: Dialect, headings: list[str], texts: bool) -> _Values:
    rows: list[list[float]] = []
    columns: list[_Column] = []
    for number, line in dialect.numbered_rows():
        cells = dialect.cells(line)
        if len(cells) == len(headings) + 1 and cells[-1] == "":
            cells.pop()
        if len(cells) != len(headings) and not rows:
            headings = _joined(headings, len(cells))
        if len(cells) != len(headings):
            raise OutputError(f"{dialect.path}, line {number}: {_expected(dialect, headings, not rows)} {len(cells)}.")
        columns = columns or [_Column(f"{heading!r}", texts) for heading in headings]
        try:
            rows.append([value for column, cell in zip(columns, cells, strict=True) for value in column.read(cell)])
        except ValueError as error:
            raise OutputError(f"{dialect.path}, line {number}, column {error}") from None
    names = _elements(headings, [column.width for column in columns])
    items = {heading: tuple(c.items) for heading, c in zip(headings, columns, strict=True) if c.items}
    return _Values(names, np.array(rows), items)


@dataclass
class _Column:
    """What the cells of a column are: numbers, truth values, or texts; all are what the first one is.

    Args:
        name: for messages. texts: whether texts are taken; they become 1, 2, ... in the order in which they first
            stand.
    """

    name: str
    texts: bool
    kind: str = ""
    width: int = 0
    items: dict[str, float] = field(default_factory=dict)

    def read(self, cell: str) -> list[float]:
        """The numbers of a cell.

        Raises:
            ValueError: it is of another kind than those above, or of another length.
        """
        values, kind = _cell(cell)
        if kind != self.kind and self.kind == TEXT and cell.strip():
            kind = TEXT  # an item may be called "none", or 3
        self.kind = self.kind or kind
        if kind == TEXT and not self.texts:
            raise ValueError(
                f"{self.name}: expected a number, got {cell!r}. Correct the cell, or leave the column out."
            )
        if kind not in ("", self.kind):
            raise ValueError(
                f"{self.name}: expected {EXPECTED[self.kind]} as in the rows above, got {cell!r}. Correct the cell, or "
                "leave the column out."
            )
        if kind == TEXT:
            values = [self.items.setdefault(cell.strip().strip('"'), len(self.items) + 1.0)]
        self.width = self.width or len(values)
        if len(values) != self.width:
            raise ValueError(f"{self.name}: expected as many numbers in a cell as above.")
        return values


def _cell(cell: str) -> tuple[list[float], str]:
    """The numbers of a cell, and their kind; empty of one in which nothing stands."""
    words = [part.strip().strip('"').lower() for part in cell.split()]
    kind = "" if all(word in MISSING for word in words) else NUMBER
    if words and all(word in TRUTH for word in words):
        kind = TRUTHS
    try:
        return [_number(part) for part in cell.split()] or [_number("")], kind
    except ValueError:
        return [], TEXT


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


def _number(text: str) -> float:
    text = text.strip().strip('"')
    if text.lower() in WORDS:
        return WORDS[text.lower()]
    match = _OF_WINDOWS.fullmatch(text)
    if match is not None:
        return float(match["sign"] + ("inf" if match["what"].lower() == "inf" else "nan"))
    return float(text if text.count(",") != 1 else text.replace(",", "."))
