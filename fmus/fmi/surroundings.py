"""Surroundings: what an FMU may change for everybody in its process is put back: the working directory, the rounding of
numbers, the locale, the response to Ctrl-C and the standard streams.

An FMU that leaves another rounding mode behind changes the last digits of every other component, and of Python itself.
"""

from __future__ import annotations

import ctypes
import locale
import os
import platform
import signal
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from typing import Any, NamedTuple

FLOATS = "the rounding of floating-point numbers"
PLACE = "the working directory"
_LOCALE = "the locale"
_INTERRUPT = "the response to Ctrl-C"
_STREAMS = "the standard streams"
ENVIRONMENT_BYTES = 256  # more than any fenv_t
MXCSR_AT, _MXCSR_MODES = 28, 0xFFC0  # in glibc's fenv_t of x86-64: rounding, masks, flush to zero, denormals are zero
EVERY = 64
_ACTION_WORDS = 32  # more than any struct sigaction
_SIGINT = int(signal.SIGINT)
_OUTPUTS = (1, 2)


class _Aspect(NamedTuple):
    """One thing that is everybody's.

    Attributes:
        name: in words. read: how it is; None where that cannot be asked. put_back: makes it so again.
    """

    name: str
    read: Callable[[], Any]
    put_back: Callable[[Any], object]


class Surroundings:
    """How things are when this is made.

    `put_back` puts them back so, and says what was changed.
    """

    def __init__(self) -> None:
        self._before = [(aspect, aspect.read()) for aspect in _ASPECTS]
        self._floats = _floats()
        self._saved = ctypes.create_string_buffer(ENVIRONMENT_BYTES)
        if self._floats is not None:
            _library().fegetenv(self._saved)
        self._streams = _Streams()

    def put_back(self) -> list[str]:
        """What has been changed since, in words, and is now as it was."""
        changed = []
        for aspect, before in self._before:
            if before is not None and aspect.read() != before:
                with suppress(OSError, ValueError, locale.Error):
                    aspect.put_back(before)
                changed.append(aspect.name)
        if _floats() != self._floats:
            _library().fesetenv(self._saved)
            changed.append(FLOATS)
        return changed + self._streams.put_back()


class SurroundingsOfSteps:
    """Puts things back between steps, now and then: it would cost more than a small step.

    `changed` is what was changed so far.
    """

    def __init__(self) -> None:
        self.changed: set[str] = set()
        self._calls = 0
        self._before = Surroundings()

    def compare(self) -> None:
        """After the first steps, and after every `EVERY`-th call."""
        self._calls += 1
        if self._calls <= 3 or self._calls % EVERY == 0:
            self.changed |= set(self._before.put_back())

    def finish(self) -> set[str]:
        """Put back what the last steps changed; everything that was changed."""
        self.changed |= set(self._before.put_back())
        return self.changed


class _Streams:
    """The standard output and error stream, kept open under other numbers for as long as this lives."""

    def __init__(self) -> None:
        self._kept = {number: os.dup(number) for number in _OUTPUTS if _file(number) is not None}

    def put_back(self) -> list[str]:
        changed = [number for number, kept in self._kept.items() if _file(number) != _file(kept)]
        for number in changed:
            os.dup2(self._kept[number], number)
        return [_STREAMS] if changed else []

    def __del__(self) -> None:
        for kept in self._kept.values():
            with suppress(OSError):
                os.close(kept)


def _file(number: int) -> tuple[int, int] | None:
    """What an open file is, by device and place on it; None of one that is closed."""
    try:
        status = os.fstat(number)
    except OSError:
        return None
    return status.st_dev, status.st_ino


def _here() -> str | None:
    try:
        return os.getcwd()  # noqa: PTH109 - in a third of the time, before and after many calls
    except OSError:  # it was removed
        return None


@dataclass(frozen=True)
class _Response:
    """What C does at a signal.

    Args:
        handler: its address, which C's structure begins with. action: the structure.
    """

    handler: int
    action: Any = field(compare=False)


def _speak(name: str) -> None:
    locale.setlocale(locale.LC_ALL, name)


def _response() -> _Response | None:
    """What is done at SIGINT, which Python's own module does not know; None where that cannot be asked."""
    action, library = (ctypes.c_void_p * _ACTION_WORDS)(), _library()
    if os.name != "posix" or library is None or library.sigaction(_SIGINT, None, action) != 0:
        return None
    return _Response(action[0] or 0, action)


def _respond(response: _Response) -> None:
    _library().sigaction(_SIGINT, response.action, None)


_ASPECTS = (
    _Aspect(PLACE, _here, os.chdir),
    _Aspect(_LOCALE, lambda: locale.setlocale(locale.LC_ALL), _speak),
    _Aspect(_INTERRUPT, _response, _respond),
)


@cache
def _library() -> Any:
    """The C library, where it knows of rounding modes."""
    for name in (None, "libm.so.6"):
        with suppress(OSError, AttributeError, TypeError):
            library = ctypes.CDLL(name)
            if library.fegetround and library.fegetenv and library.fesetenv:
                return library
    return None


@cache
def _has_mxcsr() -> bool:
    return platform.machine() in ("x86_64", "AMD64") and platform.libc_ver()[0] == "glibc"


def _floats() -> tuple[int, int] | None:
    """What decides how numbers are rounded; None where that cannot be asked."""
    library = _library()
    if library is None:
        return None
    modes = 0
    if _has_mxcsr():
        environment = (ctypes.c_uint32 * (ENVIRONMENT_BYTES // 4))()
        library.fegetenv(environment)
        modes = environment[MXCSR_AT // 4] & _MXCSR_MODES
    return int(library.fegetround()), modes
