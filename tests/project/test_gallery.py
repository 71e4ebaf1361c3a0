"""The gallery: every script runs, its numbers are those on the page, and every difference has a reason."""

from __future__ import annotations

import importlib.util
import json
import sys
from pathlib import Path
from types import ModuleType

import pytest
from forked import Run
from pages import ROOT

GALLERY = ROOT / "docs" / "gallery"
FOLDERS = sorted(head.parent for head in GALLERY.glob("*/head.md"))
SCRIPTS = sorted(GALLERY.glob("*/[0-9][0-9]_*.py"))


def builder() -> ModuleType:
    return module_of("build")


def lines_module() -> ModuleType:
    return module_of("line")


def module_of(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(f"gallery_{name}", GALLERY / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = sys.modules[spec.name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.follows
@pytest.mark.compiler
@pytest.mark.parametrize("script", SCRIPTS, ids=lambda s: f"{s.parent.name}/{s.stem}")
def test_a_script_gives_the_numbers_of_the_page(
    script: Path, tmp_path: Path, run_forked: Run, follows: list[str]
) -> None:
    numbers = script.parent / "numbers" / f"{script.stem}.json"
    follows += [path.relative_to(ROOT).as_posix() for path in (script, numbers)]
    done = run_forked(["python", str(script), "--out", str(tmp_path)])
    assert done.returncode == 0, done.output
    fresh = json.loads((tmp_path / f"{script.stem}.json").read_text())
    kept = json.loads(numbers.read_text())
    assert [line["quantity"] for line in fresh["lines"]] == [line["quantity"] for line in kept["lines"]]
    for now, then in zip(fresh["lines"], kept["lines"], strict=True):
        if isinstance(then["measured"], str):
            assert now["measured"] == then["measured"], now["quantity"]
        else:
            assert now["measured"] == pytest.approx(then["measured"], rel=now["repeats"], abs=1e-12), now["quantity"]
    assert "published" in done.output
    assert (
        fresh["figure"]
        == (tmp_path / f"{script.stem}.png").exists()
        == (ROOT / "docs" / "images" / "gallery" / script.parent.name / f"{script.stem}.png").exists()
    )


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.name)
def test_the_page_shows_the_numbers_kept(folder: Path) -> None:
    page = ROOT / "docs" / "theses" / f"gallery_{folder.name}.md"
    assert page.read_text(encoding="utf-8") == builder().page(folder)


def test_every_script_stands_in_a_folder_with_a_page_under_a_number_of_its_own() -> None:
    assert {script.parent for script in SCRIPTS} <= set(FOLDERS)
    numbers = [(script.parent, script.stem[:2]) for script in SCRIPTS]
    assert len(set(numbers)) == len(numbers)
    assert not list(GALLERY.glob("[0-9][0-9]_*.py"))


def test_numbers_and_figures_of_scripts_that_are_gone_are_gone() -> None:
    scripts = {(script.parent.name, script.stem) for script in SCRIPTS}
    kept = [*GALLERY.glob("*/numbers/*"), *(ROOT / "docs" / "images" / "gallery").glob("*/*")]
    assert {(_folder(path), path.stem) for path in kept} <= scripts


def _folder(path: Path) -> str:
    return path.parents[1].name if path.parent.name == "numbers" else path.parent.name


def test_a_number_that_agrees_with_neither_needs_a_reason() -> None:
    line = lines_module().Line
    assert not line("a", "m", 1.0, 1.005).differs()
    assert not line("a", "m", None, 1.005, independent=1.0).differs()
    assert line("a", "m", 1.0, 1.005, independent=1.1).differs()
    assert line("a", "m", None, 1.0).differs()
    assert line("a", "m", None, "reached", independent="missed").differs()


def test_the_column_of_independent_numbers_stands_where_it_is_used() -> None:
    module = lines_module()
    lines = [module.Line("a", "m", None, 1.0, independent=1.0).content(), module.Line("b", "m", 2.0, 2.0).content()]
    assert module.table(lines) == [
        ("quantity", "unit", "published", "independent", "measured"),
        ("a", "m", "–", "1", "1"),
        ("b", "m", "2", "–", "2"),
    ]
    assert module.table(lines[1:])[0] == ("quantity", "unit", "published", "measured")
