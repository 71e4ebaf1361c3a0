"""The README keeps its word: its two commands, its length, its list of dependencies, its links."""

from __future__ import annotations

import ast
import re
import shlex
import subprocess
import tomllib
from functools import cache
from pathlib import Path

import pytest
from pages import PACKAGES, PAGES, README, ROOT, blocks

from cosim import shipped_scenarios

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
LIKE_AN_IMPORT = re.compile(r"^\s*(?:from|import) (\w+)", re.MULTILINE)  # or like a sentence
IMPORTED_BY_NAME = re.compile(r"(?:optional_package|LazyPackage)\(\s*\"(\w+)")  # what an installation may be without
PACKAGE_NAME = re.compile(r"^[A-Za-z0-9-]+")


def command(name: str) -> str:
    (line,) = [b.code for b in blocks(README) if b.command == name]
    return line.removesuffix("\n")


def requirements(entries: list[str]) -> list[str]:
    return [PACKAGE_NAME.match(entry)[0] for entry in entries]  # type: ignore[index]


@pytest.mark.parametrize(("name", "program"), [("run", ".venv/bin/cosim"), ("test", ".venv/bin/python -m pytest")])
def test_a_command_is_one_line_that_installs_and_does_its_work(name: str, program: str) -> None:
    line = command(name)
    assert "\n" not in line
    environment, install, work = line.split(" && ")
    assert environment == "python3 -m venv .venv"
    assert install.startswith(".venv/bin/pip install")
    assert work.startswith(program)


def test_the_run_command_names_a_shipped_scenario_and_what_is_installed() -> None:
    words = shlex.split(command("run").split(" && ")[-1])
    assert words[2] in shipped_scenarios()
    assert Path(words[0]).name in PROJECT["project"]["scripts"]


def test_the_test_command_installs_an_extra_that_exists() -> None:
    extras = re.search(r"\.\[(.*?)\]", command("test"))
    assert extras is not None
    assert set(extras[1].split(",")) <= set(PROJECT["project"]["optional-dependencies"])


@pytest.mark.parametrize("name", ["run", "test"])
def test_the_ci_script_takes_the_commands_from_the_readme(name: str) -> None:
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    function = script[script.index("readme_command()") :].partition("\n}\n")[0] + "\n}\n"
    code = f"set -euo pipefail; VENV=.ci/venv; {function} readme_command {name}"
    done = subprocess.run(["bash", "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == command(name).replace(".venv", ".ci/venv")
    assert f"run_readme {name}" in script


def words(*pages: Path) -> int:
    return sum(len(page.read_text(encoding="utf-8").split()) for page in pages)


def test_readme_and_guide_stay_short() -> None:
    assert words(README) <= 900
    assert words(*(page for page in PAGES if page.parent.name == "guide")) <= 25_000


# -- dependencies ---------------------------------------------------------------------------------------------------


@cache
def imported_packages() -> frozenset[str]:
    """Top-level names that the four packages import anywhere."""
    names: set[str] = set()
    for path in (p for package in PACKAGES for p in (ROOT / package).rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        names.update(IMPORTED_BY_NAME.findall(text))
        if names.issuperset(LIKE_AN_IMPORT.findall(text)):
            continue
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.Import):
                names |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
                names.add(node.module.partition(".")[0])
    return frozenset(names)


@pytest.mark.parametrize("dependency", requirements(PROJECT["project"]["dependencies"]))
def test_a_dependency_has_a_line_that_is_true(dependency: str) -> None:
    (line,) = [row for row in README.read_text(encoding="utf-8").splitlines() if row.startswith(f"| `{dependency}` |")]
    assert ("not imported yet" in line) == (dependency.replace("-", "_") not in imported_packages())


def test_nothing_is_imported_that_is_not_a_dependency() -> None:
    import sys

    extras = PROJECT["project"]["optional-dependencies"]
    optional = [
        name
        for extra in ("hosted", "lmi", "frames", "parquet", "hdf5", "tuning", "cluster")
        for name in requirements(extras[extra])
    ]
    required = [name.replace("-", "_") for name in requirements(PROJECT["project"]["dependencies"])]
    known = {*required, *optional, *PACKAGES, *sys.stdlib_module_names, "pytest"}  # who loads the plugin has pytest
    assert imported_packages() - known == set()


@pytest.mark.parametrize("extra", ["test", "second-tier", "checks", "docs"])
def test_the_extras_are_named(extra: str) -> None:
    text = README.read_text(encoding="utf-8")
    names = {*requirements(PROJECT["project"]["optional-dependencies"][extra])} - {PROJECT["project"]["name"]}
    assert sorted(name for name in names if f"`{name}`" not in text) == []


# -- links ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_links_and_pictures_exist(page: Path) -> None:
    prose = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    targets = [t for t in re.findall(r"\]\(([^)#]+?)(?:#[^)]*)?\)", prose) if not t.startswith("https://")]
    written = f"{shlex.split(command('run'))[-1]}/report.html"  # by the run of the README
    there = {t for t in targets if (page.parent / t).exists() or (page.parent / f"{t}.md").exists() or t == written}
    assert sorted(set(targets) - there) == []


def test_the_index_links_every_page() -> None:
    index = ROOT / "docs" / "index.md"
    linked = {index.parent / target for target in re.findall(r"\]\(([^)#]+\.md)\)", index.read_text(encoding="utf-8"))}
    sheets = {page for page in PAGES if page.name.startswith("gallery_")}  # linked by the index of the theses
    assert sorted(set(PAGES) - sheets - linked - {README, index}) == []
