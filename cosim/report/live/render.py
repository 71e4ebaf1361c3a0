"""A live page as HTML that needs nothing else. Every text that a page is given is escaped."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from functools import cache
from importlib.resources import files
from itertools import groupby
from typing import Any

from jinja2 import Environment

from cosim.report.live.first_sentence import first_sentence
from cosim.report.live.live_page import Folded, LivePage, Part, Rows
from cosim.report.live.page_data import page_data
from fmus.tables.table import Table
from fmus.templates import environment

_PACKAGE = "cosim.report.live"
_SCRIPTS = ("uplot.iife.min.js", "live_data.js", "live_chart.js", "live_tables.js", "live_explorer.js")
_STYLES = ("uplot.min.css", "style.css", "live.css")
_CONTROL = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\ud800-\udfff\u202a-\u202e\u2066-\u2069]")
"""Control characters, halves of characters, and what turns the direction of writing."""


def live_page(page: LivePage) -> str:
    """A page as HTML that needs nothing else.

    Args:
        page: what it shows.
    """
    found = page_data(page)
    text = (
        _pages()
        .get_template("page.html.j2")
        .render(
            page=page,
            has_curves=any(recording.curves for recording in page.recordings),
            reduced=found.reduced,
            blocks=found.blocks,
            data=_script_data(found.data),
            styles=_files(_STYLES),
            scripts=_files(_SCRIPTS),
            licence=_files(("uplot_license.txt",)),
        )
    )
    return _CONTROL.sub("\ufffd", text)


def _script_data(data: Any) -> str:
    """Plain data inside a script element: no text in it can end the element."""
    text = json.dumps(data, ensure_ascii=True, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


@cache
def _files(names: Sequence[str]) -> str:
    """Files of this package, one behind the other, as they are."""
    folder = files(_PACKAGE) / "templates"
    return "\n".join((folder / name).read_text("utf-8") for name in names)


def _anchor(title: str) -> str:
    """The id of a section in its page."""
    return re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-") or "section"


def groups(table: Table) -> list[tuple[str | None, list[list[str]]]]:
    """The cells of a table by its first names, where its rows have two names each; else all of them in one group
    without a name.

    Args:
        table: of a page.
    """
    if table.names < 2:
        return [(None, table.cells)]
    return [(name, [row[1:] for row in rows]) for name, rows in groupby(table.cells, key=lambda row: row[0])]


def _kind(part: Part) -> str:
    """What a part is, for the template; nothing where it has no content."""
    if isinstance(part, Rows):
        return "rows" if part.table else ""
    if isinstance(part, Folded):
        return "folded" if any(map(_kind, part.parts)) else ""
    names: dict[type, str] = {Table: "table", str: "paragraph", list: "bullets"}
    return names[type(part)] if part else ""


@cache
def _pages() -> Environment:
    pages = environment(_PACKAGE)
    filters: dict[str, Any] = {"anchor": _anchor, "first_sentence": first_sentence, "groups": groups, "kind": _kind}
    pages.filters |= filters
    return pages
