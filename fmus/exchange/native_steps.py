"""The solver's internal steps in C, where there is a compiler: the same bits as in Python, a tenth of the time. Touches
the cache folder only.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from functools import cache
from importlib.resources import files
from typing import Any

from fmus.exchange.jacobian import DirectionalDerivatives
from fmus.toolchain.cached_library import cached_library
from fmus.toolchain.compile import CompilationError, CompilerMissing, find_compiler
from plant_models.disk_cache.folder import cache_folder

_SOURCE = "steps.c"
REACHED, EVENT, TERMINATE, GAVE_UP, REFUSED, TOO_MANY = range(6)
"""How internal steps ended, in the numbers of ``steps.c``."""


class CExchange(ctypes.Structure):
    """``Exchange`` of ``steps.c``."""

    _fields_ = (
        ("functions", ctypes.c_void_p * 6),
        ("instance", ctypes.c_void_p),
        *((name, ctypes.c_int64) for name in ("version", "states", "indicators")),
        *((name, ctypes.c_void_p) for name in ("array", "set_stop", "step", "last_order", "memory", "x", "absolute")),
        *((name, ctypes.c_double) for name in ("tolerance", "share", "reached")),
        *((name, ctypes.c_int64) for name in ("steps", "flag", "status", "place")),
        ("rates", ctypes.c_int64),
        *((name, ctypes.c_void_p) for name in ("unknowns", "knowns", "sizes", "places", "seed", "columns")),
        *((name, ctypes.c_void_p) for name in ("nominals", "scratch")),
        *((name, ctypes.c_int64) for name in ("unknown_count", "differing", "noted")),
        ("warnings", ctypes.c_int64 * 6),
    )


@cache
def load_steps() -> ctypes.CDLL | None:
    """The library, compiled on the first call ever; None where there is no compiler that can make it."""
    sources = {_SOURCE: (files("fmus.exchange") / _SOURCE).read_bytes()}
    try:
        library = ctypes.CDLL(str(cached_library("exchange", sources, _SOURCE, find_compiler(), cache_folder())))
    except (CompilerMissing, CompilationError, OSError):
        return None
    library.exchange_steps.restype = ctypes.c_int64
    library.exchange_steps.argtypes = [ctypes.c_void_p, ctypes.c_double, ctypes.c_int64]
    return library


def address(function: Any) -> int:
    """Where a function of a library is.

    Args:
        function: as ctypes holds it.
    """
    return ctypes.cast(function, ctypes.c_void_p).value or 0


def describe_model(
    instance: Any,
    functions: Sequence[Any],
    version: int,
    counts: tuple[int, int],
    slopes: DirectionalDerivatives | None = None,
) -> CExchange:
    """The FMU as ``steps.c`` calls it; the solver adds itself.

    Args:
        instance: of the FMU. functions: of its library, in the order of ``steps.c``; None for one that is not called.
        version: of FMI. counts: of states and event indicators. slopes: arguments of its directional derivatives.
    """
    made = CExchange(version=version, states=counts[0], indicators=counts[1])
    if slopes is not None:
        made.unknown_count = len(slopes.unknowns)
        for name in ("unknowns", "knowns", "sizes", "places", "seed", "nominals", "scratch"):
            setattr(made, name, ctypes.addressof(getattr(slopes, name)))
    made.instance = getattr(instance, "value", instance)
    for place, function in enumerate(functions):
        made.functions[place] = None if function is None else address(function)
    return made
