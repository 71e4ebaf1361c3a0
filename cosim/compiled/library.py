"""The library of the stepper: compiled once with the tool chain of the exports, cached, loaded. Touches the cache
folder only.
"""

from __future__ import annotations

import ctypes
import hashlib
import tempfile
from functools import cache
from importlib.resources import files
from pathlib import Path

from fmus.toolchain.compile import Compiler, compile_library, find_compiler, library_name
from plant_models.disk_cache.files import is_sealed, seal
from plant_models.disk_cache.folder import cache_folder

SOURCES = ("stepper.c", "balises.c", "notifying.c", "slave.c", "stepper.h")  # the first one includes the others


def load_stepper() -> ctypes.CDLL:
    """The stepper's library, compiled on the first call ever and loaded once in a process.

    Raises:
        CompilerMissing: no C compiler was found.
        CompilationError: the compiler refused the sources.
        OSError: the cache folder cannot be written, or the library not be loaded.
    """
    return _loaded(cached_library(find_compiler(), cache_folder()))


def cached_library(compiler: Compiler, folder: Path) -> Path:
    """Path of the library in a cache folder; built there where it is missing, in one move, so that nothing is to be
    locked.
    """
    sources = {name: (files("cosim.compiled") / name).read_bytes() for name in SOURCES}
    digest = hashlib.sha256(b"\0".join([compiler.identity().encode(), *sources.values()])).hexdigest()[:32]
    target = folder / f"stepper-{digest}" / library_name("stepper")
    if not is_sealed(target):  # to load a part of a library can end the process
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix="build-", dir=target.parent) as scratch:
            for name, text in sources.items():
                (Path(scratch) / name).write_bytes(text)
            compile_library(compiler, Path(scratch), ["stepper.c"], target.name).replace(target)
        seal(target)
    return target


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
    library.stepper_tell.restype = ctypes.c_int64
    library.stepper_tell.argtypes = [ctypes.c_void_p, ctypes.c_int64, ctypes.c_void_p, ctypes.c_void_p]
    return library
