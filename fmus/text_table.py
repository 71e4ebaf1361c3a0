"""Text tables for a terminal: rows of cells as aligned lines. Standard library only."""

from __future__ import annotations

from collections.abc import Container, Sequence

GAP = "  "


def text_table(rows: Sequence[Sequence[str]], left: Container[int] = (0,), *, heading: bool = False) -> list[str]:
    """Rows of cells as aligned lines.

    Args:
        rows: cells as text, equally many in each row.
        left: indices of the columns that stand on the left, as names do; all others stand on the right, as numbers do.
        heading: the first row holds the headings; a rule below it parts them from the others.

    Returns:
        The lines, without blanks at their ends; none without rows.

    Raises:
        ValueError: a row has more or fewer cells than the first.
    """
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = []
    for row in rows:
        cells = (
            cell.ljust(width) if i in left else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        lines.append(GAP.join(cells).rstrip())
    rule = ["-" * (sum(widths) + len(GAP) * (len(widths) - 1))] if heading and lines else []
    return [*lines[:1], *rule, *lines[1:]]
