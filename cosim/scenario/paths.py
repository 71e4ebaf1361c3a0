"""Paths in the tables of a scenario: which keys hold one, and how all of them move to another folder. Touches no
files.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from copy import deepcopy
from pathlib import Path
from typing import Any

from plant_models.user_file import names_a_file, option_files, split_name

COMPONENT_PATHS = ("fmu", "recording")
MODEL_KEYS = ("model", "observer")
"""Keys that hold the name of a model, perhaps ``file.py:Class``."""
BALISE_PATHS = ("file",)
NETWORK_PATHS = ("delay_file",)


def map_paths(tables: Mapping[str, Any], move: Callable[[str], str]) -> dict[str, Any]:
    """A copy of the tables in which every path has been replaced.

    Args:
        tables: the keys of a scenario, checked or not: what is not as it should be is left as it is.
        move: from a path as it is written to the one to write.
    """
    moved: dict[str, Any] = deepcopy(dict(tables))
    components = moved.get("components")
    for table in components.values() if isinstance(components, dict) else ():
        _map_keys(table, COMPONENT_PATHS, move)
        _map_keys(table, MODEL_KEYS, lambda name: move_file(name, move))
        if isinstance(table, dict) and isinstance(table.get("options"), dict):
            table["options"] = move_option_files(table["options"], move)
    _map_keys(moved.get("balises"), BALISE_PATHS, move)
    _map_keys(moved.get("network"), NETWORK_PATHS, move)
    return moved


def _map_keys(table: Any, keys: tuple[str, ...], move: Callable[[str], str]) -> None:
    if not isinstance(table, dict):
        return
    for key in keys:
        if isinstance(table.get(key), str | os.PathLike):
            table[key] = move(os.fspath(table[key]))


def move_file(name: str, move: Callable[[str], str]) -> str:
    """The name of a model with the path of its file replaced; another name as it is.

    Args:
        name: of the model. move: from a path as it is written to the one to write.
    """
    if not names_a_file(name):
        return name
    path, wanted = split_name(name)
    return f"{move(path)}:{wanted}" if wanted else move(path)


def move_option_files(options: Mapping[str, Any], move: Callable[[str], str]) -> dict[str, Any]:
    """The options with the paths of files in them replaced.

    Args:
        options: of a component. move: as for `move_file`.
    """
    return {**options, **{key: move_file(name, move) for key, name in option_files(options).items()}}


def absolute(path: str | Path, folder: str | Path) -> str:
    """The absolute path of one that is relative to `folder`."""
    return str((Path(folder) / path).resolve())


def relative(path: str | Path, folder: str | Path) -> str:
    """The path as seen from `folder`, with ``/`` on every system; the absolute one where there is none (another
    drive).
    """
    place = Path(path)
    target = place.parent.resolve() / place.name  # a link to a file stays a link
    try:
        return Path(os.path.relpath(target, Path(folder).resolve())).as_posix()
    except ValueError:
        return target.as_posix()
