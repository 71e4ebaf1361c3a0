"""The library of the stepper: compiled once with the tool chain of the exports, cached, loaded. Touches the cache
folder only.
"""

from __future__ import annotations

import ctypes
from functools import cache
from importlib.resources import files
from pathlib import Path

from fmus.toolchain.cached_library import cached_library
from fmus.toolchain.compile import Compiler, find_compiler
from plant_models.disk_cache.folder import cache_folder

SOURCES = (
    "stepper.c",
    "turns.c",
    "balises.c",
    "notifying.c",
    "slave.c",
    "recording.c",
    "stepper.h",
)  # the first one includes the others


def load_stepper() -> ctypes.CDLL:
    """The stepper's library, compiled on the first call ever and loaded once in a process.

    Raises:
        CompilerMissing: no C compiler was found.
        CompilationError: the compiler refused the sources.
        OSError: the cache folder cannot be written, or the library not be loaded.
    """
    return _loaded(_stepper_library(find_compiler(), cache_folder()))


def _stepper_library(compiler: Compiler, folder: Path) -> Path:
    """Path of the library in a cache folder, built there where it is missing.

    Args:
        compiler: that builds the library.
    """
    sources = {name: (files("cosim.compiled") / name).read_bytes() for name in SOURCES}
    return cached_library("stepper", sources, SOURCES[0], compiler, folder)


@cache
def _loaded(path: Path) -> ctypes.CDLL:
    library = ctypes.CDLL(str(path))
    library.stepper_run.restype = ctypes.c_int64
    library.stepper_run.argtypes = [
        ctypes.c_void_p,
        ctypes.c_int64,
        ctypes.c_int64,
        ctypes.c_void_p,
        ctypes.c_int64,
    ]
    library.stepper_move.restype = ctypes.c_int64
    library.stepper_move.argtypes = [ctypes.c_void_p, ctypes.c_int64, ctypes.c_double, ctypes.c_double, ctypes.c_int64]
    library.stepper_part.restype = ctypes.c_int64
    library.stepper_part.argtypes = [ctypes.c_void_p, ctypes.c_double, ctypes.c_double, ctypes.c_void_p]
    library.stepper_deliver.restype = ctypes.c_int64
    library.stepper_deliver.argtypes = [ctypes.c_void_p, ctypes.c_int64, ctypes.c_void_p, ctypes.c_void_p]
    return library
