"""Interruption: Ctrl-C, SIGTERM and SIGHUP end a run between two steps, and never while its results are put away.

Standard library only. Only the main thread hears signals; elsewhere nothing is changed.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from time import monotonic
from typing import Any

_PATIENCE = 1.0
"""One key may arrive twice, from the terminal and from who watches; a signal after so long means that somebody insists
[s].
"""

STOPPING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
"""Signals that ask for the end."""


class Interruption:
    """Within this context the first Ctrl-C is noted in `came`, and raises nothing; whoever insists gets a
    KeyboardInterrupt.

    A handler that somebody else has installed is left alone.
    """

    def __init__(self) -> None:
        self.came = False
        self._since = 0.0
        self._former: Any = None

    def check(self) -> None:
        """Raise the KeyboardInterrupt that has come."""
        if self.came:
            raise KeyboardInterrupt

    def __enter__(self) -> Interruption:
        if _in_main_thread() and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            self._former = signal.signal(signal.SIGINT, self._hear)
        return self

    def __exit__(self, *_: object) -> None:
        if self._former is not None:
            signal.signal(signal.SIGINT, self._former)

    def _hear(self, _number: int, _frame: Any) -> None:
        if self.came and monotonic() - self._since > _PATIENCE:
            raise KeyboardInterrupt
        if not self.came:
            self.came, self._since = True, monotonic()


@contextmanager
def ends_like_ctrl_c() -> Iterator[None]:
    """SIGTERM and SIGHUP do what Ctrl-C does; where they are ignored, as under nohup, they stay so."""
    taken = [number for number in STOPPING[1:] if _in_main_thread() and signal.getsignal(number) == signal.SIG_DFL]
    for number in taken:
        signal.signal(number, _as_ctrl_c)
    try:
        yield
    finally:
        for number in taken:
            signal.signal(number, signal.SIG_DFL)


def _as_ctrl_c(_number: int, frame: Any) -> None:
    handler = signal.getsignal(signal.SIGINT)
    if not callable(handler):
        raise KeyboardInterrupt
    handler(signal.SIGINT, frame)


def _in_main_thread() -> bool:
    return threading.current_thread() is threading.main_thread()
