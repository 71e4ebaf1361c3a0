"""The manifest: what a results folder says of how it was made, and whether its files are still those. Reads only."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from cosim.errors import ProvenanceError, not_utf8
from cosim.results.summary_file import first_wrong
from fmus.near_files import near_files

MADE_FROM, MANIFEST, SCENARIO, FILES = "made_from", "manifest.json", "scenario.toml", "files"
FORMAT = 1


@dataclass(frozen=True)
class _Digest:
    sha256: str


@dataclass(frozen=True)
class _Named(_Digest):
    name: str


@dataclass(frozen=True)
class _Component:
    name: str
    model: str | None
    guid: str | None


@dataclass(frozen=True)
class _KeptPart:
    path: str
    copy: str | None
    sha256: str | None
    why: str | None


@dataclass(frozen=True)
class _KeptFile:
    key: str
    path: str
    parts: list[_KeptPart]


@dataclass(frozen=True)
class _Shape:
    """What is relied on of the file; there may be more."""

    scenario: _Named
    versions: dict[str, str]
    files: list[_KeptFile]
    results: dict[str, _Digest]
    components: list[_Component] = field(default_factory=list)
    objects: dict[str, dict[str, Any]] = field(default_factory=dict)


_SHAPE = TypeAdapter(_Shape)


@dataclass(frozen=True)
class Manifest:
    """What stands in ``made_from/manifest.json``.

    Args:
        directory: the results folder. data: the content of the file.
    """

    directory: Path
    data: Mapping[str, Any]

    @property
    def name(self) -> str:
        """Name of the scenario."""
        return str(self.data["scenario"]["name"])

    @property
    def scenario(self) -> Path:
        """The scenario file."""
        return self.directory / MADE_FROM / SCENARIO

    @property
    def versions(self) -> dict[str, str]:
        """Of Python, platform and packages, when the results were made."""
        return dict(self.data["versions"])

    @property
    def objects(self) -> dict[str, dict[str, Any]]:
        """What was kept of classes and instances that a script gave: ``class``, whether it can be found again, and
        ``text``, by component.
        """
        return dict(self.data.get("objects", {}))

    def edited(self) -> list[str]:
        """What is not any more as it was written, one line each: results, scenario, kept files."""
        made = self.directory / MADE_FROM
        lines = [_difference(self.directory / name, entry["sha256"]) for name, entry in self.data["results"].items()]
        lines.append(_difference(made / SCENARIO, self.data["scenario"]["sha256"]))
        for foreign in self.data["files"]:
            lines += [_difference(made / p["copy"], p["sha256"]) for p in foreign["parts"] if p["copy"] is not None]
        return [line for line in lines if line]

    def missing(self, stated: Collection[str] = ()) -> list[str]:
        """Files that were not kept and are not where they were, or are others by now, one line each.

        Args:
            stated: keys of files that are given anew and not looked for, ``components.train.fmu``.
        """
        lines = []
        for foreign in self.data["files"]:
            lost = [p for p in foreign["parts"] if p["copy"] is None] if foreign["key"] not in stated else []
            for part in lost:
                what = _difference(Path(part["path"]), part["sha256"])
                if what:
                    where = f"Put it back there, or say where it is: --set {_setting(foreign)}=FILE."
                    lines.append(f"{what} It was not copied ({part['why']}). {where}")
        return lines

    def moved_on(self) -> list[str]:
        """Kept files whose originals have changed or gone since, one line each: no fault, the copies are used."""
        lines = []
        for foreign in self.data["files"]:
            for part in foreign["parts"]:
                path = Path(part["path"])
                if part["copy"] is not None and path.is_file() and sha256(path) != part["sha256"]:
                    lines.append(f"{path} is another file now; its copy in this folder was used.")
        return lines


def read_manifest(directory: str | Path) -> Manifest:
    """What a results folder says of how it was made.

    Args:
        directory: results folder.

    Raises:
        ProvenanceError: it is no results folder, says nothing, or something unreadable.
    """
    folder = Path(directory)
    if not folder.is_dir():
        what = "is a file" if folder.is_file() else "does not exist"
        raise ProvenanceError(f"{folder} {what}; expected a results folder, as cosim run --out DIR writes it.")
    file = folder / MADE_FROM / MANIFEST
    if not file.is_file():
        if not (folder / "summary.json").is_file():
            raise ProvenanceError(
                f"{folder} is no results folder: it has neither summary.json nor {MADE_FROM}/{MANIFEST}; "
                f"{near_files(folder / 'scenario.toml', '.toml')}"
            )
        raise ProvenanceError(
            f"{folder} does not say how it was made: it has no {MADE_FROM}/{MANIFEST}. An older version wrote it, or "
            f"it was "
            "copied in part; run its scenario again."
        )
    try:
        data = json.loads(file.read_text(encoding="utf-8"))
        known = int(data["format"])
        if known != FORMAT:
            raise ProvenanceError(
                f"{file} has format {known}, this version reads format {FORMAT}; use a newer fmu-observer."
            )
        _SHAPE.validate_python(data)
    except ValidationError as error:
        raise ProvenanceError(f"{file} cannot be read: {first_wrong(error)}.") from None
    except (OSError, ValueError, KeyError, TypeError) as error:
        if isinstance(error, ProvenanceError):
            raise
        raise ProvenanceError(f"{file} cannot be read: {_why(error)}.") from error
    return Manifest(folder, data)


def _why(error: Exception) -> str:
    """What is wrong with a manifest, in words."""
    if isinstance(error, OSError):
        return str(error.strerror or error)
    if isinstance(error, KeyError):
        return f"{error} is missing; another program wrote it, or it was edited"
    if isinstance(error, TypeError):
        return "it is not a table; another program wrote it, or it was edited"
    if isinstance(error, UnicodeDecodeError):
        return not_utf8(error.object)
    return f"it is cut off or was edited ({error})"


def sha256(path: Path) -> str:
    """SHA-256 of a file, in hexadecimal; read once as long as it does not change.

    Args:
        path: of the file.

    Raises:
        OSError: it cannot be read.
    """
    status = path.stat()
    return _sha256(str(path.resolve()), status.st_ino, status.st_size, status.st_mtime_ns)


@lru_cache(maxsize=256)
def _sha256(path: str, *_: int) -> str:
    with Path(path).open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _difference(path: Path, digest: str | None) -> str:
    """What is wrong with a file, or nothing."""
    try:
        if not path.is_file():
            return f"{path} is missing (SHA-256 {str(digest)[:12]}...)."
        equal = digest is None or sha256(path) == digest
        return "" if equal else f"{path} was changed since: its SHA-256 is not {str(digest)[:12]}..."
    except OSError as error:
        return f"{path} cannot be read: {error.strerror or error}."


def _setting(foreign: Mapping[str, Any]) -> str:
    return str(foreign["key"]).removeprefix("components.")
