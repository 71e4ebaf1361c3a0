"""Source build: the C or C++ sources that an FMU brings become its library for this machine.

The compiler is the one that FMUs are built with here, so neither CMake nor a project file is needed. Each source set is
compiled with its own language, definitions and include folders, and all of a configuration are linked into one library.
"""

from __future__ import annotations

import shutil
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import fmpy
from fmpy.model_description import BuildConfiguration, SourceFileSet

from fmus.fmi.archive import Archive, NotAnFmuError, open_archive
from fmus.fmi.binaries import platform_folder
from fmus.fmi.sources import FOLDER, compiled_library
from fmus.fmi.standard import fmi_version
from fmus.pack import check_target, files_of, pack_fmu
from fmus.toolchain.compile import CompilationError, Compiler, find_compiler, header_folder, run_compiler
from plant_models.disk_cache.files import is_sealed, seal

_VERSIONS = ("1.0", "2.0", "3.0")
_SHOWN = 12
"""Lines of a compiler's words that are shown, the last ones."""

_FLAGS = ("-O2", "-ffp-contract=off", "-g0", "-DFMI3_OVERRIDE_FUNCTION_PREFIX", "-DDISABLE_PREFIX")
"""The library exports the names of the standard: a prefix is for static linking. FMI 2 has no word for that; the one of
the Reference FMUs is understood by what was made after them.
"""

_OF_LINKING = ("-shared", "-s", "-static-libgcc")

_FIRST_CALLS = {1: "fmiGetVersion", 2: "fmi2GetVersion", 3: "fmi3GetVersion"}
"""What every library exports, by version of FMI; in FMI 1.0 with the model identifier before it."""


@dataclass(frozen=True)
class SourceBuild:
    """What came of the sources of an FMU.

    Args:
        libraries: one for each model identifier. compiler: what compiled them, as it calls itself.
        kept: whether all of them had been compiled before.
    """

    libraries: tuple[Path, ...]
    compiler: str
    kept: bool


def compile_sources(path: Path) -> SourceBuild:
    """Compile the sources of an FMU for this machine; the libraries are kept in the cache folder, by its content.

    From then on every command that loads the FMU finds them.

    Args:
        path: of the FMU file.

    Raises:
        NotAnFmuError: it is no FMU, has a library for this machine already, or brings no sources.
        CompilerMissing: no C compiler was found.
        CompilationError: the compiler refused; the message carries its last lines.
        OSError: the cache folder cannot be written.
    """
    archive = open_archive(path, versions=_VERSIONS)
    configurations = _demand_sources(archive)
    compiler = find_compiler()
    targets = {c.modelIdentifier: compiled_library(path, c.modelIdentifier) for c in configurations}
    kept = all(map(is_sealed, targets.values()))
    if not kept:
        with archive.unpacked() as folder:
            for configuration in configurations:
                library = _compiled(archive, configuration, compiler, folder)
                target = targets[configuration.modelIdentifier]
                target.parent.mkdir(parents=True, exist_ok=True)
                draft = target.with_name(f".{target.name}.part")
                shutil.copy(library, draft)
                draft.replace(target)
                seal(target)
    return SourceBuild(tuple(targets.values()), compiler.version, kept)


def add_libraries(path: Path, build: SourceBuild, target: Path) -> Path:
    """Write an FMU with all that another one holds and the libraries that were compiled of its sources.

    Args:
        path: of the FMU. build: from `compile_sources`. target: the new file.

    Returns:
        `target`.

    Raises:
        OSError: it cannot be written. ValueError: it is the FMU itself.
    """
    check_target(target)
    if target.exists() and target.samefile(path):
        raise ValueError(f"{target} is the FMU itself, which stays as it is; give another file name.")
    folder = platform_folder(open_archive(path, versions=_VERSIONS).description)
    added = {f"binaries/{folder}/{library.name}": library.read_bytes() for library in build.libraries}
    return pack_fmu(files_of(path) | added, target)


def _demand_sources(archive: Archive) -> list[BuildConfiguration]:
    here = archive.here
    if here:
        raise NotAnFmuError(f"{archive.path} has a library for this platform already (binaries/{here[0]}).")
    configurations = archive.build_configurations()
    if not configurations:
        raise NotAnFmuError(
            f"{archive.path} brings no C sources: ask its maker for an export with a library for this "
            f"platform ({fmpy.platform_tuple}), or with sources."
        )
    wanted = [f"{FOLDER}{file}" for c in configurations for sources in c.sourceFileSets for file in sources.sourceFiles]
    lacking = [name for name in wanted if name not in archive.names]
    if lacking:
        raise NotAnFmuError(
            f"{archive.path} lists source files that it does not hold: {', '.join(lacking)}. Ask its "
            "maker for a whole export."
        )
    return configurations


