"""The gallery: every script runs, its numbers are those on the page, and every difference has a reason."""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest
from pages import ROOT

GALLERY = ROOT / "docs" / "gallery"
SCRIPTS = sorted(GALLERY.glob("[0-9][0-9]_*.py"))


def builder() -> ModuleType:
    spec = importlib.util.spec_from_file_location("gallery_build", GALLERY / "build.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.compiler
@pytest.mark.parametrize("script", SCRIPTS, ids=lambda s: s.stem)
def test_a_script_gives_the_numbers_of_the_page(script: Path, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, str(script), "--out", str(tmp_path)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    fresh = json.loads((tmp_path / f"{script.stem}.json").read_text())
    kept = json.loads((GALLERY / "numbers" / f"{script.stem}.json").read_text())
    assert [line["quantity"] for line in fresh["lines"]] == [line["quantity"] for line in kept["lines"]]
    for now, then in zip(fresh["lines"], kept["lines"], strict=True):
        if isinstance(then["measured"], str):
            assert now["measured"] == then["measured"], now["quantity"]
        else:
            assert now["measured"] == pytest.approx(then["measured"], rel=now["repeats"], abs=1e-12), now["quantity"]
    assert "published" in done.stdout
    assert (
        fresh["figure"]
        == (tmp_path / f"{script.stem}.png").exists()
        == (ROOT / "docs" / "images" / "gallery" / f"{script.stem}.png").exists()
    )


def test_the_page_shows_the_numbers_kept() -> None:
    assert (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8") == builder().page()


def test_scripts_are_numbered_without_gaps() -> None:
    assert [script.stem[:2] for script in SCRIPTS] == [f"{i + 1:02d}" for i in range(len(SCRIPTS))]
