"""What kind of CSV a file is: encoding, separator, where its headings end. Only reads the file it is given.

Known are the exports of fmpy, OpenModelica, Dymola, spreadsheets in any locale, and reference results of FMI-LS-REF.
"""

from __future__ import annotations

import codecs
import csv
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from cosim.errors import OutputError

START = 1 << 16  # bytes looked at to find the encoding
COMMENTS = ("#", "%")
"""What a line begins with that is no part of the table, before the names of the columns."""
SEPARATORS = {"\t": "tabs", ";": "semicolons", ",": "commas"}


@dataclass(frozen=True, slots=True)
class Dialect:
    """How a file is to be read.

    Args:
        path: the file. encoding: of its text. separator: between cells.
        headings: the cells of its first line with words.
        lines: how many lines of the file come before the first row.
    """

    path: Path
    encoding: str
    separator: str
    headings: tuple[str, ...]
    lines: int

    def rows(self) -> Iterator[str]:
        """The lines behind the headings, empty ones left out. Where commas do not separate cells they are decimal:
        points.
        """
        for _, line in self.numbered_rows():
            yield line

    def numbered_rows(self) -> Iterator[tuple[int, str]]:
        """As `rows`, each with the number of its line in the file, counted from 1."""
        with self.path.open(encoding=self.encoding, errors="replace", newline="") as file:
            for number, line in enumerate(_lines(file), 1):
                if number > self.lines and line.strip(" \t\r\n,;"):
                    yield number, line if self.separator == "," else line.replace(",", ".")

    def cells(self, line: str) -> list[str]:
        """The cells of a line without spaces around them.

        Args:
            line: of the file.
        """
        return [cell.strip() for cell in next(csv.reader([line], delimiter=self.separator, skipinitialspace=True), [])]


def csv_dialect(path: Path) -> Dialect:
    """Look at the beginning of a file.

    Args:
        path: the file.

    Raises:
        OutputError: it is empty, or it is not text.
        OSError: it cannot be read.
    """
    encoding = _encoding(path)
    with path.open(encoding=encoding, errors="replace", newline="") as file:
        number, line = _headings((n, line) for n, line in enumerate(_lines(file), 1) if line.strip())
    if not line:
        raise OutputError(
            f"{path} is empty: expected a line with the names of the columns, 'time' first, and rows of numbers."
        )
    separator = _separator(line)
    cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True))
    return Dialect(path, encoding, separator, tuple(cell.strip() for cell in cells), number)


def _headings(numbered: Iterator[tuple[int, str]]) -> tuple[int, str]:
    """The line with the names of the columns and its number; hints of spreadsheets and comments before it are passed
    over. Where numbers follow at once the last comment has the names, as NumPy writes them.
    """
    comment: tuple[int, str] | None = None
    for number, line in numbered:
        text = line.strip()
        if text.startswith(COMMENTS):
            comment = number, text.lstrip("".join(COMMENTS)).strip()
        elif text.lower() not in ("sep=;", "sep=,", "sep=\t", '"sep=;"'):
            return comment if comment is not None and is_number(text.split(_separator(text))[0]) else (number, line)
    return 0, ""


def is_number(text: str) -> bool:
    """Whether a cell is a number, perhaps with a decimal comma.

    Args:
        text: of the cell.
    """
    try:
        float(text.replace(",", "."))
    except ValueError:
        return False
    return True


def _encoding(path: Path) -> str:
    with path.open("rb") as file:
        start = file.read(START)
    if start.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16"
    if b"\0" in start:
        raise OutputError(f"{path} is not a table: it is neither text nor one of the result formats.")
    try:
        codecs.getincrementaldecoder("utf-8")().decode(start)
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8-sig"


def _separator(line: str) -> str:
    """The separator that stands outside quotes and brackets of a line of headings; rare ones first."""
    quoted, depth, seen = False, 0, set()
    for character in line:
        quoted ^= character == '"'
        depth += 0 if quoted else (character == "[") - (character == "]")
        if not quoted and depth <= 0 and character in SEPARATORS:
            seen.add(character)
    return next((separator for separator in SEPARATORS if separator in seen), ",")


def _lines(file: Iterator[str]) -> Iterator[str]:
    """Lines of a text; a heading in quotes may go over several of them, which then count as one."""
    pending = ""
    for line in file:
        pending += line
        if pending.count('"') % 2 == 0:
            yield pending
            pending = ""
    if pending:
        yield pending
