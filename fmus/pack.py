"""Packing: the files of an FMU become one zip file, byte for byte the same each time, written all or not at all."""

from __future__ import annotations

import os
import tempfile
import zipfile
from collections.abc import Mapping
from pathlib import Path

from plant_models.disk_cache.entries import whole_file
from plant_models.left_behind import owned

_TIMESTAMP = (1980, 1, 1, 0, 0, 0)
"""Of every file in an FMU: the earliest a zip file can hold."""


def fmu_path(name: str, target: Path | str) -> Path:
    """Where an FMU goes: `target` itself where it ends in ``.fmu``, else the file of this name in that folder."""
    path = Path(target)
    return path if path.suffix.lower() == ".fmu" else path / f"{name}.fmu"


def check_target(target: Path) -> None:
    """Find out before the work whether an FMU can be written; changes nothing.

    Args:
        target: path of the FMU; its folder need not exist.

    Raises:
        OSError: a folder is in its place, or its folder cannot be created or written to.
    """
    if target.is_dir():
        raise IsADirectoryError(f"{target} is a folder; give another file name, or remove the folder.")
    folder = target.parent
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    try:
        handle, name = tempfile.mkstemp(prefix=owned(".fmus-", folder), dir=folder)
    except OSError as error:
        raise type(error)(
            f"{target} cannot be written: {folder}: {error.strerror or error}; choose another folder."
        ) from error
    os.close(handle)
    Path(name).unlink()


def pack_fmu(files: Mapping[str, bytes], target: Path) -> Path:
    """Write an FMU.

    Args:
        files: content by name inside the FMU, with forward slashes.
        target: path of the FMU; its folder is created where it is missing. An older file is replaced in one move.

    Returns:
        `target`.

    Raises:
        OSError: it cannot be written, for example to a full disk; names the target, and an older file there is as it
        was.
    """
    try:
        with whole_file(target, 0o644) as stream, zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
            for inner in sorted(files):
                archive.writestr(_entry(inner), files[inner], compresslevel=9)
    except OSError as error:  # a full disk does not say which file it was
        raise OSError(error.errno, f"{error.strerror or error}; the FMU was not written", str(target)) from error
    return target


def files_of(path: Path) -> dict[str, bytes]:
    """The files of an FMU: content by name.

    Args:
        path: of the FMU.

    Raises:
        OSError: it cannot be read.
    """
    with zipfile.ZipFile(path) as archive:
        return {entry.filename: archive.read(entry) for entry in archive.infolist() if not entry.is_dir()}


def _entry(name: str) -> zipfile.ZipInfo:
    entry = zipfile.ZipInfo(name, _TIMESTAMP)
    entry.create_system = 3  # the same on every system
    entry.external_attr = (0o100755 if name.startswith("binaries/") else 0o100644) << 16
    entry.compress_type = zipfile.ZIP_DEFLATED
    return entry
