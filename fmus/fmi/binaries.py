"""Binaries: which libraries an FMU file holds, and whether the one needed on this machine is among them; by names
alone.
"""

from __future__ import annotations

import posixpath
from collections.abc import Collection, Iterable
from pathlib import PurePosixPath

import fmpy
from fmpy.model_description import ModelDescription

LIBRARY_SUFFIXES = (".so", ".dll", ".dylib")


def platform_folder(description: ModelDescription) -> str:
    """Name of this platform's folder in ``binaries/``.

    Args:
        description: model description of the FMU.
    """
    return str(fmpy.platform_tuple if str(description.fmiVersion).startswith("3") else fmpy.platform)


def platforms_with(identifiers: Collection[str], names: Iterable[str]) -> tuple[str, ...]:
    """Folders in ``binaries/`` that hold a library with a model identifier's name, of the names of all files.

    Args:
        identifiers: model identifiers, one of which a library must be named after.
    """
    libraries = [_folder_and_file(name) for name in names]
    return tuple(sorted({folder for folder, file in libraries if posixpath.splitext(file)[0] in identifiers}))


def why_not_here(description: ModelDescription, identifiers: Collection[str], names: Collection[str]) -> str:
    """Why an FMU cannot be run on this machine: words that go on after its name; empty where it can.

    Args:
        description: its model description.
        identifiers: model identifiers, one of which the library must be named after.
        names: of all files in the archive.
    """
    here = platform_folder(description)
    if here in platforms_with(identifiers, names):
        return ""
    own = fmpy.sharedLibraryExtension
    others = [file for folder, file in map(_folder_and_file, names) if folder == here and file.endswith(own)]
    if others:
        wanted = " or ".join(f"binaries/{here}/{identifier}{own}" for identifier in sorted(identifiers))
        return (
            f"has its library under another name than its model identifier: it holds "
            f"binaries/{here}/{', '.join(sorted(others))} "
            f"where {wanted} is wanted. Rename the file in the archive, or ask the FMU's maker for a right export."
        )
    has = ", ".join(sorted({folder for folder, file in map(_folder_and_file, names) if file})) or "none"
    return f"has no library for this platform (binaries/{here} is needed); it offers: {has}."


def _folder_and_file(name: str) -> tuple[str, str]:
    """Platform and file name of a library; empty texts for other files."""
    parts = PurePosixPath(name).parts
    is_library = len(parts) == 3 and parts[0] == "binaries" and name.endswith(LIBRARY_SUFFIXES)
    return (parts[1], parts[2]) if is_library else ("", "")
