"""Libraries and programs for this machine that were compiled once and are kept in the cache folder. Writes to that
folder only.
"""

from __future__ import annotations

import hashlib
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from fmus.toolchain.compile import Compiler, compile_library, compile_program, library_name
from plant_models.disk_cache.files import is_sealed, seal
from plant_models.left_behind import owned


def cached_library(name: str, sources: Mapping[str, bytes], main: str, compiler: Compiler, folder: Path) -> Path:
    """Path of a library in a cache folder; built there where it is missing, in one move, so that nothing is to be
    locked.

    Args:
        name: of the library, without what the platform adds.
        sources: C files and headers by file name.
        main: the one of them that is compiled; it includes the others.
        compiler: see `find_compiler`.
        folder: the cache folder.

    Returns:
        Path of the library, in a folder of its own named by a digest of compiler and sources.

    Raises:
        CompilationError: the compiler refused the sources.
        OSError: the folder cannot be written.
    """
    return _cached(name, sources, main, compiler, folder, (library_name(name), compile_library))


def cached_program(name: str, sources: Mapping[str, bytes], main: str, compiler: Compiler, folder: Path) -> Path:
    """Path of a program in a cache folder; as `cached_library`, and it raises the same.

    Args:
        name: of the program. sources: C files and headers by file name. main: the one of them that is compiled.
        compiler: see `find_compiler`. folder: the cache folder.
    """
    return _cached(name, sources, main, compiler, folder, (name, compile_program))


def _cached(
    name: str,
    sources: Mapping[str, bytes],
    main: str,
    compiler: Compiler,
    folder: Path,
    made: tuple[str, Callable[[Compiler, Path, Sequence[str], str], Path]],
) -> Path:
    """A file with the name in `made`, by the function there."""
    file_name, build = made
    parts = [compiler.identity().encode(), *(text for _, text in sorted(sources.items()))]
    digest = hashlib.sha256(b"\0".join(parts)).hexdigest()[:32]
    target = folder / f"{name}-{digest}" / file_name
    if not is_sealed(target):  # to load a part of a library can end the process
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=owned("build-", target.parent), dir=target.parent) as scratch:
            for file, text in sources.items():
                (Path(scratch) / file).write_bytes(text)
            build(compiler, Path(scratch), [main], target.name).replace(target)
        seal(target)
    return target
