"""Prose: the docstring of a system as blocks of text. Knows the few forms that docstrings of this project have."""

from __future__ import annotations

import re
from collections.abc import Iterator
from inspect import cleandoc
from textwrap import dedent
from typing import Literal

Block = tuple[Literal["p", "ul", "ol", "options"], list[str]]
"""What it is, a paragraph, one of two lists, or the options of the model as ``name: meaning``; and its texts."""

_PYTHON_ONLY = ("Raises:", "Returns:", "Yields:", "Example:")
"""Sections that say nothing to the user of an FMU."""
CODE = re.compile(r"``(.+?)``|`([^`]+?)`")


def blocks(docstring: str) -> list[Block]:
    """Paragraphs, lists and options of a docstring, as far as they say something to the user of an FMU.

    Args:
        docstring: with ``code`` in double or single backquotes, lists that begin with ``- `` or ``1. ``, and ``Args:``.

    Returns:
        The blocks in their order.
    """
    return [_block(lines) for lines in _paragraphs(docstring) if lines[0].strip() not in _PYTHON_ONLY]


def pieces(text: str) -> list[tuple[str, bool]]:
    """A text cut at its code.

    Args:
        text: with code in double or single backquotes.

    Returns:
        Pieces on one line, and of each whether it is code.
    """
    found: list[tuple[str, bool]] = []
    for place, piece in enumerate(CODE.split(" ".join(text.split()))):
        if piece:
            found.append((piece, place % 3 != 0))
    return found


def _paragraphs(docstring: str) -> Iterator[list[str]]:
    for paragraph in re.split(r"\n\s*\n", cleandoc(docstring)):
        if paragraph.strip():
            yield paragraph.strip("\n").splitlines()


def _block(lines: list[str]) -> Block:
    if lines[0].strip() == "Args:":
        return "options", _items(dedent("\n".join(lines[1:])).splitlines(), r"(?=\w+(?:, \w+)*: )")
    if re.match(r"- ", lines[0]):
        return "ul", _items(lines, r"- ")
    if re.match(r"\d+\. ", lines[0]):
        return "ol", _items(lines, r"\d+\. ")
    return "p", [" ".join(lines)]


def _items(lines: list[str], marker: str) -> list[str]:
    items: list[str] = []
    for line in lines:
        if re.match(marker, line):
            items.append(re.sub(rf"^{marker}", "", line))
        else:
            items[-1] += " " + line.strip()
    return items
