"""Surroundings: what an FMU may change for everybody in its process is noticed, and put back where it may be: the
working directory, the rounding of numbers, the locale, the response to Ctrl-C, limits of the process, the permissions
of new files and the standard streams. Environment variables and the response to other signals are left as they are: the
FMU may need them, as a virtual machine in it does.

An FMU that leaves another rounding mode behind changes the last digits of every other component, and of Python itself.
"""

from __future__ import annotations

import ctypes
import locale
import math
import os
import platform
import signal
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from types import ModuleType
from typing import Any, NamedTuple

resource: ModuleType | None = None
with suppress(ImportError):  # exists on POSIX systems only
    import resource

FLOATS = "the rounding of floating-point numbers"
PLACE = "the working directory"
CHARACTERS = "the locale of characters"
_LOCALE = "the locale"
_STREAMS = "the standard streams"
_SIGNALS, _VARIABLES = "the response to", "the environment variables"
ENVIRONMENT_BYTES = 256  # more than any fenv_t
MXCSR_AT, _MXCSR_MODES = 28, 0xFFC0  # in glibc's fenv_t of x86-64: rounding, masks, flush to zero, denormals are zero
EVERY = 64
_MOST_NAMED = 5
_ACTION_WORDS = 32  # more than any struct sigaction
_SIGINT = int(signal.SIGINT)
_STANDARD = (0, 1, 2)


class _Aspect(NamedTuple):
    """One thing that is everybody's.

    Attributes:
        change: what became of it, in words, of how it was and how it is; empty where it is as it was.
        read: how it is; None where that cannot be asked.
        put_back: makes it so again.
    """

    change: Callable[[Any, Any], str]
    read: Callable[[], Any]
    put_back: Callable[[Any], object]


class Surroundings:
    """How things are when this is made.

    `put_back` puts them back so, and says what was changed.

    Args:
        whole: also what takes long to read, as long as a small step.
    """

    def __init__(self, *, whole: bool = True) -> None:
        aspects = _ASPECTS + _LONG_ASPECTS if whole else _ASPECTS
        self._before = [(aspect, aspect.read()) for aspect in aspects]
        self._floats = _floats()
        self._saved = ctypes.create_string_buffer(ENVIRONMENT_BYTES)
        if self._floats is not None:
            _library().fegetenv(self._saved)
        self._streams = _Streams()

    def put_back(self) -> list[str]:
        """What has been changed since, in words, and is now as it was."""
        changed = []
        for aspect, before in self._before:
            change = aspect.change(before, aspect.read()) if before is not None else ""
            if change:
                with suppress(OSError, ValueError, locale.Error):
                    aspect.put_back(before)
                changed.append(change)
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
        self._before, self._whole = Surroundings(whole=False), Surroundings()

    def compare(self) -> None:
        """After the first steps, and after every `EVERY`-th call."""
        self._calls += 1
        if self._calls <= 3 or self._calls % EVERY == 0:
            self.changed |= set(self._before.put_back())

    def finish(self) -> set[str]:
        """Put back what the last steps changed; everything that was changed."""
        self.changed |= set(self._before.put_back()) | set(self._whole.put_back())
        return self.changed


class _Streams:
    """The standard streams, kept open under other numbers for as long as this lives."""

    def __init__(self) -> None:
        self._kept = {number: os.dup(number) for number in _STANDARD if _file(number) is not None}

    def put_back(self) -> list[str]:
        changed = [number for number, kept in self._kept.items() if _file(number) != _file(kept)]
        for number in changed:
            os.dup2(self._kept[number], number)
        return [_STREAMS] if changed else []

    def __del__(self) -> None:
        for kept in self._kept.values():
            with suppress(OSError):
                os.close(kept)


def open_files() -> dict[int, tuple[int, int]]:
    """The files that are open in this process, by number; empty where that is not known."""
    with suppress(OSError):
        numbers = map(int, os.listdir("/dev/fd"))  # noqa: PTH208 - names are enough; one is that of the list itself
        return {number: file for number in numbers if (file := _file(number)) is not None}
    return {}


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


def _spoken(before: str, now: str) -> str:
    """What became of the locale: numbers, dates and the order of texts may have changed, or only the characters."""
    return "" if before == now else CHARACTERS if _besides_characters(before) == _besides_characters(now) else _LOCALE


