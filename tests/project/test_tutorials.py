"""The tutorials do what they say, from the first line to the last, as a newcomer would type it: every command is a real
one.
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest
import tiers
from forked import Done, Run
from pages import TUTORIALS, Block, blocks

import fmus

FILE = re.compile(r"# (?P<name>[\w.-]+\.(?:py|toml|csv))\n")
"""The first line of a block that is a file."""
FORKED = ("cosim", "fmus", "python")


def exits(page: Path, block: Block) -> int:
    """The exit code a page promises in ``<!-- exits: 1 -->`` above a block; 0 where it promises none."""
    above = page.read_text(encoding="utf-8").splitlines()[: block.line - 2]
    found = re.fullmatch(r"<!-- exits: (\d) -->", above[-1]) if above else None
    return int(found[1]) if found else 0


def environment(folder: Path) -> dict[str, str]:
    """That of a reader who has activated the virtual environment; pytest in pytest must not know of the outer one."""
    inherited = {k: v for k, v in os.environ.items() if not k.startswith(("PYTEST_", "COV_")) and k != "CI"}
    path = os.pathsep.join(
        (sysconfig.get_path("scripts"), str(Path(sys.executable).parent), os.environ.get("PATH", ""))
    )
    # builds are kept as a reader's are
    own = {"PATH": path, "HOME": str(folder), "FMU_OBSERVER_CACHE": str(fmus.cache_folder())}
    return inherited | own | {"MPLBACKEND": "Agg", "PYTHONDONTWRITEBYTECODE": "1"}


def is_forked(line: str) -> bool:
    """Whether a line is run without a shell."""
    return shlex.split(line)[0] in FORKED and not set("|&;<>$*`") & set(line)


def run_line(line: str, folder: Path, run_forked: Run) -> Done:
    """Run a line of a shell. Programs of the package and Python are forked from a process that has imported it."""
    if is_forked(line):
        return run_forked(shlex.split(line), folder=folder, environment=environment(folder))
    done = subprocess.run(
        ["bash", "-euo", "pipefail", "-c", line],
        cwd=folder,
        env=environment(folder),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    return Done(done.returncode, done.stdout, 0.0, ())


def follow(page: Path, folder: Path, run_forked: Run) -> None:
    """Do everything the page says."""
    for block in blocks(page):
        named = FILE.match(block.code)
        place = f"{page.name}, line {block.line}"
        if named is not None:
            (folder / named["name"]).write_text(block.code[named.end() :], encoding="utf-8")
        elif block.language == "python":
            done = run_forked(["python", "-c", block.code], folder=folder, environment=environment(folder))
            assert done.returncode == 0, f"{place}:\n{done.output}"
        elif block.language == "sh":
            for line in block.code.splitlines():
                done = run_line(line, folder, run_forked)
                assert done.returncode == exits(page, block), f"{place}: {line}\n{done.output}"


@pytest.mark.follows
@pytest.mark.compiler
@pytest.mark.parametrize("page", TUTORIALS, ids=lambda p: p.stem)
def test_a_tutorial_from_start_to_end(page: Path, tmp_path: Path, run_forked: Run, follows: list[str]) -> None:
    lines = [line for block in blocks(page) if block.language == "sh" for line in block.code.splitlines()]
    follows += [page.relative_to(tiers.ROOT).as_posix(), *([] if all(map(is_forked, lines)) else tiers.product())]
    folder = tmp_path / "reader"
    folder.mkdir()
    follow(page, folder, run_forked)


def test_there_are_tutorials() -> None:
    assert len(TUTORIALS) >= 5


@pytest.mark.parametrize("command", ["false", "cosim run no_such_scenario", "no_such_program"])
def test_a_command_that_fails_is_noticed(command: str, tmp_path: Path, run_forked: Run) -> None:
    page = tmp_path / "page.md"
    page.write_text(f"text\n\n```sh\n{command}\n```\n", encoding="utf-8")
    with pytest.raises(AssertionError, match=r"page.md, line 4"):
        follow(page, tmp_path, run_forked)


def test_a_promised_exit_code_is_demanded(tmp_path: Path, run_forked: Run) -> None:
    page = tmp_path / "page.md"
    page.write_text("text\n\n<!-- exits: 1 -->\n```sh\nfalse\n```\n", encoding="utf-8")
    follow(page, tmp_path, run_forked)
    page.write_text("text\n\n<!-- exits: 1 -->\n```sh\ntrue\n```\n", encoding="utf-8")
    with pytest.raises(AssertionError):
        follow(page, tmp_path, run_forked)
