"""Does what a page tells the reader to type, where it is started: Python blocks, scenario files, commands; or runs the
cells of a notebook and shows what each leaves, as a notebook would. No kernel is needed for that, and none is started.

python page_reader.py PAGE
"""

from __future__ import annotations

import ast
import shlex
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pages import NOTEBOOKS, Block, blocks, code_cells

import cosim.cli
import fmus.cli
import plant_models
from fmus.pack import files_of, pack_fmu
from plant_models.hybrid import HybridSystem, input_signal, output_signal, parameter, state

PROGRAMS = {"cosim": cosim.cli.main, "fmus": fmus.cli.main}


class Engine(HybridSystem):
    """Its torque falls with the speed of the shaft."""

    name = "engine"
    inputs = (input_signal("speed", "rad/s"),)
    outputs = (output_signal("torque", "N.m"),)

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"torque": 100.0 - 2.0 * u.speed}


class Load(HybridSystem):
    """A mass that turns."""

    name = "load"
    states = (state("turning", "rad/s"),)
    inputs = (input_signal("torque", "N.m"),)
    outputs = (output_signal("speed", "rad/s"),)
    parameters = (parameter("inertia", "kg.m2", 1.0, min=1e-3),)

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"turning": u.torque / p.inertia}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"speed": x.turning}


def with_sources_alone(path: str) -> None:
    """An FMU without the libraries that it was built with."""
    files = files_of(fmus.build_fmu(Load(), path, fmi_version=3))
    pack_fmu({name: content for name, content in files.items() if not name.startswith("binaries/")}, Path(path))


OF_THE_READER: dict[str, Callable[[str], Any]] = {
    "vendor.fmu": lambda path: fmus.build_fmu(plant_models.Locomotive(), path, preset="chapter_3_four_axles"),
    "engine.fmu": lambda path: fmus.build_fmu(Engine(), path, fmi_version=2),
    "with_sources.fmu": with_sources_alone,
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


def run_notebook(page: Path) -> None:
    names: dict[str, Any] = {"__name__": "notebook"}
    for number, code in enumerate(code_cells(page), start=1):
        place = f"{page.name}, cell {number}"
        tree = ast.parse(code, place)
        last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
        exec(compile(tree, place, "exec", dont_inherit=True), names)
        if isinstance(last, ast.Expr):
            show(eval(compile(ast.Expression(last.value), place, "eval", dont_inherit=True), names))


def show(value: Any) -> None:
    """What a notebook asks of the value of a cell."""
    rich = [getattr(value, method) for method in ("_repr_html_", "_repr_png_") if hasattr(value, method)]
    assert not rich or any(method() for method in rich), f"a notebook shows nothing of a {type(value).__name__}"
    if value is not None:
        print(repr(value))


def read(page: Path) -> None:
    if page in NOTEBOOKS:
        run_notebook(page)
        return
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


if __name__ == "__main__":
    read(Path(sys.argv[1]))
