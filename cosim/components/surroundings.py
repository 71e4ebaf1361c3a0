"""Surroundings: what an FMU may change for everybody in its process, working directory and rounding of numbers, is put
back.

An FMU that leaves another rounding mode behind changes the last digits of every other component, and of Python itself.
"""

from __future__ import annotations

import ctypes
import os
import platform
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

FLOATS = "the rounding of floating-point numbers"
PLACE = "the working directory"
ENVIRONMENT_BYTES = 256  # more than any fenv_t
MXCSR_AT, _MXCSR_MODES = 28, 0xFFC0  # in glibc's fenv_t of x86-64: rounding, masks, flush to zero, denormals are zero
EVERY = 64


class Surroundings:
    """How things are when this is made.

    `put_back` puts them back so, and says what was changed.
    """

    def __init__(self) -> None:
        self._folder = _here()
        self._floats = _floats()
        self._saved = ctypes.create_string_buffer(ENVIRONMENT_BYTES)
        if self._floats is not None:
            _library().fegetenv(self._saved)

    def put_back(self) -> list[str]:
        """What has been changed since, and is now as it was: any of `PLACE` and `FLOATS`."""
        changed = []
        if self._folder is not None and _here() != self._folder:
            with suppress(OSError):
                os.chdir(self._folder)
            changed.append(PLACE)
        if _floats() != self._floats:
            _library().fesetenv(self._saved)
            changed.append(FLOATS)
        return changed


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


def _here() -> str | None:
    try:
        return str(Path.cwd())
    except OSError:  # it was removed
        return None


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
