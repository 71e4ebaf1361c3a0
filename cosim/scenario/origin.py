"""The origin of an outcome: the scenario as it was run, and the files of others that it uses. Looks at files, changes
none.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cosim.scenario.paths import BALISE_PATHS, COMPONENT_PATHS, MODEL_KEYS, NETWORK_PATHS
from plant_models.local_files import local_files
from plant_models.user_file import names_a_file, option_files, split_name

if TYPE_CHECKING:
    from cosim.scenario.schema import ScenarioTable

Stamp = tuple[int, int]
"""Size and time of the last change: what shows without reading a file that it is another one."""


@dataclass(frozen=True)
class ForeignFile:
    """A file or folder that a scenario uses and does not hold.

    Args:
        key: where the scenario names it, ``components.train.fmu``. path: absolute.
    """

    key: str
    path: Path

    @property
    def owner(self) -> str:
        """Component, ``balises`` or ``network``."""
        parts = self.key.split(".")
        return parts[1] if parts[0] == "components" else parts[0]

    @property
    def parts(self) -> list[Path]:
        """The files that belong to it: of results all that describes the run, whether the folder is named or a table in
        it; of Python what it imports beside it.
        """
        if self.path.suffix == ".py":
            return [self.path, *local_files(self.path).values()]
        folder = self.path if self.path.is_dir() else self.path.parent
        if self.path.is_dir():
            return sorted(p for p in folder.iterdir() if p.is_file() and _belongs_to_results(p))
        if (folder / "summary.json").is_file() and self.path.name.startswith("table."):
            return [
                self.path,
                *(folder / n for n in ("summary.json", "events.csv", "messages.csv") if (folder / n).is_file()),
            ]
        return [self.path]


@dataclass(frozen=True)
class Origin:
    """How an outcome came to be.

    Args:
        table: the scenario as it was run, overrides and included files in it.
        name: of the scenario. folder: start of its relative paths. where: what it was read from, or ``script``.
        command: the command line that asked for the run; None where a script did.
        keep: what must live as long as the files of the scenario are needed.
        stamps: of the foreign files when the run began, by path.
    """

    table: ScenarioTable
    name: str
    folder: Path
    where: str
    command: str | None = None
    keep: object = None
    stamps: Mapping[str, Stamp] = field(default_factory=dict)

    @classmethod
    def of(cls, table: ScenarioTable, name: str, folder: Path, where: str, keep: object = None) -> Origin:
        """The origin of a run that begins now; arguments as for the class."""
        files = {path for foreign in foreign_files(table, folder) for path in _existing_parts(foreign)}
        return cls(table, name, folder.resolve(), where, None, keep, {str(path): stamp(path) for path in files})

    @property
    def files(self) -> list[ForeignFile]:
        """The files of others that the scenario uses."""
        return foreign_files(self.table, self.folder)

    def __getstate__(self) -> dict[str, Any]:
        """For another process: the files of a package stay with the process that unpacked them."""
        return {**self.__dict__, "keep": None}


def foreign_files(table: ScenarioTable, folder: Path) -> list[ForeignFile]:
    """The files of others that a scenario uses.

    Args:
        table: the scenario. folder: start of its relative paths.
    """
    return [ForeignFile(key, (folder / path).resolve()) for key, path in _paths(table)]


def stamp(path: Path) -> Stamp:
    """Size [bytes] and time of the last change [ns] of a file.

    Args:
        path: of the file.
    """
    status = path.stat()
    return status.st_size, status.st_mtime_ns


def _paths(table: ScenarioTable) -> Iterator[tuple[str, str]]:
    for name, component in table.components.items():
        for key in COMPONENT_PATHS:
            if getattr(component, key) is not None:
                yield f"components.{name}.{key}", str(getattr(component, key))
        for key in MODEL_KEYS:
            if names_a_file(getattr(component, key) or ""):
                yield f"components.{name}.{key}", split_name(getattr(component, key))[0]
        for key, text in option_files(component.options).items():
            yield f"components.{name}.options.{key}", split_name(text)[0]
    for key in BALISE_PATHS:
        if table.balises is not None and getattr(table.balises, key) is not None:
            yield f"balises.{key}", str(getattr(table.balises, key))
    for key in NETWORK_PATHS:
        if table.network is not None and getattr(table.network, key) is not None:
            yield f"network.{key}", str(getattr(table.network, key))


def _existing_parts(foreign: ForeignFile) -> list[Path]:
    try:
        return [path for path in foreign.parts if path.is_file()]
    except OSError:
        return []


def _belongs_to_results(path: Path) -> bool:
    return path.name.startswith("table.") or path.name in ("summary.json", "events.csv", "messages.csv")
