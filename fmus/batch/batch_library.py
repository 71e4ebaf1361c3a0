"""The compiled loop of a batch: `batch.c` around the C of the system's FMU, compiled once and kept in the cache."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from fmus.build import BuildPlan
from fmus.toolchain.cached_library import cached_library
from fmus.toolchain.compile import find_compiler
from plant_models.disk_cache.folder import cache_folder

MAIN = "batch.c"


class Columns(ctypes.Structure):
    """Values of variables by member and instant, as in `batch.c`; a stride of zero repeats what stands there."""

    _fields_ = (
        ("references", ctypes.c_void_p),
        ("count", ctypes.c_int64),
        ("values", ctypes.c_void_p),
        ("member_stride", ctypes.c_int64),
        ("instant_stride", ctypes.c_int64),
    )

    @classmethod
    def of(cls, references: Sequence[int], values: np.ndarray) -> Columns:
        """Columns over an array.

        Args:
            references: value references of the variables.
            values: shape (members, instants, variables), numbers of a row side by side; it must stay as long as the
                columns. A broadcast axis has a stride of zero.
        """
        numbers = np.array(references, dtype=np.uint32)
        strides = (values.strides[0] // 8, values.strides[1] // 8)
        columns = cls(numbers.ctypes.data, len(numbers), values.ctypes.data, *strides)
        columns.kept = numbers, values
        return columns

    kept: Any


class BatchEvents(ctypes.Structure):
    """Events of all members, sorted by member and stamp, as in `batch.c`."""

    _fields_ = (
        ("kind", ctypes.c_void_p),
        ("stamp", ctypes.c_void_p),
        ("payload", ctypes.c_void_p),
        ("stride", ctypes.c_int64),
    )


def load_batch(plan: BuildPlan) -> ctypes.CDLL:
    """The library of a system's batch, compiled on the first call ever.

    Args:
        plan: of the system's FMU.

    Raises:
        CompilerMissing: no C compiler was found.
        CompilationError: the compiler refused the sources.
        OSError: the cache folder cannot be written, or the library not be loaded.
    """
    sources = plan.source_files() | plan.header_files() | {MAIN: (files("fmus.batch") / MAIN).read_bytes()}
    path = cached_library(f"{plan.system.name}_batch", sources, MAIN, find_compiler(), cache_folder())
    return _declared(path)


def _declared(path: Path) -> ctypes.CDLL:
    library = ctypes.CDLL(str(path))
    batch, number, columns = ctypes.c_void_p, ctypes.c_int64, ctypes.POINTER(Columns)
    declarations: dict[str, tuple[Any, ...]] = {
        "batch_create": (batch, number),
        "batch_free": (None, batch),
        "batch_reset": (None, batch),
        "batch_start": (None, batch, ctypes.c_double),
        "batch_message": (ctypes.c_char_p, batch),
        "batch_failure": (ctypes.c_char_p, batch, number),
        "batch_set": (number, batch, columns),
        "batch_get": (None, batch, columns),
        "batch_schedule": (None, batch, ctypes.c_void_p, ctypes.POINTER(BatchEvents)),
        "batch_next_event": (number, batch, number),
        "batch_run": (None, batch, number, number, ctypes.c_void_p, number, columns, columns),
    }
    for name, (result, *arguments) in declarations.items():
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments
    return library
