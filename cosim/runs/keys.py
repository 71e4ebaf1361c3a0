"""Keys of runs: digests of content, the same wherever files lie and whenever they were written. Reads files."""

from __future__ import annotations

import hashlib
import json
import sys
from collections.abc import Callable, Iterable, Iterator
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any
from uuid import uuid4

import fmu_observer
import plant_models
from cosim.run.results_manifest import sha256
from cosim.scenario.origin import ForeignFile
from cosim.scenario.paths import map_paths
from cosim.scenario.toml_values import plain
from fmus.tables.plain_data import jsonable
from fmus.versions import versions
from plant_models.local_files import files_digest, module_digest
from plant_models.user_file import names_a_file, names_code

if TYPE_CHECKING:
    from cosim.scenario.schema import ScenarioTable

_OWN = ("plant_models", "fmu_observer", "fmus", "cosim")
_THIS_PROCESS = uuid4().hex
"""In place of the content of code that stands in no file, and so cannot be recognised in a later process."""


def digest(*texts: str) -> str:
    """Digest of texts in their order, 64 hexadecimal digits.

    Args:
        texts: whatever a row follows from.
    """
    return hashlib.sha256("\0".join(texts).encode()).hexdigest()


def table_content(table: ScenarioTable, folder: Path) -> str:
    """What a run of a scenario follows from, as one text: its tables, seed among them, with the content of each file in
    place of its path, that of modules of the user's, and the versions of Python and the packages.

    Args:
        table: of the scenario, with all settings in it. folder: start of its relative paths.
    """
    tables = plain(table.model_dump(by_alias=True, exclude_unset=True))
    moved = map_paths(tables, lambda path: _file_content((folder / path).resolve()))
    modules = [module_digest(name) for name in sorted(set(_modules(table)))]
    return f"{json.dumps([jsonable(moved), modules], sort_keys=True)} {version_text()}"


def _modules(table: ScenarioTable) -> Iterator[str]:
    """Modules that the models of a scenario come from and that are not of this package: those in files have a path."""
    for component in table.components.values():
        named = [(component.model, plant_models.PLANTS), (component.observer, fmu_observer.OBSERVERS)]
        for name, registry in named:
            yield from _module(name, registry.targets(name)) if name else ()
        for text in component.options.values():
            yield from _module(text, ()) if isinstance(text, str) else ()


def _module(name: str, targets: Iterable[str]) -> Iterator[str]:
    """Of the name of a model, and of what it stands for in a registry."""
    code = [name] if names_code(name) and not names_a_file(name) else []
    yield from (m for m in (t.partition(":")[0] for t in (*code, *targets)) if m.partition(".")[0] not in _OWN)


def _file_content(path: Path) -> str:
    """Digest of a file, and of those that belong to it: the files of the user's that a Python file imports, the tables
    of results.

    Args:
        path: of the file, or of a results folder; of one that does not exist the path itself stands for it.
    """
    try:
        if path.suffix == ".py" and path.is_file():
            return digest(path.name, files_digest(path))
        parts = ForeignFile("", path).parts
        return digest(*(text for part in parts for text in (part.name, sha256(part))))
    except OSError:
        return str(path)


def code_content(*functions: Callable[..., Any]) -> str:
    """Digest of functions of the user's: the files that they stand in, and the values that they are bound to.

    Args:
        functions: or objects that are called. Of those of this package the name counts; versions stand for the rest.
    """
    return digest(*(text for function in functions for text in _code(function)))


def _code(function: Any) -> Iterator[str]:
    if isinstance(function, partial):
        yield from _code(function.func)
        yield repr((function.args, function.keywords))
        return
    named = function if hasattr(function, "__qualname__") else type(function)
    cells = getattr(function, "__closure__", None) or ()
    bound = [getattr(function, name, None) for name in ("__self__", "__defaults__", "__kwdefaults__")]
    yield f"{named.__module__}.{named.__qualname__} {[cell.cell_contents for cell in cells]} {bound}"
    if named is not function:
        yield repr(function)
    if named.__module__.partition(".")[0] not in _OWN:
        path = getattr(sys.modules.get(named.__module__), "__file__", None)
        yield _THIS_PROCESS if path is None else _file_content(Path(path).resolve())


@cache
def version_text() -> str:
    """Versions of Python and of the packages that can change a number; the platform is not one of them."""
    return json.dumps({name: number for name, number in versions().items() if name != "platform"}, sort_keys=True)
