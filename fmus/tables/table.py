"""A table as one value: columns with their units and meanings, rows of plain values, notes. It is shown in a terminal,
on a page and as data. Standard library only.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Container, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

from fmus.tables.notebook import paragraph_html, table_html
from fmus.tables.numbers import DASH, error_number, number
from fmus.tables.terminal import laid_out, paragraph, room_for

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

    def _picture_html(self) -> str:
        """What a notebook shows behind the first sentence: curves, where there are any."""
        return ""

    def _repr_html_(self) -> str:
        shown = [part.html() if isinstance(part, Table) else paragraph_html(part) for part in self._screen()]
        return "".join([*shown[:1], self._picture_html(), *shown[1:]])


SCREEN_WIDTH, SCREEN_LINES, SCREEN_ROWS = 100, 40, 16
"""Columns and lines of a screen, and rows of a table on it."""


@dataclass(frozen=True)
class Table(FirstScreen):
    """A table.

    Args:
        key: in data, where it stands beside others. columns: names first. rows: values in the order of the columns.
        title: above it in a terminal. notes: below it in a terminal.
        bad: texts of cells that stand out on a page.
        rows_are: what the rows are, such as ``runs``: a column that reads the same in all of them is then shown as a
            part of `lead`. lead: a sentence above it wherever it is shown.

    Raises:
        ValueError: a row has more or fewer values than there are columns.
    """

    key: str
    columns: Sequence[Column]
    rows: Sequence[Sequence[Any]]
    title: str = ""
    notes: Sequence[str] = ()
    bad: Container[str] = BAD
    rows_are: str = ""
    lead: str = ""

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

    def shown(self) -> Table:
        """The table as it is read: what is the same in all rows stands in a sentence above, see `rows_are`."""
        if not self.rows_are or not self.names or len(self.rows) < 2:
            return self
        cells = list(zip(*self.cells, strict=True))
        same = [i for i, column in enumerate(self.columns) if column.kind != "name" and len(set(cells[i])) == 1]
        kept = [i for i in range(len(self.columns)) if i not in same]
        none = [i for i in same if cells[i][0] in ("", DASH)]
        known = [
            f"{self.columns[i].heading} {cells[i][0]} {self.columns[i].unit}".strip() for i in same if i not in none
        ]
        lead = [f"The same in all {self.rows_are}: {', '.join(known)}."] if known else []
        names = ", ".join(self.columns[i].heading.strip() for i in none)
        lead += [f"Without a value in all {self.rows_are}: {names}."] if none else []
        return replace(
            self,
            columns=[self.columns[i] for i in kept],
            rows=[[row[i] for i in kept] for row in self.rows],
            rows_are="",
            lead=" ".join([self.lead, *lead]).strip(),
        )

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
        shown = self.shown()
        return replace(shown, rows=shown.rows[:most], notes=[note, *self.notes])

    def html(self) -> str:
        """The table for a notebook: title, headings with their meanings, rows, notes; empty without rows."""
        if not self.rows:
            return ""
        shown = self.shown()
        headings = [(column.title(), column.meaning) for column in shown.columns]
        table = table_html(headings, shown.cells, shown._left, self.bad)
        texts = (self.title, shown.lead, "\n".join(self.notes))
        title, lead, notes = map(paragraph_html, texts)
        return f"{title}{lead}{table}{notes}"

    @property
    def _left(self) -> list[int]:
        """Indices of the columns that stand on the left."""
        return [i for i, column in enumerate(self.columns) if column.kind != "number"]

    def text(self, width: int | None = None) -> str:
        """The table for a terminal: title, headings, rows, notes; empty without rows; ends without a line break.

        Args:
            width: columns of the terminal, none of which is exceeded: headings and texts are wrapped, and what does not
                fit beside the names follows below them again. None for lines as long as they are.
        """
        if not self.rows:
            return ""
        shown = self.shown()
        lines = laid_out(shown._headings, shown.cells, shown._left, shown.names, width)
        above = [line for text in (self.title, shown.lead) if text for line in paragraph(text, width)]
        return "\n".join([*above, *lines, *(line for note in self.notes for line in paragraph(note, width))])

    def within(self, most: int, how: str) -> Table:
        """The table for a file or a pipe, where a row stays on a line: headings are wrapped, and columns of numbers
        that find no room all the same are named in a note.

        Args:
            most: length of a line; only a text that ends a row may be longer. how: such columns can be seen.
        """
        shown = self.shown()
        kept, headings = room_for(shown._headings, shown.cells, shown._left, shown.names, most)
        left_out = [column.heading for i, column in enumerate(shown.columns) if i not in kept]
        note = f"{len(left_out)} more columns, {how}: {', '.join(left_out)}."
        return replace(
            shown,
            columns=[replace(shown.columns[i], short=headings[i], unit="") for i in kept],
            rows=[[row[i] for i in kept] for row in shown.rows],
            notes=[note, *self.notes] if left_out else self.notes,
        )

    @property
    def _headings(self) -> list[str]:
        return [column.title(short=True) for column in self.columns]


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
