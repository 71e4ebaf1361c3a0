"""Live pages without a browser: every text is escaped, whatever it is, and a page without JavaScript says so."""

from __future__ import annotations

import json
import re
from functools import cache
from html.parser import HTMLParser

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from live_pages import explored_page, overlaid_page

from cosim.report.live.live_page import (
    Folded,
    LivePage,
    Mark,
    PageCurve,
    PagePanel,
    PageRecording,
    PageVerdict,
    Rows,
    Section,
)
from cosim.report.live.render import live_page
from fmus.tables.table import Column, Table, name_column

ODD = st.text(st.characters(exclude_categories=()), min_size=1, max_size=20)
EVIL = st.sampled_from(
    ["</script><script>alert(1)</script>", "<img src=x onerror=alert(1)>", "<!--", "\x00\x1b[31m", "\u202egnp", "'\"&"]
)


class Tags(HTMLParser):
    """Elements with their attributes, and the data of the page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: list[tuple[str, tuple[tuple[str, str | None], ...]]] = []
        self.inside, self.data = "", ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        names = tuple((name, value if name in ("src", "type", "class") else None) for name, value in attrs)
        self.found.append((tag, names))
        self.inside = dict(attrs).get("id") or ""

    def handle_data(self, data: str) -> None:
        if self.inside == "live-data":
            self.data += data


def page_with(text: str) -> LivePage:
    """A page that says a text wherever somebody else writes one."""
    table = Table(
        "t", [name_column("name", text, text), Column("x", text, text, text)], [[text.replace("\n", " "), 1.0]]
    )  # a remark stands behind a line break
    curve = PageCurve(f"{text}.x", np.zeros(3), text, description=text, label=text)
    return LivePage(
        text,
        PageVerdict(text, "bad"),
        [(text, text, text, "")],
        text,
        text,
        [PageRecording(text, np.arange(3.0), [curve], text, text)],
        [PagePanel(text, [f"{text}.x"])],
        [Mark(text, 1.0, text, None, text)],
        None,
        [Section(text, [text, [text], Folded(text, [text, table]), Rows(table, [None])])],
    )


@cache
def usual() -> Tags:
    """The same page of a text in which nothing is odd."""
    return Tags(live_page(page_with("plain")))


@given(st.one_of(ODD, EVIL))
def test_no_text_adds_an_element_or_an_attribute_and_none_is_lost(text: str) -> None:
    odd = live_page(page_with(text))
    parsed = Tags(odd)
    assert parsed.found == usual().found
    data = json.loads(parsed.data)
    assert data["marks"][0]["text"] == text
    assert data["recordings"][0]["curves"][0]["name"] == f"{text}.x"
    assert not re.search("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u202a-\u202e]", odd)
    odd.encode("utf-8")


def test_a_page_says_what_it_cannot_show_without_javascript() -> None:
    text = live_page(explored_page())
    assert "The curves need JavaScript" in text
    assert "<table>" in text
    assert text.count("Leon Sorokin") == 1  # the licence goes with what it is of


@pytest.mark.parametrize(
    "recordings",
    [
        [],
        [PageRecording("none", np.array([]), [])],
        [PageRecording("empty", np.array([]), [PageCurve("a.b", np.array([]))])],
        [PageRecording("one", np.array([1.0]), [PageCurve("a.b", np.array([np.nan]))])],
        [PageRecording("wild", np.array([0.0, 0.0, 1.0]), [PageCurve("a.b", np.array([np.inf, -np.inf, 1e308]))])],
    ],
)
def test_pages_of_hardly_anything(recordings: list[PageRecording]) -> None:
    live_page(LivePage("t", PageVerdict("v"), recordings=recordings, panels=[PagePanel("p", ["a.b", "no.such"])]))


def test_one_name_with_two_units_keeps_both() -> None:
    data = json.loads(Tags(live_page(overlaid_page())).data)
    units = [c["unit"] for r in data["recordings"] for c in r["curves"] if c["name"] == "observer.force"]
    assert units == ["N", "kN"]
