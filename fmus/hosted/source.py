"""The source of a hosted model: which class it is, and which of the user's files go into the FMU. Reads files, writes
none.

An installed package is imported by name in the importing process; a loose file is copied into ``resources/model/``.
"""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from importlib.metadata import packages_distributions
from pathlib import Path
from typing import Any

from plant_models.hybrid import HybridSystem

OWN_PACKAGES = ("plant_models", "fmu_observer", "fmus")
"""Always there: hosted FMUs need the package fmu-observer."""


class HostedExportError(ValueError):
    """The model cannot be exported with Python inside: what is wrong, and what to do."""


@dataclass(frozen=True)
class Source:
    """Where a model comes from.

    Args:
        module: name to import it by; of no meaning for a loose file.
        name: its class or function. file: name of the loose file, None for an installed package.
        options: arguments of the class, numbers and text.
        files: content to go into ``resources/model/``, by name.
    """

    module: str
    name: str
    file: str | None
    options: Mapping[str, Any] = field(default_factory=dict)
    files: Mapping[str, bytes] = field(default_factory=dict)


Model = str | HybridSystem | Callable[..., Any]


def find_source(model: Model, options: Mapping[str, Any] | None, extra_files: Iterable[Path | str] = ()) -> Source:
    """The source of a model.

    Args:
        model: ``path/to/file.py:Class``, ``package.module:Class``, a class, a function that makes a system or a block,
            or a hybrid system (its class and options are taken).
        options: arguments of the class or function; None for those that the hybrid system has.
        extra_files: files and folders that the loose file imports or reads.

    Raises:
        HostedExportError: there is no such file, or the class cannot be found again in another process.
    """
    extra = _extra_files(extra_files)
    if isinstance(model, str):
        return _named(model, dict(options or {}), extra)
    if isinstance(model, HybridSystem):
        return _of_class(type(model), dict(model.options if options is None else options), extra)
    return _of_class(model, dict(options or {}), extra)


def _named(text: str, options: dict[str, Any], extra: dict[str, bytes]) -> Source:
    place, colon, name = text.rpartition(":")
    if not colon or not name.isidentifier():
        raise HostedExportError(f"{text!r} names no class; write path/to/file.py:Class or package.module:Class.")
    if not place.endswith(".py"):
        if extra:
            raise HostedExportError(
                f"{text!r} is imported where the FMU runs, so extra_files have no place; name a file.py."
            )
        return Source(place, name, None, options)
    return _loose(Path(place), name, options, extra)


def _of_class(model: Callable[..., Any], options: dict[str, Any], extra: dict[str, bytes]) -> Source:
    name, module = getattr(model, "__qualname__", ""), sys.modules.get(getattr(model, "__module__", ""))
    if module is None or getattr(module, name, None) is not model:
        raise HostedExportError(
            f"{name or model!r} cannot be found again in another process; define it at the top level of a file."
        )
    if module.__name__ != "__main__" and _is_installed(module.__name__.partition(".")[0]):
        return Source(module.__name__, name, None, options)
    file = inspect.getsourcefile(model)
    if file is None or not Path(file).is_file():
        raise HostedExportError(f"{name} has no source file; write it into one.")
    if "." in module.__name__ and module.__name__ != "__main__":
        raise HostedExportError(
            f"{name} is in the package {module.__name__!r}, which is not installed; install it, or use one file."
        )
    return _loose(Path(file), name, options, extra)


def _is_installed(package: str) -> bool:
    return package in OWN_PACKAGES or package in sys.stdlib_module_names or package in packages_distributions()


def _loose(path: Path, name: str, options: dict[str, Any], extra: dict[str, bytes]) -> Source:
    if not path.is_file():
        raise HostedExportError(f"{path} does not exist; write path/to/file.py:Class.")
    return Source(path.stem, name, path.name, options, {**extra, path.name: path.read_bytes()})


def _extra_files(paths: Iterable[Path | str]) -> dict[str, bytes]:
    content: dict[str, bytes] = {}
    for path in map(Path, paths):
        if not path.exists():
            raise HostedExportError(f"extra file {path} does not exist.")
        files = [path] if path.is_file() else sorted(p for p in path.rglob("*") if p.is_file() and p.suffix != ".pyc")
        content |= {p.relative_to(path.parent).as_posix(): p.read_bytes() for p in files}
    return content
