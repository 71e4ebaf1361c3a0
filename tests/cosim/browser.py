"""Pages in a real browser: `check_page` says all that is wrong with a page, `open_page` opens one to look into it.

One browser serves all tests of a process; `close_browser` ends it (see ``conftest.py``). A test that uses it bears the
marker ``browser``. Where no browser is installed it is skipped, but not where the environment variable CI is set: there
it fails.
"""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal

import pypdfium2
import pytest
from playwright.sync_api import Browser, BrowserContext, Page, sync_playwright
from pypdfium2.raw import FPDF_PAGEOBJ_IMAGE

NAMES = ("chromium", "chromium-browser", "google-chrome")
ARGUMENTS = [
    "--no-sandbox",
    "--disable-gpu",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-quic",
]
DESKTOP, PHONE = 1280, 390  # widths [px]
PAPER = 703  # width of A4 between margins of 12 mm [px]
EDGE = 1.0  # a page object may reach this far over the edge of the paper [pt]: half a line width, rounding

_running: list[tuple[Any, Browser]] = []


def find_browser() -> str | None:
    """Path of a browser: $CHROMIUM, or one of `NAMES` on the path, or None."""
    named = os.environ.get("CHROMIUM")
    return named or next((path for name in NAMES if (path := shutil.which(name))), None)


def _browser() -> Browser:
    """The browser of this process, started when it is first asked for."""
    if not _running:
        path = find_browser()
        if path is None:
            reason = f"no browser: none of {', '.join(NAMES)} is installed, and CHROMIUM is not set"
            if os.environ.get("CI"):
                pytest.fail(f"{reason} (.ci/run installs Debian's chromium)")
            pytest.skip(reason)
        playwright = sync_playwright().start()
        _running.append((playwright, playwright.chromium.launch(executable_path=path, args=ARGUMENTS)))
    return _running[0][1]


def close_browser() -> None:
    """End the browser, if it was started."""
    while _running:
        playwright, browser = _running.pop()
        browser.close()
        playwright.stop()


@contextmanager
def _context(width: int) -> Iterator[BrowserContext]:
    context = _browser().new_context(viewport={"width": width, "height": 900}, offline=True)
    try:
        yield context
    finally:
        context.close()


@contextmanager
def open_page(
    path: str | Path, *, width: int = DESKTOP, media: Literal["screen", "print"] = "screen"
) -> Iterator[Page]:
    """A page opened from its file, without a network.

    Args:
        path: the HTML file. width: of the window [px]. media: what the page believes it is shown on.

    Yields:
        Playwright's page.
    """
    with _context(width) as context:
        page = context.new_page()
        page.emulate_media(media=media)
        page.goto(Path(path).resolve().as_uri(), wait_until="load")
        page.wait_for_function(READY)
        yield page


def check_page(path: str | Path, *, alone: bool = True) -> None:
    """Assert that a page is fit to be shown on a desktop, on a phone and on paper.

    Args:
        path: the HTML file. alone: it may ask for nothing but itself, not even for files beside it.

    Raises:
        AssertionError: something is wrong; the message lists all of it.
    """
    problems = page_problems(path, alone=alone)
    assert not problems, f"{Path(path).name}:\n  " + "\n  ".join(problems)


def page_problems(path: str | Path, *, alone: bool = True) -> list[str]:
    """All that is wrong with a page, as sentences; see `check_page`."""
    file = Path(path).resolve()
    with _context(DESKTOP) as context:
        page = context.new_page()
        problems = _listen(page, file.as_uri(), alone)
        page.goto(file.as_uri(), wait_until="load")
        page.wait_for_function(READY)
        problems += page.evaluate(STRUCTURE)
        for width in (DESKTOP, PHONE):
            page.set_viewport_size({"width": width, "height": 900})
            page.evaluate(SETTLED)
            problems += page.evaluate(OVERFLOW, f"at {width} px")
        page.emulate_media(media="print")
        page.set_viewport_size({"width": PAPER, "height": 900})
        page.evaluate(SETTLED)
        problems += page.evaluate(OVERFLOW, "in print") + page.evaluate(CLIPPED)
        words = page.evaluate(WORDS)
        figures = page.evaluate(FIGURES)
        problems += _print_problems(page.pdf(format="A4", prefer_css_page_size=True), words, figures)
    return list(dict.fromkeys(problems))


def _listen(page: Page, address: str, alone: bool) -> list[str]:
    """A list that fills with errors and forbidden requests of a page."""
    problems: list[str] = []

    def asked(url: str) -> None:
        scheme = url.partition(":")[0]
        if scheme not in ("file", "data") or (alone and scheme == "file" and url != address):
            problems.append(f"it asks for {url[:200]}")

    page.on("request", lambda request: asked(request.url))
    page.on("pageerror", lambda error: problems.append(f"its script fails: {error.message}"))
    page.on("console", lambda said: problems.append(f"the console says: {said.text}") if said.type == "error" else None)
    return problems


