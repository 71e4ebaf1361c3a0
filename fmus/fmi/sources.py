"""C sources in an FMU: what its library is compiled of, and the library that was compiled of them on this machine.

Such a library is kept in the cache folder under the digest of the FMU file, and stands for the one that the FMU lacks.
"""

from __future__ import annotations

import shlex
import shutil
from collections.abc import Collection, Sequence
from pathlib import Path

import fmpy
from fmpy.model_description import BuildConfiguration, ModelDescription, SourceFileSet

from fmus.fmi.binaries import platform_folder
from plant_models.disk_cache.files import file_digest, is_sealed
from plant_models.disk_cache.folder import cache_folder

FOLDER = "sources/"
_SUFFIXES = (".c", ".cc", ".cpp", ".cxx")


def build_configurations(
    description: ModelDescription, identifiers: Collection[str], names: Collection[str]
) -> list[BuildConfiguration]:
    """What the libraries of an FMU are compiled of, one configuration for each model identifier.

    Args:
        description: its model description. identifiers: model identifiers that a library is wanted for.
        names: of all files in the archive.

    Returns:
        As the FMU declares them, a single one also where it is named after another model, as a copied
        buildDescription.xml is; where it declares nothing, ``all.c``, else every source file directly in its sources.
    """
    declared = {c.modelIdentifier: c.sourceFileSets for c in description.buildConfigurations if _has_files(c)}
    found = {name: declared[name] for name in sorted(identifiers) if name in declared}
    if not found and (sets := _undeclared(list(declared.values()), names)):
        found = dict.fromkeys(sorted(identifiers), sets)
    return [BuildConfiguration(name, sets) for name, sets in found.items()]


def _undeclared(declared: Sequence[list[SourceFileSet]], names: Collection[str]) -> list[SourceFileSet]:
    """The source sets of a model that has no build configuration of its own; empty where nothing can be meant."""
    if declared:
        return declared[0] if len(declared) == 1 else []
    files = [name.removeprefix(FOLDER) for name in names if name.startswith(FOLDER) and name.endswith(_SUFFIXES)]
    files = ["all.c"] if "all.c" in files else [file for file in files if "/" not in file]
    return [SourceFileSet(sourceFiles=files)] if files else []


def _has_files(configuration: BuildConfiguration) -> bool:
    return any(sources.sourceFiles for sources in configuration.sourceFileSets)


def compiled_library(path: Path, identifier: str) -> Path:
    """Where the library of a model is kept that was compiled of the sources in an FMU; it need not be there.

    Args:
        path: of the FMU file. identifier: its model identifier.

    Raises:
        OSError: the FMU cannot be read.
    """
    folder = cache_folder() / "compiled" / file_digest(path) / str(fmpy.platform_tuple)
    return folder / f"{identifier}{fmpy.sharedLibraryExtension}"


def compiled_here(path: Path, identifiers: Collection[str]) -> list[Path]:
    """The libraries of an FMU that were compiled on this machine, and are whole.

    Args:
        path: of the FMU file. identifiers: its model identifiers.
    """
    libraries = (compiled_library(path, identifier) for identifier in sorted(identifiers))
    return [library for library in libraries if is_sealed(library)]


def add_compiled(path: Path, identifiers: Collection[str], description: ModelDescription, folder: Path) -> None:
    """Put the libraries that were compiled on this machine where an unpacked FMU lacks them.

    Args:
        path: of the FMU file. identifiers: its model identifiers. description: its model description.
        folder: where it is unpacked.

    Raises:
        OSError: a file cannot be written.
    """
    place = folder / "binaries" / platform_folder(description)
    lacking = [name for name in identifiers if not (place / f"{name}{fmpy.sharedLibraryExtension}").exists()]
    for library in compiled_here(path, lacking) if lacking else ():
        place.mkdir(parents=True, exist_ok=True)
        shutil.copy(library, place / library.name)


def how_to_compile(path: Path, configurations: Sequence[BuildConfiguration]) -> str:
    """A sentence with the command that compiles the sources; empty where there are none.

    Args:
        path: of the FMU file. configurations: see `build_configurations`.
    """
    command = shlex.join(["fmus", "compile", str(path)])
    return f" It brings its C sources: compile them once with: {command}" if configurations else ""