def _besides_characters(name: str) -> str:
    """A locale without its LC_CTYPE: one name where the other categories agree, as C states it where all do."""
    others = [part for part in name.split(";") if not part.startswith("LC_CTYPE=")]
    names = {part.partition("=")[2] or part for part in others}
    return names.pop() if len(names) == 1 else ";".join(others)


def _response() -> _Response | None:
    """What is done at SIGINT, which Python's own module does not know; None where that cannot be asked."""
    action, library = (ctypes.c_void_p * _ACTION_WORDS)(), _library()
    if os.name != "posix" or library is None or library.sigaction(_SIGINT, None, action) != 0:
        return None
    return _Response(action[0] or 0, action)


def _respond(response: _Response) -> None:
    _library().sigaction(_SIGINT, response.action, None)


def _handlers() -> dict[int, int] | None:
    """The address of what is done at each other signal, by its number."""
    library, found = _library(), {}
    if os.name != "posix" or library is None:
        return None
    for number in range(1, signal.SIGSYS + 1):
        if number != _SIGINT and library.sigaction(number, None, _action) == 0:
            found[number] = _action[0] or 0
    return found


def _other_handlers(before: dict[int, int], now: dict[int, int]) -> str:
    names = [signal.Signals(number).name for number, handler in now.items() if before.get(number) != handler]
    return f"{_SIGNALS} {', '.join(names)}" if names else ""


def _variables() -> set[bytes] | None:
    """The environment as C has it, of which Python keeps a copy of its own."""
    if os.name != "posix" or _library() is None:
        return None
    block, found, place = ctypes.POINTER(ctypes.c_char_p).in_dll(_library(), "environ"), set(), 0
    while block and (text := block[place]) is not None:
        found.add(text)
        place += 1
    return found


def _other_variables(before: set[bytes], now: set[bytes]) -> str:
    names = sorted({text.partition(b"=")[0].decode(errors="replace") for text in before ^ now})
    more = f" and {len(names) - _MOST_NAMED} more" if len(names) > _MOST_NAMED else ""
    return f"{_VARIABLES} {', '.join(names[:_MOST_NAMED])}{more}" if names else ""


def _limits() -> dict[int, tuple[float, float]] | None:
    """Soft and hard limits of the process."""
    if resource is None:
        return None
    infinite = {resource.RLIM_INFINITY: math.inf}
    return {n: tuple(infinite.get(x, x) for x in resource.getrlimit(n)) for n in _RESOURCES}


def _lower_limits(before: dict[int, tuple[float, float]], now: dict[int, tuple[float, float]]) -> str:
    lower = [_RESOURCES[n] for n, (soft, hard) in now.items() if soft < before[n][0] or hard < before[n][1]]
    return f"the limits {', '.join(lower)}" if lower else ""


def _raise_limits(before: dict[int, tuple[float, float]]) -> None:
    assert resource is not None
    infinite = {math.inf: resource.RLIM_INFINITY}
    for number, (soft, hard) in before.items():
        with suppress(OSError, ValueError):
            resource.setrlimit(number, (infinite.get(soft, soft), infinite.get(hard, hard)))


def _mask() -> int:
    mask = os.umask(0o077)
    os.umask(mask)
    return mask


def _as_it_was(name: str) -> Callable[[Any, Any], str]:
    return lambda before, now: "" if before == now else name


def _nothing(_before: Any) -> None:
    """It is left as it is."""


def is_left(change: str) -> bool:
    """Whether what was changed is left so.

    Args:
        change: as `Surroundings.put_back` says it.
    """
    return change.startswith((_SIGNALS, _VARIABLES)) and change != _INTERRUPT


_INTERRUPT = f"{_SIGNALS} Ctrl-C"
_ASPECTS = (
    _Aspect(_as_it_was(PLACE), _here, os.chdir),
    _Aspect(_spoken, lambda: locale.setlocale(locale.LC_ALL), _speak),
    _Aspect(_as_it_was(_INTERRUPT), _response, _respond),
    _Aspect(_as_it_was("the permissions of new files"), _mask, os.umask),
)
_LONG_ASPECTS = (
    _Aspect(_other_handlers, _handlers, _nothing),
    _Aspect(_other_variables, _variables, _nothing),
    _Aspect(_lower_limits, _limits, _raise_limits),
)
_action = (ctypes.c_void_p * _ACTION_WORDS)()
_NAMED = (name for name in dir(resource) if name.startswith("RLIMIT_") and name != "RLIMIT_OFILE")
_RESOURCES: dict[int, str] = {getattr(resource, name): name for name in _NAMED}


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
