"""The pictures of the guide are those that its script draws, each of the scenarios of the page that shows it."""

from __future__ import annotations

import importlib.util
from types import ModuleType

from pages import ROOT

DOCS = ROOT / "docs"


def drawer() -> ModuleType:
    spec = importlib.util.spec_from_file_location("guide_pictures", DOCS / "guide_pictures.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_picture_is_drawn_for_a_page_that_shows_it() -> None:
    drawn = drawer().DRAWN
    assert {path.stem for path in (DOCS / "images" / "guide").iterdir()} == set(drawn)
    for name, (page, _draw) in drawn.items():
        assert f"(../images/guide/{name}.png)" in (DOCS / "guide" / f"{page}.md").read_text(encoding="utf-8"), name


def test_pictures_of_the_pages_are_small() -> None:
    sizes = {path.name: path.stat().st_size for path in (DOCS / "images" / "guide").iterdir()}
    assert max(sizes.values()) < 100_000, sizes
