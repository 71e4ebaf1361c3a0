"""The files of the project: no path of somebody's machine, nothing forgotten in the package."""

from __future__ import annotations

import os
import re
import tomllib
from collections.abc import Iterator
from fnmatch import fnmatch
from pathlib import Path

import pytest
from pages import PACKAGES, ROOT

TEXT = {".py", ".md", ".toml", ".c", ".h", ".csv", ".json", ".txt", ""}
PLACES = (*PACKAGES, "tests", "docs", ".ci")
SKIPPED = {".git", "__pycache__", "_build", "api", "venv", "venv-newest"}
MACHINE_PATH = re.compile(
    r"(?<![\w.)}\]*~$/])/(?:home|Users|root|work|tmp|opt|mnt|media|srv|usr/local)/\w|\b[A-Z]:\\\w"
)


def files() -> Iterator[Path]:
    """All files of the project, caches and built things left out."""
    yield from (p for p in ROOT.iterdir() if p.is_file() and p.name not in SKIPPED)
    for place in PLACES:
        for folder, names, here in os.walk(ROOT / place):
            names[:] = [n for n in names if n not in SKIPPED and not n.endswith(".egg-info")]
            yield from (Path(folder) / n for n in here)


@pytest.mark.guard
def test_no_file_names_a_path_of_a_machine() -> None:
    found = [
        f"{path.relative_to(ROOT)}:{number}: {line.strip()}"
        for path in files()
        if path.suffix in TEXT
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1)
        if MACHINE_PATH.search(line)
    ]
    assert found == []


def test_a_machine_path_would_be_found() -> None:
    slash = "/"
    assert MACHINE_PATH.search(f"open('{slash}home{slash}somebody{slash}file')")
    assert MACHINE_PATH.search("C" + ":\\Users")
    assert not MACHINE_PATH.search("see docs/home/page and https://example.org/opt/x")


def test_every_file_of_a_package_is_packed() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    patterns = project["tool"]["setuptools"]["package-data"]
    forgotten = [
        str(path.relative_to(ROOT))
        for path in files()
        for package in PACKAGES
        if path.is_relative_to(ROOT / package) and path.suffix not in {".py", ".pyc"}
        if not any(fnmatch(str(path.relative_to(ROOT / package)), pattern) for pattern in patterns[package])
    ]
    assert forgotten == []


def test_nothing_of_the_project_is_ignored() -> None:
    lines = (ROOT / ".gitignore").read_text(encoding="utf-8").splitlines()
    patterns = [line.rstrip("/") for line in lines if line and not line.startswith("#")]
    ignored = [
        f"{path.relative_to(ROOT)} by {pattern}"
        for path in files()
        for pattern in patterns
        if matches(path.relative_to(ROOT), pattern)
        if path.parent != ROOT and path.suffix != ".pyc"
    ]
    assert ignored == []


def matches(path: Path, pattern: str) -> bool:
    """Whether a pattern of .gitignore covers a path: anchored with a leading slash, else any part of the path."""
    if pattern.startswith("/"):
        return path.is_relative_to(pattern[1:])
    return any(fnmatch(part, pattern) for part in path.parts)


def test_an_ignored_package_would_be_found() -> None:
    assert matches(Path("cosim/results/result.py"), "results")
    assert not matches(Path("cosim/results/result.py"), "/results")


def test_every_package_folder_is_a_package() -> None:
    folders = {p.parent for package in PACKAGES for p in (ROOT / package).rglob("*.py")}
    assert [str(f.relative_to(ROOT)) for f in folders if not (f / "__init__.py").is_file()] == []


def test_license_and_type_markers_are_there() -> None:
    assert "Copyright (c) 2026, The fmu-observer authors" in (ROOT / "LICENSE").read_text(encoding="utf-8")
    assert all((ROOT / package / "py.typed").is_file() for package in PACKAGES)


def test_the_ci_script_is_executable() -> None:
    assert os.access(ROOT / ".ci" / "run", os.X_OK)
