"""A table of a page as data: headings, rows in groups, and what is to stand out."""

from __future__ import annotations

from collections.abc import Container, Iterable, Sequence
from dataclasses import dataclass

BAD = frozenset({"diverged", "does not hold", "not met"})
"""Cells that stand out."""

Rows = Sequence[Sequence[str]]


@dataclass(frozen=True, slots=True)
class PageTable:
    """A table whose rows have a heading each, their first cell; it is left out without rows.

    Args:
        headings: of the columns, that of the groups first where they have names.
        groups: name and rows of each; None for the only group of a table without groups. What stands behind a line
            break in a cell is a remark.
        numbers: indices of the columns of numbers.
        bad: texts of cells that stand out.
    """

    headings: Sequence[str]
    groups: Sequence[tuple[str | None, Rows]]
    numbers: Container[int] = ()
    bad: Container[str] = BAD


def simple_table(headings: Sequence[str], rows: Rows, numbers: Container[int] = ()) -> PageTable:
    """A table without groups.

    Args:
        headings: of the columns.
        rows: texts of their cells.
        numbers: indices of the columns of numbers.

    Returns:
        The table.
    """
    return PageTable(headings, [(None, rows)], numbers)


def grouped_table(headings: Sequence[str], groups: Iterable[tuple[str, Rows]]) -> PageTable:
    """A table of numbers whose rows stand in groups.

    Args:
        headings: of the columns, first that of the groups, then that of the rows.
        groups: name and rows of each.

    Returns:
        The table.
    """
    return PageTable(headings, list(groups), range(2, len(headings)))
