"""The catalogue: what is known of every model that can be exported, without loading the models.

What ships is read once and kept in the cache under a digest of the files it follows from; what installed packages bring
is loaded.
"""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from fmu_observer import OBSERVERS
from plant_models import PLANTS
from plant_models.disk_cache.entries import remembered
from plant_models.disk_cache.files import file_digest
from plant_models.explained_error import explained
from plant_models.registry import Registry, RegistryError

PACKAGES = ("plant_models", "fmu_observer")
_READERS = ("catalogue.py", "recipes.py")
"""Files beside this one that decide what an entry says."""
_UNUSABLE = "Cannot be used"
"""The room of models that cannot be loaded or made; their description says why."""


@dataclass(frozen=True)
class Option:
    """An option of a model.

    Args:
        name: keyword of the constructor. default: its default as text; None where it has none.
        legal: its legal values in words, empty where any is legal. listed: whether the model lists them.
    """

    name: str
    default: str | None
    legal: str
    listed: bool


@dataclass(frozen=True)
class CatalogueEntry:
    """What is known of a model.

    Args:
        name: of the model. room: where it lives, in words. description, source: as the model says.
        presets: their names. preset: the default one, or None. options: that shape its equations.
        inputs: that have to be connected, but those of events. events: that reach it from outside.
    """

    name: str
    room: str
    description: str
    source: str
    presets: tuple[str, ...]
    preset: str | None
    options: tuple[Option, ...]
    inputs: tuple[str, ...]
    events: tuple[str, ...]

    @property
    def text(self) -> str:
        """All its words, in small letters, for those who search."""
        words = (self.name, self.description, self.source, *self.presets, *self.inputs, *self.events)
        return " ".join([*words, *(option.name for option in self.options)]).lower()


def catalogue() -> dict[str, CatalogueEntry]:
    """All models by name: plants first, then observers."""
    shipped = [name for registry in (PLANTS, OBSERVERS) for name in registry if registry.room(name)]
    others = [(registry, name) for registry in (PLANTS, OBSERVERS) for name in registry if not registry.room(name)]
    try:
        known = {data["name"]: _entry(data) for data in remembered("catalogue", _key(shipped), lambda: _read(shipped))}
    except (RegistryError, ModuleNotFoundError):  # of an installation without a package that some models need
        others, known = [(r, name) for r in (PLANTS, OBSERVERS) for name in r], {}
    known |= {name: _entry_of_others(registry, name) for registry, name in others}
    return {name: known[name] for registry in (PLANTS, OBSERVERS) for name in registry}


def by_room(entries: Iterable[CatalogueEntry]) -> dict[str, list[CatalogueEntry]]:
    """Entries grouped by the room of the house a model lives in; what this program registered comes last, and after
    it what cannot be used.

    Args:
        entries: of the catalogue.
    """
    rooms: dict[str, list[CatalogueEntry]] = {}
    for entry in entries:
        rooms.setdefault(entry.room, []).append(entry)
    return dict(sorted(rooms.items(), key=lambda item: (item[0] == _UNUSABLE, item[0].startswith("Registered by"))))


def _read(names: Iterable[str]) -> list[dict[str, Any]]:
    """Entries as plain data, from the models themselves."""
    from fmus.recipes import recipe_entry  # noqa: PLC0415 - it loads the models

    return [recipe_entry(name) for name in names]


def _entry_of_others(registry: Registry[Any], name: str) -> CatalogueEntry:
    """An entry that does not ship; where its code fails, the reason is its description."""
    try:
        return _entry(_read([name])[0])
    except Exception as error:  # whatever the code of others raises
        reason = str(error) if isinstance(error, RegistryError) else f"{registry.origin(name)}: {explained(error)}"
        return CatalogueEntry(name, _UNUSABLE, " ".join(reason.split()), "", (), None, (), (), ())


def _entry(data: dict[str, Any]) -> CatalogueEntry:
    options = tuple(Option(**option) for option in data["options"])
    lists = {key: tuple(data[key]) for key in ("presets", "inputs", "events")}
    return CatalogueEntry(**data | lists | {"options": options})


def _key(names: list[str]) -> str:
    """Digest of the names of the shipped models, and of all files that decide what these say of themselves."""
    folders = [Path(place) for package in PACKAGES for place in _places(package)]
    paths = [path for folder in folders for path in sorted(folder.rglob("*.py"))]
    paths += [Path(__file__).with_name(name) for name in _READERS]
    digests = "\n".join(f"{path.name} {file_digest(path)}" for path in paths)
    return hashlib.sha256(f"{sys.version}\n{names}\n{digests}".encode()).hexdigest()


def _places(package: str) -> Iterable[str]:
    spec = find_spec(package)
    return (spec.submodule_search_locations if spec is not None else None) or ()
