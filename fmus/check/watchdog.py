"""The watchdog: the process between a check and its worker; it counts what the FMU starts, and leaves nothing of it
running.

Started by `fmus.check.isolated` as ``python -m fmus.check.watchdog PROCESSES BYTES``. It forks: the child becomes the
worker, in a session of its own; what any descendant leaves behind becomes a child of the watchdog (on Linux), so that
nothing escapes by forking twice. Its last line says how the worker ended. Where there is no fork, the worker runs here,
unwatched.
"""

from __future__ import annotations

import ctypes
import json
import os
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

PERIOD = 0.05
"""Between two counts [s]."""

LAST = 5.0
"""Time for ending all descendants [s]."""

_PR_SET_CHILD_SUBREAPER = 36
_PROC = Path("/proc")


def main() -> None:
    """Run the worker under watch."""
    processes, memory = (int(word) for word in sys.argv[1:3])
    parent = os.getppid()
    if hasattr(os, "fork"):
        _adopt_orphans()
        child = os.fork()
        if child:
            _watch(child, parent, processes, memory)
        os.setsid()
    from fmus.check import worker  # noqa: PLC0415 - the watchdog itself needs nothing of it

    worker.main()


def _watch(child: int, parent: int, processes: int, memory: int) -> None:
    os.close(0)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit())
    said: dict[str, Any] = {}
    try:
        while parent == os.getppid():
            code = _reaped(child)
            if code is not None:
                said = {"ended": code}
                break
            excess = _excess(processes, memory)
            if excess:
                said = {"stopped": excess}
                break
            time.sleep(PERIOD)
    finally:
        left = _end_all(child)
        with suppress(OSError):
            os.write(1, (json.dumps(said | {"left": left}) + "\n").encode())
        os._exit(0)


def _adopt_orphans() -> None:
    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)


def _reaped(child: int | None = None) -> int | None:
    """Take note of all that ended; how the child did, negative for a signal, None where it lives."""
    with suppress(ChildProcessError):
        while True:
            number, status = os.waitpid(-1, os.WNOHANG)
            if number == child:
                return os.waitstatus_to_exitcode(status)
            if not number:
                break
    return None


def _excess(processes: int, memory: int) -> str:
    """What is beyond its bound, in words."""
    running = list(_descendants(os.getpid()))
    if len(running) - 1 > processes:
        return f"started more than {processes} processes"
    if sum(map(_resident, running)) > memory:
        return f"took more than {memory / 1e9:.1f} GB of memory"
    return ""


def _end_all(child: int) -> int:
    """Kill every descendant, those they start meanwhile too; how many had been left running beside the worker."""
    left, until = len([number for number in _descendants(os.getpid()) if number != child]), time.monotonic() + LAST
    while time.monotonic() < until:
        with suppress(OSError):
            os.killpg(child, signal.SIGKILL)
        running = list(_descendants(os.getpid()))
        for number in running:
            with suppress(OSError):
                os.kill(number, signal.SIGKILL)
        _reaped()
        if not running:
            break
        time.sleep(0.001)
    return left


def _descendants(number: int) -> Iterator[int]:
    """All descendants of a process, where the system reports them."""
    children: list[int] = []
    with suppress(OSError):
        for tasks in (_PROC / str(number) / "task").iterdir():
            children += map(int, (tasks / "children").read_text(encoding="ascii").split())
    for child in children:
        yield child
        yield from _descendants(child)


def _resident(number: int) -> int:
    """Memory of a process in main memory [bytes]."""
    with suppress(OSError, ValueError):
        return int((_PROC / str(number) / "statm").read_text(encoding="ascii").split()[1]) * os.sysconf("SC_PAGE_SIZE")
    return 0


if __name__ == "__main__":
    main()
