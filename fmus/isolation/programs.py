"""The proxy and the program of an isolated FMU: compiled once, kept in the cache folder. Touches that folder only."""

from __future__ import annotations

import platform
import sys
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import NamedTuple

from fmus.toolchain.cached_library import cached_library, cached_program
from fmus.toolchain.compile import CompilationError, CompilerMissing, find_compiler
from plant_models.disk_cache.folder import cache_folder

_SHARED = ("shared.h", "functions.h")
_PROXY = ("proxy.c", "session.h", "requests.h", "reading_ahead.h", "interruption.h", "pacing.h", *_SHARED)
_CHILD = ("child.c", "supervisor.h", "callbacks.h", *_SHARED)  # of each the first one includes the others


class IsolationUnavailable(RuntimeError):  # noqa: N818 - says what is the matter better than with a suffix
    """FMUs cannot be isolated here; the message says why."""


class IsolationPrograms(NamedTuple):
    """Where the compiled files are.

    Attributes:
        proxy: library with the functions of FMI. child: program in which the FMU runs.
    """

    proxy: Path
    child: Path


def isolation_programs() -> IsolationPrograms:
    """The compiled files, compiled on the first call ever.

    Raises:
        IsolationUnavailable: this platform has no such processes, there is no compiler, or it refuses.
    """
    return _programs(cache_folder())


@cache
def _programs(folder: Path) -> IsolationPrograms:
    machine = platform.machine().lower()
    if sys.platform != "linux" or machine not in ("x86_64", "amd64", "aarch64", "arm64"):
        raise IsolationUnavailable(
            f"FMUs get processes of their own on Linux with x86-64 or aarch64 (here: {sys.platform}, {machine})"
        )
    try:
        compiler = find_compiler()
        return IsolationPrograms(
            cached_library("isolation", _sources(_PROXY), _PROXY[0], compiler, folder),
            cached_program("isolated", _sources(_CHILD), _CHILD[0], compiler, folder),
        )
    except (CompilerMissing, CompilationError, OSError) as error:
        raise IsolationUnavailable(f"what FMUs in processes of their own need cannot be compiled: {error}") from error


def _sources(names: tuple[str, ...]) -> dict[str, bytes]:
    return {name: (files("fmus.isolation") / name).read_bytes() for name in names}