def _print_problems(data: bytes, words: list[str], figures: int) -> list[str]:
    """What is cut, split or absent on paper.

    Args:
        data: the PDF. words: that must be in it. figures: how many pictures must be in it, each whole.
    """
    problems = []
    document = pypdfium2.PdfDocument(data)
    try:
        text, pictures = "", 0
        for number, sheet in enumerate(document, 1):
            width, height = sheet.get_size()
            layer = sheet.get_textpage()
            text += layer.get_text_range()
            layer.close()
            for item in sheet.get_objects(filter=[FPDF_PAGEOBJ_IMAGE]):
                pictures += 1
                left, bottom, right, top = item.get_bounds()
                if min(left, bottom, width - right, height - top) < -EDGE:
                    problems.append(f"in print, a picture reaches over the edge of sheet {number}: split or cut")
            sheet.close()
        if pictures != figures:
            problems.append(f"in print there are {pictures} pictures; {figures} are on the page: split or left out")
    finally:
        document.close()
    printed = _plain(text)
    missing = [word for word in dict.fromkeys(words) if _plain(word) not in printed]
    if missing:
        problems.append(f"in print, words are cut or hidden: {', '.join(missing[:8])}")
    return problems


def _plain(text: str) -> str:
    """Without white space and hyphens: PDFium gives those at the end of a line as something else."""
    return re.sub(r"[\s\-\u2010\ufffe\x02]", "", text)


STRUCTURE = """() => {
  const problems = [], all = (what) => [...document.querySelectorAll(what)];
  const open = all("details:not([open])"); open.forEach((d) => d.open = true);  // pictures inside must be fit as well
  for (const image of all("img")) {
    if (!image.complete || image.naturalWidth === 0) problems.push(`an image does not load: ${image.src.slice(0, 80)}`);
    if (!(image.alt || "").trim()) problems.push(`an image has no alternative text: ${image.src.slice(0, 80)}`);
  }
  open.forEach((d) => d.open = false);
  if (!document.documentElement.lang) problems.push("the page has no language");
  if (!document.title.trim()) problems.push("the page has no title");
  const levels = all("h1, h2, h3, h4, h5, h6").map((h) => Number(h.tagName[1]));
  if (levels.filter((l) => l === 1).length !== 1) problems.push("there is not exactly one h1");
  levels.forEach((l, i) => { if (l > (i ? levels[i - 1] : 0) + 1) problems.push(`heading ${i + 1} (h${l}) skips a level`); });
  const ids = all("[id]").map((e) => e.id);
  ids.filter((id, i) => ids.indexOf(id) !== i).forEach((id) => problems.push(`the id ${id} is there twice`));
  for (const link of all("a[href^='#']")) {
    if (!ids.includes(decodeURIComponent(link.hash.slice(1)))) problems.push(`the link ${link.hash} leads nowhere`);
  }
  for (const table of all("table")) {
    if (![...table.querySelectorAll("th")].length) problems.push("a table has no header cells");
    if ([...table.querySelectorAll("th")].some((th) => !th.scope)) problems.push("a header cell has no scope");
  }
  return problems;
}"""  # noqa: E501

OVERFLOW = """(where) => {
  const room = document.documentElement.clientWidth, wide = document.documentElement.scrollWidth;
  if (wide <= room) return [];
  const clipped = (e) => { for (let p = e.parentElement; p; p = p.parentElement)
    if (getComputedStyle(p).overflowX !== "visible" && p !== document.body && p !== document.documentElement) return true;
    return false; };
  const over = [...document.body.querySelectorAll("*")]
    .filter((e) => e.getBoundingClientRect().right > room + 1 && !clipped(e)).slice(0, 3)
    .map((e) => `<${e.tagName.toLowerCase()}> ${e.textContent.trim().slice(0, 40)}`);
  return [`${where} the page is ${wide} px wide in ${room} px: ${over.join("; ")}`];
}"""  # noqa: E501

CLIPPED = """() => [...document.body.querySelectorAll("*")]
  .filter((e) => getComputedStyle(e).overflowX !== "visible" && e.scrollWidth > e.clientWidth + 1)
  .map((e) => `in print, what reaches over the edge of <${e.tagName.toLowerCase()}> is cut: ` +
    e.textContent.trim().slice(0, 40))"""

WORDS = """() => {
  const words = [], walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walk.nextNode()) {
    const parent = walk.currentNode.parentElement;
    if (parent.closest("script, style, svg, .screen-only")) continue;
    words.push(...walk.currentNode.data.split(/[\\s\\u00ad\\u200b]+/).filter((w) => w));
  }
  return words;
}"""
"""Every word of the page, also those in closed details, which must open in print."""

FIGURES = """() => document.querySelectorAll("canvas").length +
  [...document.images].filter((i) => !/^data:image.svg|[.]svg$/.test(i.src)).length"""
"""Pictures and drawn curves."""

READY = "() => [...document.querySelectorAll('#explorer')].every((e) => e.dataset.ready)"
"""Whether the curves of a live page are drawn."""

SETTLED = "() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"
"""What follows the size of the window has been drawn anew."""
