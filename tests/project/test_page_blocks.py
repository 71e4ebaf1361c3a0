"""What the pages tell the reader to type works: Python blocks, scenario files and commands, page by page in order."""

from __future__ import annotations

import re
from pathlib import Path
from pkgutil import resolve_name

import pytest
from forked import Run
from pages import PAGES, ROOT, TUTORIALS, blocks

READER = Path(__file__).with_name("page_reader.py")
WITH_CODE = [
    page
    for page in PAGES
    if page not in TUTORIALS and any(b.language in ("python", "toml", "sh") and b.command is None for b in blocks(page))
]


@pytest.mark.follows
@pytest.mark.compiler
@pytest.mark.parametrize("page", WITH_CODE, ids=lambda p: p.name)
def test_blocks_of_a_page(page: Path, tmp_path: Path, run_forked: Run, follows: list[str]) -> None:
    follows.append(page.relative_to(ROOT).as_posix())
    done = run_forked(["python", str(READER), str(page)], folder=tmp_path)
    assert done.returncode == 0, done.output


NAMES = re.compile(r"`((?:plant_models|fmu_observer|fmus|cosim)(?:\.[A-Za-z_]\w*)+)[`(]")


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_names_that_a_page_mentions_exist(page: Path) -> None:
    missing = []
    for name in NAMES.findall(page.read_text(encoding="utf-8")):
        try:
            resolve_name(name)
        except (ImportError, AttributeError):
            missing.append(name)
    assert missing == []


def test_every_language_is_checked_or_plain() -> None:
    assert {b.language for page in PAGES for b in blocks(page)} <= {"python", "toml", "sh", "text"}
