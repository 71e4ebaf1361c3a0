"""A model exchange FMU moved in C, where there is a compiler: the same bits as in Python, a tenth of the time. Touches
the cache folder only.
"""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from enum import IntEnum
from functools import cache
from importlib.resources import files
from typing import Any

from fmus.exchange.jacobian import DirectionalDerivatives
from fmus.fmi.standard import MAX_EVENT_ITERATIONS, MAX_RETURNS_PER_STEP, NEVER, TIME_TOLERANCE
from fmus.toolchain.cached_library import cached_library
from fmus.toolchain.compile import CompilationError, CompilerMissing, find_compiler
from plant_models.disk_cache.folder import cache_folder

_MAIN, _SOURCES = "motion.c", ("motion.c", "steps.c")
_MOST_AT_ONCE = 100
"""Events each within a billionth of a second of the one before it: a model that has more does not settle."""

_MOST_STEPS = 1_000_000
"""Internal steps of the solver in one communication step."""

ROUNDING = 4e-16
"""What the number of an instant loses, relative."""

_CALLS = 11


class MotionEnd(IntEnum):
    """How a step ended, in the numbers of ``steps.c``."""

    REACHED = 0
    EVENT = 1
    TERMINATE = 2
    GAVE_UP = 3
    REFUSED = 4
    TOO_MANY = 5
    NO_TIME = 6
    UNSETTLED = 7
    CHATTERS = 8
    EVENTS = 9
    BACK = 10

    def words(self, at: CExchange, until: float, last: str) -> str:
        """Why it did not end.

        Args:
            at: where it stands. until: where it was to end [s]. last: the last event in words.
        """
        t = f"t = {at.reached:.12g} s"
        match self:
            case MotionEnd.BACK:
                return f"a step from {t} back to {until:.12g} s"
            case MotionEnd.NO_TIME:
                return "the FMU says that the next event is at t = nan"
            case MotionEnd.UNSETTLED:
                return f"discrete states do not settle in {at.most_iterations} updates"
            case MotionEnd.EVENTS:
                return f"at {t}: {at.most_events} events in one communication step, the last of them {last}"
            case MotionEnd.CHATTERS:
                return (
                    f"events do not settle at {t}: {at.at_once} of them, each within {TIME_TOLERANCE:g} s of the one "
                    f"before it, the last {last} (a model that chatters, or a ball that bounces faster and faster)"
                )
        return f"at {t}: the solver takes more than {at.most_steps} steps in one communication step"


class EventInfo3(ctypes.Structure):
    """What an FMU of FMI 3 says at the end of an event iteration."""

    _fields_ = (
        *((name, ctypes.c_bool) for name in ("again", "terminate", "nominals", "values", "defined")),
        ("next_time", ctypes.c_double),
    )


class CExchange(ctypes.Structure):
    """``Exchange`` of ``steps.c``: an FMU, its solver, and where it stands. Python keeps its own motion there too."""

    _fields_ = (
        ("functions", ctypes.c_void_p * _CALLS),
        ("instance", ctypes.c_void_p),
        *((name, ctypes.c_int64) for name in ("version", "states", "indicators")),
        *((name, ctypes.c_void_p) for name in ("array", "begin", "set_stop", "step", "last_order", "memory", "x")),
        ("absolute", ctypes.c_void_p),
        *((name, ctypes.c_double) for name in ("tolerance", "share", "first_share", "reached")),
        *((name, ctypes.c_int64) for name in ("steps", "flag", "status", "place")),
        ("rates", ctypes.c_int64),
        *((name, ctypes.c_void_p) for name in ("unknowns", "knowns", "sizes", "places", "seed", "columns")),
        *((name, ctypes.c_void_p) for name in ("nominals", "scratch")),
        *((name, ctypes.c_int64) for name in ("unknown_count", "differing", "noted")),
        ("warnings", ctypes.c_int64 * _CALLS),
        *((name, ctypes.c_double) for name in ("next_event", "last_event")),
        *((name, ctypes.c_int64) for name in ("events", "at_once")),
        *((name, ctypes.c_int64) for name in ("most_steps", "most_iterations", "most_events", "most_at_once")),
        *((name, ctypes.c_double) for name in ("tolerated", "rounding")),
        *((name, ctypes.c_bool) for name in ("in_event_mode", "terminated", "anew", "nominals_known")),
        *((name, ctypes.c_bool) for name in ("rooted", "met", "returns", "elsewhere", "event", "end")),
        *((name, ctypes.c_void_p) for name in ("info",)),
        *((name, ctypes.c_double) for name in ("arrived", "length")),
        *((name, ctypes.c_void_p) for name in ("otherwise", "proceed")),
    )

    def __init__(self) -> None:
        super().__init__(elsewhere=True, next_event=NEVER, last_event=-NEVER, tolerated=TIME_TOLERANCE)
        self.rounding, self.most_steps, self.most_iterations = ROUNDING, _MOST_STEPS, MAX_EVENT_ITERATIONS
        self.most_events, self.most_at_once = MAX_RETURNS_PER_STEP, _MOST_AT_ONCE


class SharedField:
    """An attribute that stands in the structure `at` of its object, where C finds it.

    Args:
        name: of the field. meaning: what is said of it.
    """

    def __init__(self, name: str, meaning: str) -> None:
        self._name, self.__doc__ = name, meaning

    def __get__(self, one: Any, _of: type | None = None) -> Any:
        return self if one is None else getattr(one.at, self._name)

    def __set__(self, one: Any, value: Any) -> None:
        setattr(one.at, self._name, value)


class CSent(ctypes.Structure):
    """``Sent`` of ``motion.c``: what variables were last set to by one function."""

    _fields_ = (
        *((name, ctypes.c_void_p) for name in ("exchange", "function", "otherwise", "content")),
        ("bytes", ctypes.c_int64),
        ("known", ctypes.c_bool),
    )


@cache
def load_steps() -> ctypes.CDLL | None:
    """The library, compiled on the first call ever; None where there is no compiler that can make it."""
    sources = {name: (files("fmus.exchange") / name).read_bytes() for name in _SOURCES}
    try:
        library = ctypes.CDLL(str(cached_library("exchange", sources, _MAIN, find_compiler(), cache_folder())))
    except (CompilerMissing, CompilationError, OSError):
        return None
    library.exchange_advance.restype = ctypes.c_int64
    library.exchange_advance.argtypes = [ctypes.c_void_p, ctypes.c_double, ctypes.c_double, ctypes.c_bool]
    return library


def address(function: Any) -> int:
    """Where a function of a library is.

    Args:
        function: as ctypes holds it.
    """
    return ctypes.cast(function, ctypes.c_void_p).value or 0


def describe_model(
    made: CExchange,
    instance: Any,
    functions: Mapping[int, Any],
    version: int,
    counts: tuple[int, int],
    slopes: DirectionalDerivatives | None = None,
) -> None:
    """Fill in the FMU as C calls it; the solver adds itself.

    Args:
        made: what is filled. instance: of the FMU.
        functions: of its library, by their places in ``steps.c``; one that is not called is left out.
        version: of FMI. counts: of states and event indicators. slopes: arguments of its directional derivatives.
    """
    made.version, (made.states, made.indicators) = version, counts
    if slopes is not None:
        made.unknown_count = len(slopes.unknowns)
        for name in ("unknowns", "knowns", "sizes", "places", "seed", "nominals", "scratch"):
            setattr(made, name, ctypes.addressof(getattr(slopes, name)))
    made.instance = getattr(instance, "value", instance)
    for place in range(_CALLS):
        function = functions.get(place)
        made.functions[place] = None if function is None else address(function)
