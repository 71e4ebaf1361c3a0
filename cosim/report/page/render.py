"""Pages from their templates: HTML that needs nothing else. Every text that a template inserts is escaped."""

from __future__ import annotations

import re
from base64 import b64encode
from functools import cache
from itertools import groupby
from typing import Any

from jinja2 import Environment

from fmus.tables.numbers import number
from fmus.tables.table import Table
from fmus.templates import environment

_SENTENCE_END = re.compile(r"(?<=[.]) (?=[A-Z])|(?<=;) ")
LONGEST = 220  # characters; of a longer text the first sentence is shown and the rest unfolds


def render(template: str, title: str, **values: Any) -> str:
    """A page as text.

    Args:
        template: its file among the templates of this room.
        title: of the page.
        values: what the template inserts, by name.

    Returns:
        The page.
    """
    return _pages().get_template(template).render(title=title, filled=[], **values)


def _anchor(title: str) -> str:
    """The id of a chapter in its page."""
    return re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-") or "section"


def _first_sentence(text: object) -> tuple[str, str]:
    """A long text cut behind its first sentence."""
    whole = str(text)
    first, *rest = _SENTENCE_END.split(whole, 1) if len(whole) > LONGEST else [whole]
    return (first.removesuffix(";"), rest[0]) if rest else (whole, "")


def groups(table: Table) -> list[tuple[str | None, list[list[str]]]]:
    """The cells of a table by its first names, where its rows have two names each; else all of them in one group
    without a name.

    Args:
        table: of a page.
    """
    if table.names < 2:
        return [(None, table.cells)]
    return [(name, [row[1:] for row in rows]) for name, rows in groupby(table.cells, key=lambda row: row[0])]


@cache
def _pages() -> Environment:
    pages = environment("cosim.report.page")
    filters: dict[str, Any] = {"anchor": _anchor, "first_sentence": _first_sentence, "groups": groups, "number": number}
    pages.filters |= filters | {"base64": lambda data: b64encode(data).decode("ascii")}
    return pages
