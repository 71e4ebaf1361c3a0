"""The files beside a user's file that it imports, directly or through one another. Reads files, runs none."""

from __future__ import annotations

import ast
import sys
from functools import lru_cache
from hashlib import sha256
from pathlib import Path

INSTALLED = frozenset({"plant_models", "fmu_observer", "fmus", "cosim"}) | sys.stdlib_module_names


def local_files(path: Path) -> dict[str, Path]:
    """The files that a user's file rests on.

    Args:
        path: of the file, which exists.

    Returns:
        Files in its folder by the names of their modules; of a package all its files. Without the file itself; none
        where it is installed.
    """
    if {"site-packages", "dist-packages"} & set(path.parts):
        return {}
    found: dict[str, Path] = {}
    seen, pending = set(INSTALLED), [path]
    while pending:
        for name in _imported(_content(pending.pop())) - seen:
            seen.add(name)
            module, package = path.with_name(f"{name}.py"), path.with_name(name)
            files = [module] if module.is_file() else sorted(package.rglob("*.py"))
            pending += files
            found |= {_module_name(file, path.parent): file for file in files if file != path}
    return found


def files_digest(path: Path) -> str:
    """Digest of a user's file and of the files that it rests on.

    Args:
        path: of the file.

    Returns:
        64 hexadecimal digits.
    """
    digests = [sha256(_content(file)).hexdigest() for file in (path, *local_files(path).values())]
    return sha256("\n".join(digests).encode()).hexdigest()


def _module_name(file: Path, folder: Path) -> str:
    return ".".join(file.relative_to(folder).with_suffix("").parts).removesuffix(".__init__")


def _content(file: Path) -> bytes:
    try:
        return file.read_bytes()
    except OSError:  # reported by whoever runs it
        return b""


@lru_cache(maxsize=256)
def _imported(content: bytes) -> frozenset[str]:
    """First parts of the names that a file imports, within functions too."""
    try:
        nodes = list(ast.walk(ast.parse(content)))
    except (SyntaxError, ValueError):  # reported by whoever runs it
        return frozenset()
    names = [alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names]
    names += [node.module for node in nodes if isinstance(node, ast.ImportFrom) and node.module and not node.level]
    return frozenset(name.partition(".")[0] for name in names)
