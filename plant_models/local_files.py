"""The files of the user's that a file or a module rests on: what it imports, directly or through one another. Reads
files, runs none.
"""

from __future__ import annotations

import ast
import sys
from functools import lru_cache
from hashlib import sha256
from importlib.machinery import PathFinder
from importlib.util import find_spec
from pathlib import Path

INSTALLED = frozenset({"plant_models", "fmu_observer", "fmus", "cosim"}) | sys.stdlib_module_names


def local_files(path: Path) -> dict[str, Path]:
    """The files beside a user's file that it rests on, and so can be moved with it.

    Args:
        path: of the file, which exists.

    Returns:
        Files in its folder by the names of their modules; of a package all its files. Without the file itself; none
        where it is installed.
    """
    folder = path.parent
    return {_module_name(file, folder): file for file in _rests_on(path)[1:] if file.is_relative_to(folder)}


def files_digest(path: Path) -> str:
    """Digest of a user's file and of the files of the user's that it rests on, wherever they are.

    Args:
        path: of the file.

    Returns:
        64 hexadecimal digits.
    """
    return _digest(_rests_on(path))


def module_digest(name: str) -> str:
    """Digest of a module, of the packages that it is in, and of the files of the user's that they rest on.

    Args:
        name: of the module, ``package.module``.

    Returns:
        64 hexadecimal digits; of a module that is not found in a file, those of nothing.
    """
    return _digest(list(dict.fromkeys(part for file in _module_files(name) for part in _rests_on(file))))


def _digest(files: list[Path]) -> str:
    return sha256("\n".join(sorted(sha256(_content(file)).hexdigest() for file in files)).encode()).hexdigest()


def _rests_on(path: Path) -> list[Path]:
    """The file, and those that it imports and that are not installed."""
    found: dict[Path, None] = {}
    pending = [path]
    while pending:
        file = pending.pop(0)
        if file in found:
            continue
        found[file] = None
        for level, name in () if _is_installed(file) else sorted(_imported(_content(file))):
            if level:
                pending += _beside(name, file.parents[min(level, len(file.parents)) - 1])
            elif name not in INSTALLED:
                pending += _beside(name, path.parent) or _elsewhere(name)
    return list(found)


def _beside(name: str, folder: Path) -> list[Path]:
    """The file of a module in a folder, or all files of a package."""
    module = folder / f"{name}.py"
    return [module] if module.is_file() else sorted((folder / name).rglob("*.py"))


def _elsewhere(name: str) -> list[Path]:
    """The files of the user's that a name at the top stands for where modules are looked for, found without importing
    it.
    """
    try:
        spec = find_spec(name)
    except (ImportError, ValueError):  # reported by whoever runs it
        return []
    if spec is None:
        return []
    folders = spec.submodule_search_locations or ()
    files = [file for folder in folders for file in sorted(Path(folder).rglob("*.py"))] or [Path(spec.origin or "")]
    return [file for file in files if file.is_file() and not _is_installed(file)]


def _module_files(name: str) -> list[Path]:
    """The files of a module and of the packages that it is in, the outermost first, found without importing them."""
    top, *parts = name.split(".")
    try:
        spec, found = find_spec(top), []
        for part in [*parts, ""]:
            if spec is None:
                break
            if spec.origin is not None and Path(spec.origin).is_file():
                found.append(Path(spec.origin))
            top = f"{top}.{part}"
            spec = PathFinder.find_spec(top, list(spec.submodule_search_locations or ())) if part else None
    except (ImportError, ValueError):  # reported by whoever runs it
        return []
    return found


def _is_installed(path: Path) -> bool:
    return bool({"site-packages", "dist-packages"} & set(path.parts))


def _module_name(file: Path, folder: Path) -> str:
    return ".".join(file.relative_to(folder).with_suffix("").parts).removesuffix(".__init__")


def _content(file: Path) -> bytes:
    try:
        return file.read_bytes()
    except OSError:  # reported by whoever runs it
        return b""


@lru_cache(maxsize=4096)
def _imported(content: bytes) -> frozenset[tuple[int, str]]:
    """First parts of the names that a file imports, within functions too, and how many folders up from its own they are
    looked for; none of them (0) for names at the top.
    """
    try:
        nodes = list(ast.walk(ast.parse(content)))
    except (SyntaxError, ValueError):  # reported by whoever runs it
        return frozenset()
    names = [(0, alias.name) for node in nodes if isinstance(node, ast.Import) for alias in node.names]
    for node in nodes:
        if isinstance(node, ast.ImportFrom):
            names += [(node.level, node.module)] if node.module else [(node.level, a.name) for a in node.names]
    return frozenset((level, name.partition(".")[0]) for level, name in names)
