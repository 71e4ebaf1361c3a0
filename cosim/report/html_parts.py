"""Pieces of an HTML page; every text is escaped here. Standard library only."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable, Sequence
from html import escape

CSS = """
body { font: 16px/1.5 system-ui, "Segoe UI", "DejaVu Sans", sans-serif; color: #1b1b1b; background: #fff;
  max-width: 62rem; margin: 0 auto; padding: 1rem; }
h1 { font-size: 1.6rem; line-height: 1.25; margin: .5rem 0; }
h2 { font-size: 1.2rem; margin: 2rem 0 .5rem; border-bottom: 1px solid #ccc; padding-bottom: .2rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: .9rem; margin: .5rem 0; }
caption { text-align: left; color: #444; padding: .2rem 0; }
th, td { padding: .3rem .6rem; text-align: left; vertical-align: top; border-bottom: 1px solid #ddd; }
th { font-weight: 600; } thead th { border-bottom: 2px solid #666; vertical-align: bottom; }
tbody th[scope=row] { font-weight: 400; }
tbody { border-bottom: 1px solid #999; }
td.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
.bad { color: #b00020; font-weight: 600; }
.box { border-left: .4rem solid; padding: .6rem 1rem; margin: 1rem 0; }
.failure { border-color: #b00020; background: #fdecee; } .warning { border-color: #b26a00; background: #fff4e0; }
.box h2 { border: 0; margin: 0 0 .3rem; padding: 0; } .box ul { margin: 0; padding-left: 1.2rem; }
figure { margin: 1rem 0 1.6rem; } img { max-width: 100%; height: auto; display: block; }
figcaption { color: #444; font-size: .9rem; margin-top: .3rem; }
footer { margin-top: 2rem; color: #444; font-size: .85rem; }
@media (max-width: 40rem) { body { padding: .6rem; font-size: 15px; } th, td { padding: .25rem .4rem; } }
@media print { body { max-width: none; font-size: 10pt; } figure, tr, .box { break-inside: avoid; }
  h2 { break-after: avoid; } .wide { overflow: visible; } table { font-size: 8pt; } }
"""


def page(title: str, content: Iterable[str]) -> str:
    """A whole page that needs nothing from outside."""
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n<title>{escape(title)}</title>\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<style>{CSS}</style>\n</head>\n<body>\n" + "\n".join(part for part in content if part) + "\n</body>\n</html>\n"
    )


def section(title: str, *content: str) -> str:
    """A heading with what follows it; nothing where all of `content` is empty."""
    inner = "\n".join(part for part in content if part)
    return f"<section>\n<h2>{escape(title)}</h2>\n{inner}\n</section>" if inner else ""


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
    return f'<div class="wide" tabindex="0">{html}</div>'


def simple_table(headings: Sequence[str], rows: Sequence[Sequence[str]], numbers: Sequence[int] = ()) -> str:
    """A table whose first column heads its rows; empty without rows.

    Args:
        headings: of the columns. rows: texts. numbers: indices of columns that hold numbers.
    """
    if not rows:
        return ""
    head = "".join(f'<th scope="col">{escape(text)}</th>' for text in headings)
    lines = []
    for row in rows:
        kinds = ['<td class="number">' if i in numbers else "<td>" for i in range(1, len(row))]
        data = [f"{kind}{escape(text)}</td>" for kind, text in zip(kinds, row[1:], strict=True)]
        lines.append(f'<tr><th scope="row">{escape(row[0])}</th>{"".join(data)}</tr>')
    body = "\n".join(lines)
    return scrolling(f"<table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n</tbody>\n</table>")


def picture(data: bytes, title: str, caption: str) -> str:
    """A PNG inside the page, with its caption."""
    source = b64encode(data).decode("ascii")
    return (
        f'<figure>\n<img alt="{escape(f"{title} against time. {caption}")}" src="data:image/png;base64,{source}">\n'
        f"<figcaption><b>{escape(title)}.</b> {escape(caption)}</figcaption>\n</figure>"
    )
