"""Pieces of an HTML page; every text is escaped here. Standard library only."""

from __future__ import annotations

import re
from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from html import escape

from cosim.report.page.css import CSS

SENTENCE_END = re.compile(r"(?<=[.]) (?=[A-Z])|(?<=;) ")
LONG_TEXT = 40  # characters; a cell with more of them gets room


def page(title: str, content: Iterable[str]) -> str:
    """A whole page that needs nothing from outside."""
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n<title>{escape(title)}</title>\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<style>{CSS}</style>\n</head>\n<body>\n"
        + "\n".join(part for part in content if part)
        + "\n</body>\n</html>\n"
    )


def anchor(title: str) -> str:
    """The id of a section in its page, from its title."""
    return re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-") or "section"


def section(title: str, *content: str) -> str:
    """A heading with what follows it; nothing where all of `content` is empty."""
    inner = "\n".join(part for part in content if part)
    return f'<section id="{escape(anchor(title))}">\n<h2>{escape(title)}</h2>\n{inner}\n</section>' if inner else ""


def contents(titles: Iterable[str]) -> str:
    """Links to the sections of a page, for the screen; empty without any."""
    items = "".join(f'<li><a href="#{escape(anchor(title))}">{escape(title)}</a></li>' for title in titles)
    return f'<nav class="contents screen-only" aria-label="Contents"><ul>{items}</ul></nav>' if items else ""


def chapters(parts: Mapping[str, Sequence[str]]) -> str:
    """A table of contents and the sections, without those that are empty.

    Args:
        parts: HTML by title of the section.
    """
    sections = {title: section(title, *content) for title, content in parts.items()}
    filled = {title: text for title, text in sections.items() if text}
    return "\n".join([contents(filled), *filled.values()])


def paragraph(text: str) -> str:
    """A paragraph; empty for an empty text."""
    return f"<p>{escape(text)}</p>" if text else ""


def bullets(texts: Iterable[object]) -> str:
    """A list; empty without items."""
    items = "".join(f"<li>{escape(str(text))}</li>" for text in texts)
    return f"<ul>{items}</ul>" if items else ""


def box(kind: str, title: str, content: str) -> str:
    """A coloured box (``failure`` or ``warning``) around HTML `content`."""
    role = ' role="alert"' if kind == "failure" else ""
    return f'<section class="box {kind}"{role}>\n<h2>{escape(title)}</h2>\n{content}\n</section>'


def scrolling(html: str) -> str:
    """A wide element that scrolls within a narrow screen and by keyboard."""
    about = "Table; scrolls sideways where it is wide"
    return f'<div class="wide" tabindex="0" role="region" aria-label="{about}">{html}</div>'


def simple_table(headings: Sequence[str], rows: Sequence[Sequence[str]], numbers: Sequence[int] = ()) -> str:
    """A table whose first column heads its rows; empty without rows.

    Args:
        headings: of the columns. rows: texts. numbers: indices of columns that hold numbers.
    """
    if not rows:
        return ""
    kinds = [' class="number"' if i in numbers else "" for i in range(len(headings))]
    head = "".join(f'<th scope="col"{kind}>{escape(text)}</th>' for kind, text in zip(kinds, headings, strict=True))
    lines = []
    for row in rows:
        data = [f"<td{kind or _room(text)}>{escape(text)}</td>" for kind, text in zip(kinds[1:], row[1:], strict=True)]
        lines.append(f'<tr><th scope="row">{escape(row[0])}</th>{"".join(data)}</tr>')
    body = "\n".join(lines)
    return scrolling(f"<table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n</tbody>\n</table>")


def _room(text: str) -> str:
    return ' class="text"' if len(text) > LONG_TEXT else ""


def grouped_table(headings: Sequence[str], groups: Sequence[tuple[str, Sequence[Sequence[str]]]]) -> str:
    """A table of numbers whose rows stand in groups, each with a name before its rows; empty without rows.

    Args:
        headings: of the columns, that of the group first.
        groups: name and rows; the first cell of a row heads it; a remark stands behind a line break in its cell.
    """
    kinds = ["", "", *([' class="number"'] * (len(headings) - 2))]
    head = "".join(f'<th scope="col"{kind}>{escape(text)}</th>' for kind, text in zip(kinds, headings, strict=True))
    if not any(rows for _, rows in groups):
        return ""
    bodies = []
    for name, rows in groups:
        first = f'<th scope="rowgroup" rowspan="{len(rows)}">{escape(name)}</th>'
        lines = [
            f"<tr>{first if i == 0 else ''}<th "
            f'scope="row">{escape(row[0])}</th>{"".join(map(_number_cell, row[1:]))}</tr>'
            for i, row in enumerate(rows)
        ]
        bodies.append("<tbody>" + "\n".join(lines) + "</tbody>")
    body = "\n".join(bodies)
    return scrolling(f"<table>\n<thead><tr>{head}</tr></thead>\n{body}\n</table>")


def _number_cell(text: str) -> str:
    value, _, remark = text.partition("\n")
    small = f"<small>{escape(remark)}</small>" if remark else ""
    return f'<td class="number{" bad" if value == "diverged" else ""}">{escape(value)}{small}</td>'


def picture(data: bytes, title: str, caption: str) -> str:
    """A PNG inside the page, with its caption."""
    source = b64encode(data).decode("ascii")
    return (
        f'<figure>\n<img alt="{escape(f"{title} against time. {caption}")}" src="data:image/png;base64,{source}">\n'
        f"<figcaption><b>{escape(title)}.</b> {escape(caption)}</figcaption>\n</figure>"
    )


def details(summary: str, content: str, *, opened: bool = False) -> str:
    """HTML `content` that unfolds below a line of text; in print it is unfolded. Empty without content."""
    return (
        f"<details{' open' if opened else ''}><summary>{escape(summary)}</summary>\n{content}\n</details>"
        if content
        else ""
    )


def folded(text: object, longest: int = 220) -> str:
    """A paragraph; of a long text the first sentence is seen, and the rest unfolds."""
    whole = str(text)
    first, *rest = SENTENCE_END.split(whole, 1) if len(whole) > longest else [whole]
    return details(first.removesuffix(";"), paragraph(rest[0])) if rest else paragraph(whole)


def facts(entries: Iterable[tuple[str, str, str, str]]) -> str:
    """The few numbers that matter, as cards.

    Args:
        entries: name, value, remark, and mood (``good``, ``bad``, ``doubt`` or empty) of each.
    """
    cards = [
        f'<div class="{escape(mood)}"><dt>{escape(name)}</dt><dd class="value">{escape(value)}</dd>'
        + (f'<dd class="remark">{escape(remark)}</dd>' if remark else "")
        + "</div>"
        for name, value, remark, mood in entries
    ]
    return f'<dl class="facts">{"".join(cards)}</dl>' if cards else ""


def side_by_side(figures: Iterable[str]) -> str:
    """Small figures, two in a row where there is room; empty without any."""
    inner = "\n".join(figures)
    return f'<div class="pairs">\n{inner}\n</div>' if inner else ""
