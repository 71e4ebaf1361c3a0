"""The guard of exits: an FMU that calls exit() ends no script, and no test, as if all were well. For processes that
nobody watches.

The C library calls it when somebody exits while Python is at work. It also ends a call that takes too long. Imports the
standard library only.
"""

from __future__ import annotations

import atexit
import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache

from cosim.process.call_clock import CallClock
from cosim.process.crashes import remember_crash
from cosim.process.last_call import LAST_CALL

ERROR = 2
_ENDING = 30.0
_CALL = 600.0
"""Longest times of a call where nothing else is said [s]: one that ends an FMU after the run, and any other."""
_output = [2]


def report_to_copy_of_stderr() -> int:
    """From now on it writes to what is the error stream now, also if that is captured later; returns the
    descriptor.
    """
    _output[0] = os.dup(2)
    return _output[0]


@cache
def guard_exit() -> None:
    """From now on exit() in a call of an FMU ends this process with code 2, and with words; once for a process.

    What the FMU calls is C's exit(): against _exit() only another process helps. Where the C library offers no way to
    be asked (Windows) nothing is done.
    """
    import ctypes  # noqa: PLC0415 - a plugin of pytest imports this module at every start

    library = ctypes.CDLL(None) if os.name == "posix" else None
    add, remove = (getattr(library, name, None) for name in ("__cxa_atexit", "__cxa_finalize"))
    if add is None or remove is None or LAST_CALL.watched:
        return
    mark = ctypes.c_char()  # by its address the C library knows which handler to remove
    handler = ctypes.CFUNCTYPE(None, ctypes.c_void_p)(lambda _: _exit_called())
    add(handler, None, ctypes.byref(mark))

    def leave() -> None:  # when Python ends, nobody could answer any more
        LAST_CALL.call[0] = 0
        remove(ctypes.byref(mark))

    leave.kept = handler, mark  # type: ignore[attr-defined]
    atexit.register(leave)


def _exit_called() -> None:
    if LAST_CALL.call[0]:
        _give_up("ended the program by calling exit(), which an FMU must not do")


@contextmanager
def limited_calls(seconds: float | None, *, ends: bool = False) -> Iterator[None]:
    """Within this context a call may last so long. A process that does not return is ended with code 2. Afterwards the
    limit of before holds.

    Args:
        seconds: longest time a call may take [s]; inf for any, None for ten minutes.
        ends: these are calls that end FMUs, before which everything was written: None stands for half a minute.
    """
    if seconds is None:
        seconds = _ENDING if ends else _CALL
    before, over = LAST_CALL.seconds_at_most, threading.Event()
    LAST_CALL.limit(seconds)
    if not LAST_CALL.timed and not before:  # else somebody keeps the time already
        threading.Thread(target=_keep_time, args=(seconds, over), daemon=True).start()
    try:
        yield
    finally:
        over.set()
        LAST_CALL.limit(before)


def _keep_time(seconds: float, over: threading.Event) -> None:
    clock, pause = CallClock(LAST_CALL), min(0.1, seconds / 4.0)
    while not over.wait(pause):
        clock.add(pause)
        if why := clock.over_limit:
            _give_up(why)


def _give_up(what: str) -> None:
    """Say what happened, and end the process: there is no way back out of the call."""
    test = os.environ.get("PYTEST_CURRENT_TEST", "")
    reason = f"{LAST_CALL.words()} {what}" + (f", in the test {test}" if test else "")
    LAST_CALL.note(reason)
    remember_crash(LAST_CALL, what)
    with suppress(OSError):
        os.write(_output[0], f"\ncosim: {reason}.\n".encode(errors="replace"))
    os._exit(ERROR)
