"""The API reference has what the packages offer and what the pages import, each once."""

from __future__ import annotations

import importlib.util
from importlib import import_module
from types import ModuleType

import pytest
from pages import PACKAGES, ROOT


def generator() -> ModuleType:
    spec = importlib.util.spec_from_file_location("api_pages", ROOT / "docs" / "api_pages.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def pages() -> dict[str, str]:
    texts: dict[str, str] = generator().pages()
    return texts


def test_a_page_for_each_package(pages: dict[str, str]) -> None:
    assert sorted(pages) == sorted(PACKAGES)


@pytest.mark.parametrize("package", PACKAGES)
def test_what_a_package_offers_stands_in_it_once(package: str, pages: dict[str, str]) -> None:
    module = import_module(package)
    for name in module.__all__:
        thing = getattr(module, name)
        if callable(thing) and hasattr(thing, "__qualname__"):
            home = thing.__module__.partition(".")[0]  # a package may offer what a lower one defines
            assert pages[home].count(f":: {thing.__module__}.{thing.__qualname__}\n") == 1, name


def test_what_a_page_imports_stands_in_it(pages: dict[str, str]) -> None:
    assert ":: cosim.results.load_result.load_result\n" in pages["cosim"]
    assert ":: plant_models.hybrid.runtime.Runtime\n" in pages["plant_models"]
