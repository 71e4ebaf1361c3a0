"""The watch: a command runs in a process of its own, and this one reports what an FMU did to it. Standard library only.

The process is forked before anything large is loaded, so this one costs milliseconds and a few megabytes. It hands
signals on, ends a call that takes too long, and keeps what was computed when the other one is gone.
"""

from __future__ import annotations

import atexit
import errno
import json
import os
import select
import signal
import sys
from collections.abc import Callable
from contextlib import suppress
from time import monotonic
from typing import Any

from cosim.process.call_clock import CallClock
from cosim.process.crashes import remember_crash
from cosim.process.interruption import STOPPING
from cosim.process.last_call import LAST_CALL

ERROR = 2
_POLL = 0.1
"""How often is looked at the other process [s]."""

GRACE = 3.0
"""A call that has not returned so long after Ctrl-C is ended with its process [s]."""

_CLOSED = 256
"""Said in place of an exit code where what the process had opened was closed by somebody else."""
_FROM_OUTSIDE = (-signal.SIGTERM, -signal.SIGINT, -9)
"""Ends of a process that are no deed of an FMU: SIGTERM, SIGINT, SIGKILL."""
_PARENT_DEATH = 1  # prctl: PR_SET_PDEATHSIG


def can_watch() -> bool:
    """Whether this platform has what is needed; Windows has not."""
    return hasattr(os, "fork") and hasattr(os, "waitpid")


