"""Prose: the docstring of a system becomes HTML. Knows the few forms that docstrings of this project have."""

from __future__ import annotations

import re
from collections.abc import Iterator
from html import escape
from inspect import cleandoc
from textwrap import dedent

PYTHON_ONLY = ("Raises:", "Returns:", "Yields:", "Example:")
"""Sections that say nothing to the user of an FMU."""


def prose(docstring: str) -> str:
    """Paragraphs, lists and formulae of a docstring as HTML.

    Args:
        docstring: with ``code`` in double or single backquotes, lists that begin with ``- `` or ``1. ``, and ``Args:``.
    """
    return "\n".join(filter(None, map(_block, _blocks(docstring))))


def first_paragraph(docstring: str) -> str:
    """The first paragraph of a docstring as HTML."""
    return _block(next(_blocks(docstring), []))


def inline(text: str) -> str:
    """One line: text with code, formulae (code with an equals sign) marked as such."""
    pieces = re.split(r"``(.+?)``|`([^`]+?)`", " ".join(text.split()))
    html = ""
    for i in range(0, len(pieces), 3):
        html += escape(pieces[i])
        code = next((p for p in pieces[i + 1 : i + 3] if p is not None), None)
        if code is not None:
            html += f'<code class="formula">{escape(code)}</code>' if " = " in code else f"<code>{escape(code)}</code>"
    return html


def _blocks(docstring: str) -> Iterator[list[str]]:
    block: list[str] = []
    for line in [*cleandoc(docstring).splitlines(), ""]:
        if line.strip():
            block.append(line)
        elif block:
            yield block
            block = []


def _block(lines: list[str]) -> str:
    if not lines or lines[0].strip() in PYTHON_ONLY:
        return ""
    if lines[0].strip() == "Args:":
        return "<h3>Options of the model</h3>\n" + _definitions(lines[1:])
    for marker, tag in ((r"- ", "ul"), (r"\d+\. ", "ol")):
        if re.match(marker, lines[0]):
            items = "".join(f"<li>{inline(item)}</li>" for item in _items(lines, marker))
            return f"<{tag}>{items}</{tag}>"
    return f"<p>{inline(' '.join(lines))}</p>"


def _items(lines: list[str], marker: str) -> list[str]:
    items: list[str] = []
    for line in lines:
        if re.match(marker, line):
            items.append(re.sub(rf"^{marker}", "", line))
        else:
            items[-1] += " " + line.strip()
    return items


def _definitions(lines: list[str]) -> str:
    items = _items(dedent("\n".join(lines)).splitlines(), r"(?=\w+: )")
    pairs = (item.partition(": ") for item in items)
    return (
        "<dl>"
        + "".join(f"<dt><code>{escape(name)}</code></dt><dd>{inline(text)}</dd>" for name, _, text in pairs)
        + "</dl>"
    )
