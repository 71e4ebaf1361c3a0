"""Changed deliveries: the page shows what is reported of each, and those that change no output raise no alarm."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from cosim.comparison.comparison_text import MOST_LINES

ROOT = Path(__file__).resolve().parents[3]
STUDIES = ROOT / "docs" / "studies"
PAGE = ROOT / "docs" / "guide" / "regression_tests.md"
NAMES = ("changed_deliveries", "deliveries", "page_tables")

pytestmark = pytest.mark.compiler


@pytest.fixture(scope="module")
def study() -> Iterator[Any]:
    """The script of the page; it finds the others by name only."""
    sys.path.insert(0, str(STUDIES))
    try:
        module = import_module(NAMES[0])
    finally:
        sys.path.remove(str(STUDIES))
    yield module
    for name in NAMES:
        del sys.modules[name]


def test_the_page_shows_what_is_reported_of_every_changed_delivery(study: Any, tmp_path: Path) -> None:
    baseline, page = study.first_delivery(tmp_path), PAGE.read_text(encoding="utf-8")
    for change in study.CHANGES:
        found = study.held_against(baseline, change)
        assert found.equal is not change.differs, change.what
        text = study.section(change, found)
        assert text in page, f"{change.what}: run python docs/studies/changed_deliveries.py"
        assert len(text.splitlines()) <= MOST_LINES + 5
    assert sum(change.differs for change in study.CHANGES) == 7