def watched(command: Callable[[], int]) -> int:
    """The exit code of a command that runs in a process of its own; 2 where an FMU ended that process.

    Args:
        command: returns its exit code. In its process this function returns as well, or raises what the command raises.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    signal.pthread_sigmask(signal.SIG_BLOCK, STOPPING)
    parent = os.getpid()
    child = os.fork()
    if child == 0:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, STOPPING)
        return _run(command, parent)
    return _Watch(child).wait()


def _run(command: Callable[[], int], parent: int) -> int:
    LAST_CALL.watched = LAST_CALL.timed = True
    atexit.register(_leave)  # registered first, called last
    _end_with(parent)
    code = 1  # of a program that ends with a traceback
    streams = _open_streams()
    try:
        code = command()
    except OSError as error:
        if error.errno != errno.EBADF:
            raise
        code = _CLOSED
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
        raise
    finally:
        if _open_streams() < streams:
            code = _CLOSED
        LAST_CALL.end(code)
        if code == _CLOSED:
            os._exit(ERROR)  # nothing more can be said from here
    return code


def _leave() -> None:
    """End as C programs end, without taking apart what Python has loaded: a tenth of a short command. What FMUs and
    their libraries do when a program ends is done.
    """
    try:
        sys.stdout.flush()
        sys.stderr.flush()
    except (OSError, ValueError):  # Python says so in its own words
        return
    _c_library().exit(LAST_CALL.exit_code)


def _c_library() -> Any:
    """The functions of C; while one is called no other thread runs."""
    import ctypes  # noqa: PLC0415 - the watching process does without

    return ctypes.PyDLL(None)


def _open_streams() -> set[int]:
    """Which of the standard streams for output are open."""
    found = set()
    for number in (1, 2):
        with suppress(OSError):
            os.fstat(number)
            found.add(number)
    return found


def _end_with(parent: int) -> None:
    """When the process that watches is gone, this one ends too, whatever an FMU is doing: Linux only. What was recorded
    lies in the folder that is streamed to, and is found there.
    """
    if sys.platform != "linux":
        return
    _c_library().prctl(_PARENT_DEATH, signal.SIGKILL, 0, 0, 0)
    if os.getppid() != parent:
        os.kill(os.getpid(), signal.SIGKILL)


class _Watch:
    """One process that is looked at."""

    def __init__(self, child: int) -> None:
        self.child = child
        self._asked: float | None = None
        self._clock = CallClock(LAST_CALL)
        self._why = ""

    def wait(self) -> int:
        """The exit code, after everything that is to be reported has been reported."""
        status = self._status()
        for number in STOPPING:
            signal.signal(number, signal.SIG_IGN)  # what is kept now is kept quickly
        code = LAST_CALL.exit_code
        if code is not None and code != _CLOSED:
            return code
        reason = _who_closed() if code == _CLOSED else self._reason(status)
        if sys.stderr.isatty():
            print(file=sys.stderr)  # there may be a progress bar
        print(f"cosim: {reason}.", file=sys.stderr)
        self._keep(reason)
        return ERROR

    def _reason(self, status: int) -> str:
        """Why a process ended that did not come to its end as it should."""
        where = LAST_CALL.words()
        code = os.waitstatus_to_exitcode(status)
        what = self._why or _how_it_ended(code)
        if self._asked is None and (self._why or code not in _FROM_OUTSIDE):
            remember_crash(LAST_CALL, what)
        return f"{where} {what}" if where else f"the program {what}, in no call of an FMU"

    def _status(self) -> int:
        """Look at the other process until it ends; how it did."""
        read, write = os.pipe()
        os.set_blocking(read, False)
        os.set_blocking(write, False)
        signal.set_wakeup_fd(write, warn_on_full_buffer=False)
        for number in (signal.SIGCHLD, *STOPPING):
            if number == signal.SIGCHLD or signal.getsignal(number) != signal.SIG_IGN:
                signal.signal(number, self._hear)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, STOPPING)
        while True:
            ended, status = os.waitpid(self.child, os.WNOHANG)
            if ended:
                signal.set_wakeup_fd(-1)
                return status
            begin = monotonic()
            if select.select([read], [], [], _POLL)[0]:
                with suppress(BlockingIOError):
                    os.read(read, 4096)
            self._check_duration(
                min(monotonic() - begin, 2.0 * _POLL)
            )  # no longer: this program may have been stopped meanwhile

    def _hear(self, number: int, _frame: Any) -> None:
        if number == signal.SIGCHLD:
            return
        self._asked = monotonic() if self._asked is None else self._asked
        with suppress(ProcessLookupError):
            os.kill(self.child, number)

    def _check_duration(self, elapsed: float) -> None:
        """End the process where its present call takes too long; `elapsed` since the last check [s]."""
        self._clock.add(elapsed)
        if why := self._clock.over_limit:
            self._end(why)
        elif self._asked is not None and min(self._clock.seconds, monotonic() - self._asked) > GRACE:
            self._end("does not return; the run was interrupted, and its process ended")

    def _end(self, why: str) -> None:
        self._why = self._why or why
        with suppress(ProcessLookupError):
            os.kill(self.child, signal.SIGKILL)

    def _keep(self, reason: str) -> None:
        """Keep what was computed, and say where."""
        note = json.loads(LAST_CALL.noted or "{}")
        if "fallback" in note:
            from cosim.results.salvage import salvage  # noqa: PLC0415 - only here is anything large needed

            print(salvage(note, reason), file=sys.stderr)
        elif "written" in note:
            print(f"The results were written before: {note['written']}", file=sys.stderr)


def _who_closed() -> str:
    names = list(map(repr, LAST_CALL.code_of_others))
    who = f"the FMU of component {names[0]}" if len(names) == 1 else f"an FMU ({', '.join(names)})"
    more = "" if len(names) == 1 else ". 'fmus check' finds which FMU, and isolate = 'component' keeps it"
    return f"{who} closed files that this program had open: its standard streams, or its results{more}"


def _how_it_ended(code: int) -> str:
    if code >= 0:
        return f"ended the program with exit code {code}; it must not call exit"
    try:
        name = signal.Signals(-code).name
    except ValueError:
        name = f"signal {-code}"
    more = " (from outside: perhaps the memory ran out)" if -code == signal.SIGKILL else ""
    return f"ended with {name}{more}"