def _compiled(archive: Archive, configuration: BuildConfiguration, compiler: Compiler, folder: Path) -> Path:
    """The library of one configuration, in the folder where the FMU is unpacked."""
    name, sources = configuration.modelIdentifier, folder / "sources"
    library = f"{name}{fmpy.sharedLibraryExtension}"
    is_cpp = any(not file.endswith(".c") for s in configuration.sourceFileSets for file in s.sourceFiles)
    try:
        objects: list[str] = []
        for each in configuration.sourceFileSets:
            objects += _objects(each, f"set{len(objects)}", compiler, sources, fmi_version(archive.description))
        linker, more = _of_cpp(compiler) if is_cpp else (compiler, [])
        run_compiler(linker, sources, [*linker.flags, *_binding(), *objects, "-o", library, "-lm", *more])
    except CompilationError as error:
        raise CompilationError(_in_few_lines(archive.path, error)) from error
    _demand_names(archive, sources / library, name)
    return sources / library


def _objects(sources: SourceFileSet, start: str, compiler: Compiler, folder: Path, version: int) -> Iterator[str]:
    """Compile the files of one source set; yields the names of the object files, which begin with `start`."""
    defined = {d.name: d.value for d in sources.preprocessorDefinitions if not d.optional}
    defined = {"FMI_VERSION": str(version)} | defined  # which those made after the Reference FMUs ask for
    words = [*_FLAGS, *_without_linking(compiler.flags), *_language(sources)]
    words += [f"-D{name}" if value is None else f"-D{name}={value}" for name, value in defined.items()]
    words += [f"-I{include}" for include in (".", *sources.includeDirectories, header_folder())]
    for place, file in enumerate(sources.sourceFiles):
        target = f"{start}-file{place}.o"
        own = compiler if file.endswith(".c") else _of_cpp(compiler)[0]
        run_compiler(own, folder, [*words, "-c", file, "-o", target])
        yield target


def _without_linking(flags: Sequence[str]) -> list[str]:
    """The flags of a compiler that are about one file; the cross compiler would strip each object file of its names."""
    return [flag for flag in flags if flag not in _OF_LINKING and not flag.startswith("-Wl,")]


def _language(sources: SourceFileSet) -> list[str]:
    """Option for a language of FMI 3.0, ``C99`` or ``C++11``, with the extensions that compilers have by default."""
    language = (sources.language or "").replace(" ", "").lower()
    return [f"-std=gnu{language[1:]}"] if language[:1] == "c" and language[-1:].isdigit() else []


def _of_cpp(compiler: Compiler) -> tuple[Compiler, list[str]]:
    """What compiles and links parts in C++: a compiler, and the library that it links with."""
    if compiler.zig:
        return replace(compiler, command=tuple("c++" if word == "cc" else word for word in compiler.command)), []
    return compiler, ["-lc++" if sys.platform == "darwin" else "-lstdc++"]


def _binding() -> list[str]:
    """A function of the FMU's own is not taken from the C library because it has the same name."""
    return ["-Wl,-Bsymbolic"] if sys.platform.startswith("linux") else []


def _in_few_lines(path: Path, error: CompilationError) -> str:
    """What a compiler said, its last lines."""
    lines = str(error).splitlines()[1:]
    more = [f"  ... ({len(lines) - _SHOWN} lines before)"] if len(lines) > _SHOWN else []
    said = "\n".join([*more, *(f"  {line}" for line in lines[-_SHOWN:])])
    return f"{path}: its sources cannot be compiled here; the compiler says:\n{said}"


def _demand_names(archive: Archive, library: Path, identifier: str) -> None:
    """Refuse a library whose functions have other names than importers search for."""
    version = fmi_version(archive.description)
    first = f"{identifier}_{_FIRST_CALLS[1]}" if version == 1 else _FIRST_CALLS[version]
    content = library.read_bytes()
    if not any(f"\0{start}{first}\0".encode() in content for start in ("", "_")):  # as macOS writes them
        raise CompilationError(
            f"{archive.path}: its sources were compiled, but the library has no function {first}; they are made for "
            "static linking, with a prefix before the names, or do not hold the functions of FMI. Ask its maker for a "
            f"library for this platform ({fmpy.platform_tuple})."
        )
