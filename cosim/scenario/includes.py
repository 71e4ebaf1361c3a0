"""Includes: a scenario file merged with the files it builds on, and where each of its values stands. Reads TOML
files.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from cosim.errors import ScenarioError, nearest
from cosim.scenario.merging import Line, join, merge
from cosim.scenario.override import flat, override
from cosim.scenario.package_names import is_package
from cosim.scenario.paths import absolute, map_paths
from cosim.scenario.shipped import shipped_file, shipped_scenarios
from cosim.scenario.toml_file import read_toml
from fmus.near_files import missing_file

CONNECTIONS = "connections"
Key = tuple[str, ...]
_NUMBERED = re.compile(r"connections, line (\d+)")
NAMED = re.compile(r"[A-Za-z_][\w.]*")


@dataclass
class Tables:
    """The tables of a scenario file with all it includes.

    Args:
        data: the merged tables, overrides applied; paths out of included files are absolute.
        places: the file in which a value stands, by the path of keys to it; connections by their number from 0.
    """

    data: dict[str, Any]
    places: dict[Key, str] = field(default_factory=dict)

    @property
    def lines(self) -> list[Line]:
        """The connections, each with the file it stands in."""
        items = self.data.get(CONNECTIONS, [])
        return [(item, self.places.get((CONNECTIONS, str(n)), "")) for n, item in enumerate(items)]


def attribute(message: str, where: str, places: Mapping[Key, str]) -> str:
    """A message with the file in which the fault stands, where that is not the file that was loaded.

    Args:
        message: lines such as ``my.toml: components.plant.fmu: ...``. where: the file that was loaded. places: see
            `Tables`.
    """
    head = f"{where}: "
    lines = [line.removeprefix(head) if line.startswith(head) else None for line in message.split("\n")]
    found = [None if line is None else _place(line, places) for line in lines]
    return "\n".join(
        whole if line is None or place is None or place == where else f"{place}: {line} (included by {where})"
        for whole, line, place in zip(message.split("\n"), lines, found, strict=True)
    )


def _place(text: str, places: Mapping[Key, str]) -> str | None:
    """The file that holds the key a message begins with."""
    numbered, named = _NUMBERED.match(text), NAMED.match(text)
    if numbered is not None:
        return places.get((CONNECTIONS, str(int(numbered[1]) - 1)))
    keys = tuple(named[0].split(".")) if named is not None else ()
    return next((places[keys[:n]] for n in range(len(keys), 0, -1) if keys[:n] in places), None)


def find_file(name: str | Path, folder: Path = Path()) -> Path:
    """The file of a scenario: a path, or the name of a shipped one.

    Args:
        name: path or name. folder: that a relative path starts from.

    Raises:
        ScenarioError: there is none.
    """
    path = folder / name
    if path.is_file():
        if path.suffix.lower() == ".fmu":
            raise ScenarioError(f"{path} is an FMU and no scenario; 'cosim new {path}' writes one to start from.")
        return path
    if not path.suffix:
        shipped = shipped_file(str(name))
        if shipped.is_file():
            return shipped
        hint = nearest(str(name), [*shipped_scenarios(), *(p.name for p in folder.glob("*.toml"))])
        raise ScenarioError(f"No scenario {str(name)!r}; {hint}")
    raise ScenarioError(f"Scenario file {missing_file(path, '.toml', '.ssp')}")


def read_tables(path: Path, chain: Sequence[Path] = ()) -> Tables:
    """The tables of a scenario file, merged with those it includes, its overrides applied last.

    Args:
        path: of the file. chain: the files that include it, outermost first.

    Raises:
        ScenarioError: a file is missing or is not TOML, files include one another in a circle, something is to be
        removed that
            is not there, or an override has no target.
    """
    # a path that is a circle of links has no other name, and `resolve` raises
    if os.path.realpath(path) in [os.path.realpath(file) for file in chain]:
        raise ScenarioError(f"Scenario files include one another in a circle: {' -> '.join(map(str, (*chain, path)))}.")
    data = _read(path, chain)
    included, overrides = _listed(data.pop("include", []), path), data.pop("overrides", {})
    own = Tables(data, _places(data, str(path)))
    tables = Tables({})
    for name in included:
        _add(tables, _included(name, path, chain), path)
    if included:
        _add(tables, own, path)
    else:
        tables = own
    _override(tables, overrides, path)
    return tables


def _read(path: Path, chain: Sequence[Path]) -> dict[str, Any]:
    by = f" (included by {chain[-1]})" if chain else ""
    try:
        return read_toml(path)
    except OSError as error:
        raise ScenarioError(f"Scenario file {path} cannot be read: {error.strerror}{by}.") from error
    except ValueError as error:
        if path.suffix.lower() in (".py", ".csv", ".ipynb"):
            raise ScenarioError(f"{path} is no scenario, whose file ends in .toml or .ssp{by}.") from error
        raise ScenarioError(f"{path}: not readable as TOML: {error}{by}") from error


def _listed(stated: Any, path: Path) -> list[str]:
    names = [stated] if isinstance(stated, str) else stated
    if not isinstance(names, list) or not all(isinstance(name, str) and name for name in names):
        raise ScenarioError(
            f"{path}: include: expected a list of files and names of shipped scenarios (got {stated!r})."
        )
    return names


def _included(name: str, by: Path, chain: Sequence[Path]) -> Tables:
    """The tables of an included file, its paths absolute."""
    if is_package(name):
        raise ScenarioError(
            f"{by}: include: {name} is a system structure package; only scenario files can be included."
        )
    try:
        file = find_file(name, by.parent)
    except ScenarioError as error:
        raise ScenarioError(f"{by}: include: {error}") from error
    tables = read_tables(file, (*chain, by))
    return Tables(map_paths(tables.data, partial(absolute, folder=file.parent)), tables.places)


def _add(earlier: Tables, later: Tables, by: Path) -> None:
    """Merge the tables of a file into those before it."""
    for tables in (earlier, later):
        if not isinstance(tables.data.get(CONNECTIONS, []), list):
            place = tables.places.get((CONNECTIONS,), by)
            raise ScenarioError(f"{place}: connections: expected a list of lines 'source.signal -> target.signal'.")
    try:
        removed = _removed_components(earlier.data, later.data)
        lines = join(earlier.lines, later.lines, removed)
    except ScenarioError as error:
        raise ScenarioError(f"{by}: {error}") from error
    merge(earlier.data, later.data)
    places = {key: place for key, place in (earlier.places | later.places).items() if key[0] != CONNECTIONS}
    earlier.places = places | {(CONNECTIONS, str(n)): place for n, (_, place) in enumerate(lines)}
    earlier.data[CONNECTIONS] = [item for item, _ in lines]


def _override(tables: Tables, overrides: Any, path: Path) -> None:
    """Apply the overrides of a file, as ``--set`` would; paths in them are relative to the file."""
    if not isinstance(overrides, dict):
        raise ScenarioError(f"{path}: overrides: expected a table, such as [overrides] with lines 'plant.mass = 80e3'.")
    for name, value in flat(overrides):
        try:
            keys = override(tables.data, name, value)
        except ScenarioError as error:
            raise ScenarioError(f"{path}: overrides: {error}") from error
        tables.places[keys] = str(path)


def _places(data: Any, place: str, key: Key = ()) -> dict[Key, str]:
    """The file of every key, and of each connection."""
    found: dict[Key, str] = {}
    numbered = key == (CONNECTIONS,) and isinstance(data, list)
    for name, value in data.items() if isinstance(data, dict) else enumerate(data) if numbered else ():
        here = (*key, str(name))
        found |= {here: place} | _places(value, place, here)
    return found


def _removed_components(earlier: Mapping[str, Any], later: Mapping[str, Any]) -> set[str]:
    """Names of the components that the later tables set to false."""
    components, old = later.get("components"), earlier.get("components", {})
    names = {name for name, table in components.items() if table is False} if isinstance(components, dict) else set()
    for name in sorted(names):
        if name not in old:
            raise ScenarioError(f"components.{name} = false: no included file has this component; {nearest(name, old)}")
    return names
