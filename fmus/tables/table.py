"""A table as one value: columns with their units and meanings, rows of plain values, notes. It is shown in a terminal,
on a page and as data. Standard library only.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Container, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

from fmus.tables.notebook import paragraph_html, table_html
from fmus.tables.numbers import error_number, number
from fmus.tables.terminal import laid_out, paragraph

BAD = frozenset({"diverged", "does not hold", "not met"})
"""Texts of cells that stand out on a page."""

Kind = Literal["name", "text", "number"]
"""A name says what a row is about, and is repeated where a table is folded; names and texts stand on the left."""


@dataclass(frozen=True)
class Column:
    """A column of a table.

    Attributes:
        key: in data. heading: on a page, without the unit; empty for none. unit: of what is shown.
        meaning: what the values are, in a sentence.
        kind: names and texts stand on the left, numbers on the right.
        factor: what the values, in SI units, are multiplied by for reading. digits: significant ones.
        short: heading in a terminal, where it is shorter.
        write: a value, multiplied already, as text, where `number` does not do; a line break parts it from a remark.
    """

    key: str
    heading: str = ""
    unit: str = ""
    meaning: str = ""
    kind: Kind = "number"
    factor: float = 1.0
    digits: int = 3
    short: str = ""
    write: Callable[[Any], str] | None = None

    def title(self, *, short: bool = False) -> str:
        """Heading with the unit.

        Args:
            short: for a terminal.
        """
        text = (short and self.short) or self.heading
        return f"{text} [{self.unit}]" if self.unit else text

    def cell(self, value: Any) -> str:
        """A value as text.

        Args:
            value: in SI units; a pair is an interval; None where there is none.
        """
        if isinstance(value, float | int) and not isinstance(value, bool) and self.factor != 1.0:
            value = self.factor * value
        if self.write is not None:
            return self.write(value)
        if isinstance(value, tuple):
            low, high = (number(self.factor * end, self.digits) for end in value)
            return f"{low} to {high}"
        return str(value) if isinstance(value, int) else number(value, self.digits)


def name_column(key: str, heading: str = "", meaning: str = "", **more: Any) -> Column:
    """See `Column`; one that says what its rows are about."""
    return Column(key, heading, "", meaning, "name", **more)


def text_column(key: str, heading: str = "", meaning: str = "", **more: Any) -> Column:
    """See `Column`; one of texts."""
    return Column(key, heading, "", meaning, "text", **more)


def error_column(key: str, heading: str, unit: str, meaning: str = "", **more: Any) -> Column:
    """See `Column`; one of sizes of errors, of which an infinite one reads ``diverged``."""
    return Column(key, heading, unit, meaning, write=error_number, **more)


class FirstScreen:
    """What shows itself on one screen, in a terminal (``repr``) and in a notebook: a sentence, then tables."""

    def __init_subclass__(cls, **more: Any) -> None:
        super().__init_subclass__(**more)
        cls.__repr__ = FirstScreen.__repr__  # type: ignore[method-assign] # where it stands no dataclass writes its own

    def first_screen(self) -> Parts:
        """What is shown, the most important first."""
        raise NotImplementedError

    def _screen(self) -> Parts:
        return [part.first_rows(SCREEN_ROWS) if isinstance(part, Table) else part for part in self.first_screen()]

    def __repr__(self) -> str:
        lines = joined(self._screen(), SCREEN_WIDTH).splitlines()
        more = [f"... and {len(lines) - SCREEN_LINES} more lines"] if len(lines) > SCREEN_LINES else []
        return "\n".join([*lines[:SCREEN_LINES], *more])

    def _repr_html_(self) -> str:
        return "".join(part.html() if isinstance(part, Table) else paragraph_html(part) for part in self._screen())


SCREEN_WIDTH, SCREEN_LINES, SCREEN_ROWS = 100, 40, 16
"""Columns and lines of a screen, and rows of a table on it."""


@dataclass(frozen=True)
class Table(FirstScreen):
    """A table.

    Args:
        key: in data, where it stands beside others. columns: names first. rows: values in the order of the columns.
        title: above it in a terminal. notes: below it in a terminal.
        bad: texts of cells that stand out on a page.

    Raises:
        ValueError: a row has more or fewer values than there are columns.
    """

    key: str
    columns: Sequence[Column]
    rows: Sequence[Sequence[Any]]
    title: str = ""
    notes: Sequence[str] = ()
    bad: Container[str] = BAD

    def __post_init__(self) -> None:
        for row in self.rows:
            if len(row) != len(self.columns):
                raise ValueError(f"table {self.key}: a row of {len(row)} values, expected {len(self.columns)}: {row!r}")

    def __bool__(self) -> bool:
        return bool(self.rows)

    @property
    def names(self) -> int:
        """How many columns, from the first on, say what a row is about."""
        kinds = [column.kind != "name" for column in self.columns]
        return kinds.index(True) if True in kinds else len(kinds)

    @property
    def cells(self) -> list[list[str]]:
        """The rows as texts."""
        return [[c.cell(value) for c, value in zip(self.columns, row, strict=True)] for row in self.rows]

    def filled(self, always: Collection[str] = ()) -> Table:
        """The table without columns that hold no value in any row, without rows where names alone are left.

        Args:
            always: keys of columns that stay; those of names do in any case.
        """
        shown = {column.key for i, column in enumerate(self.columns) if any(row[i] is not None for row in self.rows)}
        others = shown - {column.key for column in self.columns[: self.names]}
        kept = [i for i, c in enumerate(self.columns) if c.kind == "name" or c.key in always or c.key in shown]
        rows = [[row[i] for i in kept] for row in self.rows] if others else []
        return replace(self, columns=[self.columns[i] for i in kept], rows=rows)

    def data(self) -> list[dict[str, Any]]:
        """The rows as plain data by the keys of the columns, numbers in SI units."""
        keys = [column.key for column in self.columns]
        return [dict(zip(keys, row, strict=True)) for row in self.rows]

    def first_screen(self) -> Parts:
        """The table itself."""
        return [self]

    def first_rows(self, most: int) -> Table:
        """The table with its first rows, and a note that there are more.

        Args:
            most: how many rows.
        """
        if len(self.rows) <= most:
            return self
        note = f"... and {len(self.rows) - most} more rows"
        return replace(self, rows=self.rows[:most], notes=[note, *self.notes])

    def html(self) -> str:
        """The table for a notebook: title, headings with their meanings, rows, notes; empty without rows."""
        if not self.rows:
            return ""
        headings = [(column.title(), column.meaning) for column in self.columns]
        left = [i for i, column in enumerate(self.columns) if column.kind != "number"]
        parts = [paragraph_html(self.title), table_html(headings, self.cells, left, self.bad)]
        return "".join([*parts, paragraph_html("\n".join(self.notes))])

    def text(self, width: int | None = None) -> str:
        """The table for a terminal: title, headings, rows, notes; empty without rows; ends without a line break.

        Args:
            width: columns of the terminal, none of which is exceeded: headings and texts are wrapped, and what does not
                fit beside the names follows below them again. None for lines as long as they are.
        """
        if not self.rows:
            return ""
        headings = [column.title(short=True) for column in self.columns]
        left = [i for i, column in enumerate(self.columns) if column.kind != "number"]
        lines = laid_out(headings, self.cells, left, self.names, width)
        above = paragraph(self.title, width) if self.title else []
        return "\n".join([*above, *lines, *(line for note in self.notes for line in paragraph(note, width))])


Parts = Sequence[Table | str]
"""What is to be read, in its order; a table without rows is left out."""


def joined(parts: Parts, width: int | None = None) -> str:
    """Tables and paragraphs as one text, a blank line between them; ends without a line break.

    Args:
        parts: in their order. width: of the terminal, see `Table.text`.
    """
    texts = [p.text(width) if isinstance(p, Table) else "\n".join(paragraph(p, width)) for p in parts]
    return "\n\n".join(filter(None, texts))


class Readable(FirstScreen):
    """What people read as tables and paragraphs."""

    def first_screen(self) -> Parts:
        """All of it, as far as it finds room."""
        return self.parts()

    def parts(self) -> Parts:
        """The tables and paragraphs, in their order."""
        raise NotImplementedError

    def text(self, width: int | None = None) -> str:
        """All of it as one text; ends without a line break.

        Args:
            width: of the terminal, see `Table.text`.
        """
        return joined(self.parts(), width)


def pairs_table(key: str, entries: Mapping[str, Any], title: str = "") -> Table:
    """Names and what belongs to each, without headings.

    Args:
        key: in data. entries: values by name; of a list all are shown. title: above it.
    """

    def written(value: Any) -> str:
        return (", ".join(map(str, value)) or "none") if isinstance(value, list | tuple) else str(value)

    return Table(key, [name_column("name"), text_column("value", write=written)], list(entries.items()), title)
