"""Which model a component of a run was, enough to separate a new delivery from another model, and what that delivery
states. Reads FMU files.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cosim.baselines.delivery import DeliveredFmu
from cosim.components.description import read_description
from cosim.errors import FmuLoadError
from cosim.results.result import Result
from plant_models.disk_cache.folder import cache_folder


@dataclass(frozen=True)
class Identity:
    """The model behind a component.

    Args:
        name: of the component. kind: ``FMU`` or ``block``. model: name in its model description.
        fmi_version: ``1.0``, ``2.0`` or ``3.0``. guid: GUID or instantiation token.
        file: name of the FMU file, without folders; empty for models that ship. sha256: of that file.
        parameters: start values that were set. options, preset: of a shipped model.
        delivery: what the description of that FMU states; None for models that ship, and where it is not known.
    """

    name: str
    kind: str = ""
    model: str = ""
    fmi_version: str = ""
    guid: str = ""
    file: str = ""
    sha256: str = ""
    parameters: Mapping[str, Any] = field(default_factory=dict)
    options: Mapping[str, Any] = field(default_factory=dict)
    preset: str | None = None
    delivery: DeliveredFmu | None = None


def identities(result: Result) -> list[Identity]:
    """The models behind a result, by name of the component; none where it does not say (a plain table).

    Args:
        result: the run.
    """
    entries = result.summary.get("components", [])
    return sorted((_identity(entry) for entry in entries if isinstance(entry, Mapping)), key=lambda found: found.name)


def _identity(entry: Mapping[str, Any]) -> Identity:
    path = _vendor_file(entry)
    return Identity(
        name=str(entry.get("name", "")),
        kind=str(entry.get("kind") or ""),
        model=str(entry.get("model") or ""),
        fmi_version=str(entry.get("fmi_version") or ""),
        guid=str(entry.get("guid") or ""),
        file=path.name if path else str(entry.get("file") or ""),
        sha256=file_digest(path) if path else str(entry.get("sha256") or ""),
        parameters=dict(entry.get("parameters") or {}),
        options=dict(entry.get("options") or {}),
        preset=entry.get("preset"),
        delivery=_delivery(path) if path else None,
    )


def _vendor_file(entry: Mapping[str, Any]) -> Path | None:
    """The FMU that a user brought; None for blocks and for shipped models, which are built anew on every machine."""
    path = Path(str(entry.get("source") or ""))
    if entry.get("kind") != "FMU" or not path.is_file() or cache_folder() in path.parents:
        return None
    return path


def _delivery(path: Path) -> DeliveredFmu | None:
    """What the description of an FMU states; None where the file is no FMU any more: a result may be older than it."""
    try:
        return DeliveredFmu.of(read_description(path, path.name))
    except FmuLoadError:
        return None


def file_digest(path: Path) -> str:
    """SHA-256 of a file.

    Args:
        path: the file.
    """
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
