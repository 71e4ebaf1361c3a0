"""Signals: Ctrl-C always interrupts, and a reader that goes away (``fmus info FILE | head``) is no failure."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

BROKEN_PIPE = 141
"""Exit code of a program that nobody reads any more, as shells count it: 128 and SIGPIPE."""


@contextmanager
def interruptible() -> Iterator[None]:
    """SIGINT raises KeyboardInterrupt, also where the parent had it ignored.

    A shell script does so for what it starts with ``&``; a build that was interrupted would go on and leave its file.
    """
    if threading.current_thread() is not threading.main_thread() or signal.getsignal(signal.SIGINT) != signal.SIG_IGN:
        yield
        return
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)


def forget_output() -> None:
    """Send what is still to be written nowhere, so that Python does not complain about the broken pipe at its end."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, sys.stdout.fileno())
    os.close(nowhere)
