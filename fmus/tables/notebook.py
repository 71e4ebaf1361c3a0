"""Tables and sentences as a piece of HTML for a notebook, whose colours it takes. Standard library only."""

from __future__ import annotations

from collections.abc import Container, Sequence
from html import escape

_CELL = "padding: .15rem .6rem; vertical-align: top; text-align: {side};"
_BAD = " font-weight: bold; color: #d55e00;"
"""Vermilion, which is seen on light and on dark ground and by colour-blind people."""


def paragraph_html(text: str) -> str:
    """A text, its line breaks kept; empty for an empty one.

    Args:
        text: anything; markup in it is shown and not obeyed.
    """
    return f'<p style="white-space: pre-wrap;">{escape(text)}</p>' if text else ""


def table_html(
    headings: Sequence[tuple[str, str]],
    rows: Sequence[Sequence[str]],
    left: Container[int],
    bad: Container[str],
) -> str:
    """A table; columns of texts stand on the left, of numbers on the right.

    Args:
        headings: of the columns, each with its meaning, shown as a tooltip; all empty for none. rows: cells.
        left: indices of the columns that stand on the left. bad: texts of cells that stand out.
    """
    styles = [_CELL.format(side="left" if i in left else "right") for i in range(len(headings))]

    def row(cells: Sequence[str]) -> str:
        parts = [
            f'<td style="{style}{_BAD if cell in bad else ""}">{escape(cell).replace(chr(10), "<br>")}</td>'
            for style, cell in zip(styles, cells, strict=True)
        ]
        return f"<tr>{''.join(parts)}</tr>"

    heads = [
        f'<th style="{style}" title="{escape(meaning)}">{escape(text)}</th>'
        for style, (text, meaning) in zip(styles, headings, strict=True)
    ]
    head = f"<thead><tr>{''.join(heads)}</tr></thead>" if any(text for text, _ in headings) else ""
    return f"<table>{head}<tbody>{''.join(map(row, rows))}</tbody></table>"
