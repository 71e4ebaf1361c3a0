"""Cells as lines that fit a terminal. Standard library only.

What is printed to a file or a pipe has no width: there a row stays on one line, so that `grep` and `diff` find it
whole; columns of numbers that would make the line longer than `PIPED` are left out.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Container, Sequence
from itertools import zip_longest
from textwrap import wrap
from typing import TextIO

PIPED = 120
"""How long a line of a table in a file or a pipe may become, a text at its end apart."""
GAP = "  "
INDENT = "  "
"""Before the further lines of a cell on the left, so that they are not taken for a row."""
LEAST = 16
"""Columns that a text is not made narrower than before the table is folded."""
BREAKS = "._/,;:-"
"""Behind these a long word is broken."""

Lines = list[str]


def terminal_width(stream: TextIO | None = None) -> int | None:
    """Columns of the terminal that is printed to: as the variable COLUMNS says, or the terminal itself; None where it
    is none.

    Args:
        stream: that is printed to; None for standard output.
    """
    to = sys.stdout if stream is None else stream
    asked = os.environ.get("COLUMNS", "")
    if asked.isdecimal() and int(asked) > 0:
        return int(asked)
    try:
        return (os.get_terminal_size(to.fileno()).columns or None) if to.isatty() else None
    except (OSError, ValueError):  # the stream was replaced or closed
        return None


def paragraph(text: str, width: int | None) -> Lines:
    """A text as lines. Only a word that is longer than a line, as a path may be, stands out, so that it can be copied.

    Args:
        text: its own line breaks stay. width: of the lines; None for any.
    """
    lines = text.split("\n")
    if width is None:
        return lines
    found = []
    for line in lines:
        blanks = len(line) - len(line.lstrip(" "))
        indent = " " * min(blanks + (2 if line.lstrip().startswith("- ") else 0), width // 2)
        broken = (
            wrap(line, width, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)
            if len(line) > width
            else [line]
        )
        found += broken
    return found


def laid_out(
    headings: Sequence[str], rows: Sequence[Sequence[str]], left: Container[int], names: int, width: int | None
) -> Lines:
    """A table as lines, without blanks at their ends, a rule below the headings.

    Args:
        headings: of the columns, all empty for none. rows: cells, whose line breaks stay.
        left: indices of the columns that stand on the left. names: how many columns from the first on name a row.
        width: that no line exceeds; None for any.
    """
    natural = [max(_width(cell) for cell in column) for column in zip(headings, *rows, strict=True)]
    widths = natural
    blocks = [list(range(len(headings)))]
    if width is not None:
        least = _least(headings, rows, widths, left)
        widths = _narrowed(widths, least, width)
        if _total(widths) > width:
            widths = [old if i in left else least[i] for i, old in enumerate(natural)]
            blocks = _folded(widths, min(names, len(headings) - 1), width)
    tables = [_block([headings, *rows], block, widths, left) for block in blocks]
    return [line for i, table in enumerate(tables) for line in ([""] if i else []) + table]


def room_for(
    headings: Sequence[str], rows: Sequence[Sequence[str]], left: Container[int], names: int, most: int
) -> tuple[list[int], list[str]]:
    """The columns of a table that find room where rows stay on one line: all that are no numbers, and of these the
    first ones.

    Args:
        headings: of the columns. rows: cells. left: indices of the columns that stand on the left.
        names: how many columns from the first on name a row. most: length of a line; a text that ends it may be longer.

    Returns:
        Indices of the columns, and all headings, with line breaks where this makes room.
    """
    natural = [max(_width(cell) for cell in column) for column in zip(headings, *rows, strict=True)]
    ends = len(headings) - 1 if len(headings) - 1 in left and len(headings) > names else len(headings)
    pieces = [max(map(len, _pieces(heading))) for heading in headings]
    least = [max([pieces[i], *(_width(row[i]) for row in rows)]) for i in range(len(headings))]
    kept = [i for i in range(ends) if i in left or i < names]
    for i in range(ends):
        if i not in kept and (not kept or _total([least[j] for j in (*kept, i)]) <= most):
            kept.append(i)
    kept.sort()
    widths = dict(zip(kept, _narrowed([natural[i] for i in kept], [least[i] for i in kept], most), strict=True))
    broken = [
        "\n".join(_broken(heading, widths.get(i, len(heading)), indented=False)) for i, heading in enumerate(headings)
    ]
    return [*kept, *range(ends, len(headings))], broken


def _pieces(heading: str) -> list[str]:
    """What a heading is broken into at most; a unit stays whole."""
    return re.split(r"\s+|(?<=[._])", heading)


def _width(cell: str) -> int:
    return max(map(len, cell.split("\n")))


def _total(widths: Sequence[int]) -> int:
    return sum(widths) + len(GAP) * (len(widths) - 1)


def _least(
    headings: Sequence[str], rows: Sequence[Sequence[str]], widths: Sequence[int], left: Container[int]
) -> list[int]:
    """Widths that columns are not made narrower than: of numbers their headings are wrapped."""
    cells = [max((_width(row[i]) for row in rows), default=0) for i in range(len(widths))]
    pieces = [max(map(len, _pieces(heading))) for heading in headings]
    return [min(old, LEAST if i in left else max(cells[i], pieces[i])) for i, old in enumerate(widths)]


def _narrowed(widths: Sequence[int], least: Sequence[int], width: int) -> list[int]:
    """Widths with which a table fits, or is as narrow as it can be: the columns with most to give become narrower."""
    found = list(widths)
    while _total(found) > width and found != list(least):
        found[max(range(len(found)), key=lambda i: found[i] - least[i])] -= 1
    return found


def _folded(widths: list[int], names: int, width: int) -> list[list[int]]:
    """Columns of tables below each other, each with the names again; too wide columns are made narrower."""
    head = list(range(names))
    room = max(width // 2 - len(GAP) * names, names)
    while sum(widths[i] for i in head) > room:
        widths[max(head, key=lambda i: widths[i])] -= 1
    beside = width - (_total([widths[i] for i in head]) + len(GAP) if head else 0)
    blocks: list[list[int]] = [[]]
    for i in range(names, len(widths)):
        widths[i] = min(widths[i], max(beside, 1))
        if blocks[-1] and _total([widths[j] for j in (*blocks[-1], i)]) > beside:
            blocks.append([])
        blocks[-1].append(i)
    return [head + block for block in blocks]


def _block(table: Sequence[Sequence[str]], chosen: Sequence[int], widths: Sequence[int], left: Container[int]) -> Lines:
    """Some columns as lines; headings stand low, cells high."""
    found: Lines = []
    for number, row in enumerate(table):
        cells = [_broken(row[i], widths[i], indented=i in left and number > 0) for i in chosen]
        height = max(map(len, cells))
        if number == 0:
            cells = [[""] * (height - len(cell)) + cell for cell in cells]
        for parts in zip_longest(*cells, fillvalue=""):
            aligned = [
                p.ljust(widths[i]) if i in left else p.rjust(widths[i]) for i, p in zip(chosen, parts, strict=True)
            ]
            found.append(GAP.join(aligned).rstrip())
        if number == 0:
            found = [*found, "-" * _total([widths[i] for i in chosen])] if any(table[0]) else []
    return found


def _broken(cell: str, width: int, *, indented: bool) -> Lines:
    """A cell as lines of a width at most; nothing is left out."""
    indent = INDENT if indented and width > 2 * len(INDENT) else ""
    lines: Lines = []
    for text in cell.split("\n"):
        rest = text
        while len(rest) > width:
            cut = _cut(rest, width)
            lines.append(rest[:cut].rstrip())
            rest = indent + rest[cut:].lstrip()
        lines.append(rest)
    return lines


def _cut(text: str, width: int) -> int:
    """Where a text is broken: at a blank, behind what parts a word, or where the line ends."""
    blanks = len(text) - len(text.lstrip())
    cut = text.rfind(" ", blanks, width + 1)
    if cut <= blanks:
        cut = max(text.rfind(mark, blanks, width) + 1 for mark in BREAKS)
    return cut if cut > blanks else width
