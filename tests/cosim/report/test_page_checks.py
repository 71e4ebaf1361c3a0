"""The checks of `browser.check_page` can fail: pages that are broken in one way each, and one that is not."""

from __future__ import annotations

from base64 import b64encode
from pathlib import Path

import browser
import pytest

from cosim.drawing.style import new_figure, png

pytestmark = pytest.mark.browser

PICTURE = f"data:image/png;base64,{b64encode(png(new_figure((3.0, 2.0)), 50)).decode()}"
WHOLE = (
    f'<h1>Title</h1><p>Some text.</p><img alt="a picture" src="{PICTURE}"><h2 id="a">Part</h2><a href="#a">there</a>'
)
WIDE = '<table><tr><th scope="row">' + '<td style="min-width: 9rem">0.123' * 20 + "</table>"
STRUCTURE = {
    "<script>console.error('bad luck')</script>": "the console says: bad luck",
    "<script>throw new Error('no such thing')</script>": "its script fails: no such thing",
    '<img alt="x" src="https://example.org/x.png">': "it asks for https://example.org/x.png",
    "<style>@import 'https://example.org/x.css'</style>": "it asks for https://example.org/x.css",
    '<img alt="x" src="beside.png">': "it asks for file://",
    '<img alt="x" src="data:image/png;base64,AAAA">': "an image does not load: data:image/png;base64,AAAA",
    f'<img src="{PICTURE}">': "an image has no alternative text",
    "<h4>Too deep</h4>": "heading 3 (h4) skips a level",
    "<h1>Again</h1>": "there is not exactly one h1",
    '<p id="a">': "the id a is there twice",
    '<a href="#nowhere">there</a>': "the link #nowhere leads nowhere",
    "<table><tr><td>1</table>": "a table has no header cells",
    "<table><tr><th>1</table>": "a header cell has no scope",
}
BROAD = {
    '<div style="width: 1300px">broad</div>': "at 1280 px the page is 1308 px wide",
    '<div style="width: 500px">broad</div>': "at 390 px the page is",
}
CUT = {
    f'<div style="overflow: auto">{WIDE}</div>': "in print, what reaches over the edge of <div> is cut: 0.123",
    "<style>@media print { .cut { height: 1em; overflow: hidden } }</style><p "
    "class=cut>seen<br><br><br>never-seen": "never-seen",
    "<details><summary>more</summary><p>hidden-words</details>": "hidden-words",
    f'<style>@media print {{ .no {{ display: none }} }}</style><img class=no alt="y" src="{PICTURE}">': "in print "
    "there are 1",
}
SPLIT = {
    f'<div style="height: 800px"></div><img alt="y" class=tall src="{PICTURE}"><style>.tall {{ height: 900px; width: '
    f"60px }} "
    "@media print { .tall { position: relative; top: 250px } }</style>": "a picture reaches over the edge",
}


def write(folder: Path, content: str, head: str = "<title>T</title>", lang: str = ' lang="en"') -> Path:
    path = folder / "page.html"
    path.write_text(
        f'<!DOCTYPE html><html{lang}><head><meta charset="utf-8">{head}</head><body>{WHOLE}{content}', "utf-8"
    )
    return path


def test_a_sound_page_has_no_problems(tmp_path: Path) -> None:
    browser.check_page(write(tmp_path, '<table><tr><th scope="row">a<td>1</table>'))


@pytest.mark.parametrize("faults", [STRUCTURE, BROAD, CUT, SPLIT], ids=["structure", "broad", "cut", "split"])
def test_what_is_broken_is_said(faults: dict[str, str], tmp_path: Path) -> None:
    problems = browser.page_problems(write(tmp_path, "".join(faults)))
    for expected in faults.values():
        assert any(expected in problem for problem in problems), (expected, problems)


def test_language_and_title_are_demanded(tmp_path: Path) -> None:
    assert browser.page_problems(write(tmp_path, "", "", "")) == ["the page has no language", "the page has no title"]


def test_an_assertion_lists_all_problems(tmp_path: Path) -> None:
    with pytest.raises(AssertionError, match=r"(?s)skips a level.*leads nowhere"):
        browser.check_page(write(tmp_path, '<h4>x</h4><a href="#y">y</a>'))


def test_files_beside_a_page_may_be_allowed(tmp_path: Path) -> None:
    (tmp_path / "beside.png").write_bytes(png(new_figure((3.0, 2.0)), 50))
    path = write(tmp_path, '<img alt="x" src="beside.png">')
    browser.check_page(path, alone=False)
    assert len(browser.page_problems(path)) == 1


def test_without_a_browser_the_continuous_integration_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(browser, "_running", [])
    monkeypatch.setattr(browser, "find_browser", lambda: None)
    monkeypatch.setenv("CI", "1")
    with pytest.raises(pytest.fail.Exception, match="no browser"):
        browser._browser()
    monkeypatch.delenv("CI")
    with pytest.raises(pytest.skip.Exception, match="no browser"):
        browser._browser()
