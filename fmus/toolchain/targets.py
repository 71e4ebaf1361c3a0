"""Targets: which compiler builds for which platform, and the libraries of all of them from one set of sources."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from fmus.toolchain.compile import Compiler, compile_library, cross_compiler, find_compiler
from fmus.toolchain.platforms import HOST, PLATFORMS, Platform, host_platform, platform_names
from plant_models.left_behind import owned

Progress = Callable[[str], None]
"""Called with the name of each platform whose library is done."""


@dataclass(frozen=True)
class Target:
    """A platform and the compiler that builds for it."""

    platform: Platform
    compiler: Compiler


def choose_targets(platforms: str | Sequence[str] = HOST) -> tuple[Target, ...]:
    """Targets by name: ``host`` is built by the system's compiler, everything named by the cross compiler.

    So a named platform has the same bytes whatever machine it is built on. Where ``host`` and this machine's own name
    are both given, the one named first counts.

    Args:
        platforms: see `fmus.toolchain.platforms.platform_names`.

    Raises:
        PlatformError: a platform is unknown.
        CompilerMissing: the compiler for one of them is missing; the message says what to install.
    """
    targets: dict[Platform, Target] = {}
    for name in platform_names(platforms):
        platform = host_platform() if name == HOST else PLATFORMS[name]
        if platform not in targets:
            targets[platform] = Target(platform, find_compiler() if name == HOST else cross_compiler(platform))
    return tuple(targets.values())


def compile_targets(
    targets: Sequence[Target],
    files: Mapping[str, bytes],
    sources: Sequence[str],
    identifier: str,
    progress: Progress | None = None,
) -> dict[Platform, bytes]:
    """The shared libraries of all targets, as many at a time as there are processors.

    Args:
        targets: see `choose_targets`.
        files: C files and headers by name.
        sources: names of the files to compile.
        identifier: model identifier; the name of the libraries.
        progress: called after each library.

    Returns:
        Library by platform, in the order of the targets.

    Raises:
        CompilationError: a compiler refused the sources.
    """

    def build(target: Target) -> bytes:
        library = _library(target, files, sources, identifier)
        if progress is not None:
            progress(target.platform.name)
        return library

    if len(targets) == 1:  # in this thread, so that an interruption is felt at once
        return {targets[0].platform: build(targets[0])}
    with ThreadPoolExecutor(min(len(targets), os.cpu_count() or 1)) as pool:
        return dict(zip((t.platform for t in targets), pool.map(build, targets), strict=True))


def _library(target: Target, files: Mapping[str, bytes], sources: Sequence[str], identifier: str) -> bytes:
    with tempfile.TemporaryDirectory(prefix=owned("fmus-")) as name:
        folder = Path(name)
        for source, text in files.items():
            (folder / source).write_bytes(text)
        file = f"{identifier}{target.platform.extension}"
        return compile_library(target.compiler, folder, sources, file).read_bytes()
