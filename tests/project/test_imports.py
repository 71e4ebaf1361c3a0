"""Imports: no circle of files, few imports hidden in functions. The order of rooms is kept by import-linter."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest
from pages import PACKAGES, ROOT

HIDDEN_AT_MOST = 40
"""In functions stands only what is large and seldom used: an optional package, the drawing of a page."""

HOLDERS = (ast.stmt, ast.excepthandler, ast.match_case)
FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)


class Import(NamedTuple):
    """One import statement: full names, and whether it stands in a function."""

    names: tuple[str, ...]
    hidden: bool
    line: int


def module_name(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imports(node: ast.AST, hidden: bool = False) -> Iterator[Import]:
    """All imports, those for type checkers too; an expression holds none."""
    for child in ast.iter_child_nodes(node):
        if not isinstance(child, HOLDERS):
            continue
        if isinstance(child, ast.Import):
            yield Import(tuple(alias.name for alias in child.names), hidden, child.lineno)
        elif isinstance(child, ast.ImportFrom):
            assert child.level == 0, "imports here are absolute"
            yield Import(tuple(f"{child.module}.{alias.name}" for alias in child.names), hidden, child.lineno)
        yield from imports(child, hidden or isinstance(child, FUNCTIONS))


@cache
def files() -> dict[str, list[Import]]:
    """The imports of every file of the package, by module."""
    paths = [path for package in PACKAGES for path in (ROOT / package).rglob("*.py")]
    return {module_name(path): list(imports(ast.parse(path.read_text(encoding="utf-8")))) for path in paths}


def graph() -> dict[str, set[str]]:
    """Which files each file imports, hidden imports counted."""
    known = files()

    def home(name: str) -> str:
        while name and name not in known:
            name = name.rpartition(".")[0]
        return name

    return {
        module: {home(name) for one in found for name in one.names} - {"", module} for module, found in known.items()
    }


def peeled(uses: dict[str, set[str]]) -> dict[str, set[str]]:
    """What is left when files that import none of the rest are taken away again and again: circles, and their users."""
    left = dict(uses)
    while free := [module for module, used in left.items() if not used & left.keys()]:
        for module in free:
            del left[module]
    return left


@pytest.mark.guard
def test_no_files_import_one_another_in_a_circle() -> None:
    left = peeled(graph())
    users = {module: {m for m, used in left.items() if module in used} for module in left}
    circles = peeled({module: used & left.keys() for module, used in users.items()})  # without those who only use them
    assert circles == {}


@pytest.mark.guard
def test_few_imports_hide_in_functions() -> None:
    hidden = [
        f"{module}:{one.line}: {', '.join(one.names)}"
        for module, found in files().items()
        for one in found
        if one.hidden
    ]
    assert len(hidden) <= HIDDEN_AT_MOST, "\n".join(hidden)


def test_a_circle_would_be_found() -> None:
    assert peeled({"a": {"b"}, "b": {"c"}, "c": {"b"}, "d": set()}).keys() == {"a", "b", "c"}
