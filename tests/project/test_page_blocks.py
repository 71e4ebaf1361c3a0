"""What the pages tell the reader to type works: Python blocks, scenario files and commands, page by page in order."""

from __future__ import annotations

import json
import re
from pathlib import Path
from pkgutil import resolve_name

import pytest
from forked import Run
from pages import NOTEBOOKS, PAGES, ROOT, TUTORIALS, blocks, code_cells

READER = Path(__file__).with_name("page_reader.py")
WITH_CODE = [
    page
    for page in PAGES
    if page not in TUTORIALS and any(b.language in ("python", "toml", "sh") and b.command is None for b in blocks(page))
]


@pytest.mark.follows
@pytest.mark.compiler
@pytest.mark.parametrize("page", [*WITH_CODE, *NOTEBOOKS], ids=lambda p: p.name)
def test_blocks_of_a_page(page: Path, tmp_path: Path, run_forked: Run, follows: list[str]) -> None:
    follows.append(page.relative_to(ROOT).as_posix())
    done = run_forked(["python", str(READER), str(page)], folder=tmp_path)
    assert done.returncode == 0, done.output


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda p: p.name)
def test_a_notebook_holds_no_outputs_and_plain_python_alone(notebook: Path) -> None:
    """What stands in a repository is what was written, not what somebody ran; and it runs without a kernel."""
    for cell in json.loads(notebook.read_text(encoding="utf-8"))["cells"]:
        assert not cell.get("outputs")
        assert cell.get("execution_count") is None
        assert cell["metadata"] == {}
    for code in code_cells(notebook):
        compile(code, notebook.name, "exec")


def test_there_is_a_notebook_for_each_kind_of_user_and_one_to_teach() -> None:
    assert [path.stem for path in NOTEBOOKS] == ["1_vendor_fmu", "2_tester", "3_own_observer", "4_teaching"]


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
