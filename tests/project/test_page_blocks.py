"""What the pages tell the reader to type works: Python blocks, scenario files and commands, page by page in order."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

import pytest
from pages import PAGES, TUTORIALS, Block, blocks

import cosim.cli
import fmus.cli
import plant_models
from plant_models.hybrid import HybridSystem, input_signal, output_signal, parameter, state

PROGRAMS = {"cosim": cosim.cli.main, "fmus": fmus.cli.main}
WITH_CODE = [
    page
    for page in PAGES
    if page not in TUTORIALS and any(b.language in ("python", "toml", "sh") and b.command is None for b in blocks(page))
]


class Engine(HybridSystem):
    """Its torque falls with the speed of the shaft."""

    name = "engine"
    description = "An engine"
    source = "tests"
    inputs = (input_signal("speed", "rad/s"),)
    outputs = (output_signal("torque", "N.m"),)

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"torque": 100.0 - 2.0 * u.speed}


class Load(HybridSystem):
    """A mass that turns."""

    name = "load"
    description = "A load"
    source = "tests"
    states = (state("turning", "rad/s"),)
    inputs = (input_signal("torque", "N.m"),)
    outputs = (output_signal("speed", "rad/s"),)
    parameters = (parameter("inertia", "kg.m2", 1.0, min=1e-3),)

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"turning": u.torque / p.inertia}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"speed": x.turning}


OF_THE_READER: dict[str, Callable[[str], Any]] = {
    "vendor.fmu": lambda path: fmus.build_fmu(plant_models.Locomotive(), path, preset="chapter_3_four_axles"),
    "engine.fmu": lambda path: fmus.build_fmu(Engine(), path, fmi_version=2),
    "load.fmu": lambda path: fmus.build_fmu(Load(), path, fmi_version=3),
}
"""FMUs that the pages take for granted, built where a page names them and does not build them itself."""


def run_commands(page: Path, block: Block) -> None:
    for number, line in enumerate(block.code.splitlines()):
        program, *arguments = shlex.split(line)
        assert PROGRAMS[program](arguments) == 0, f"{page.name}, line {block.line + number}: {line}"


def run_python(page: Path, block: Block, names: dict[str, Any]) -> None:
    code = "\n" * (block.line - 1) + block.code  # line numbers of a failure are those of the page
    exec(compile(code, str(page), "exec", dont_inherit=True), names)  # a page has no __future__ imports of ours


@pytest.mark.compiler
@pytest.mark.parametrize("page", WITH_CODE, ids=lambda p: p.name)
def test_blocks_of_a_page(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    text = page.read_text(encoding="utf-8")
    for name, build in OF_THE_READER.items():
        if name in text and f"fmus build locomotive -o {name}" not in text:
            build(name)
    names: dict[str, Any] = {"__name__": "page"}
    for block in blocks(page):
        if block.command is not None:
            continue  # installs; the CI script runs these
        if block.language == "python":
            run_python(page, block, names)
        elif block.language == "toml":
            first, _, rest = block.code.partition("\n")
            Path(first.removeprefix("# ")).write_text(rest, encoding="utf-8")
        elif block.language == "sh":
            run_commands(page, block)


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
