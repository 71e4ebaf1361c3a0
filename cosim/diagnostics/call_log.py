"""The call log: every call of every component, written before it begins. Touches the file it is given.

A line is written in two pieces, what is called and what came of it, each straight to the operating system: where a call
takes the process with it, the log ends with that call. Calls of several threads are written, and so made, one after the
other.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from math import isnan
from pathlib import Path
from threading import RLock
from time import perf_counter
from typing import Any

from cosim.diagnostics.call_text import DescribedCall
from cosim.diagnostics.messages import STATUSES
from cosim.errors import OutputError

HEADER = "# time [s], component, call -> status, duration [us], what it returned\n"


class CallLog:
    """A file of calls.

    Args:
        path: the file; replaced where it exists.

    `count` calls were begun. `broken` says why nothing is written any more, or is None.

    Raises:
        OutputError: the file cannot be written.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self.count = 0
        self.broken: str | None = None
        self._lock = RLock()
        self._open_line = 0  # number of the call whose line is not ended yet
        try:
            self._file = os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
            os.write(self._file, HEADER.encode())
        except OSError as error:
            hint = "Choose another file."
            raise OutputError(f"The call log cannot be written to {path}: {error.strerror or error}. {hint}") from error

    def call(self, time: float, component: str, described: DescribedCall, function: Callable[[], Any]) -> Any:
        """Make a call and log it.

        Args:
            time: where the component stands [s], NaN before it is initialised. component: its name.
            described: the call in words. function: makes it.
        """
        with self._lock:
            number = self._begin(f"{_instant(time)} {component} {described.text}")
            begin = perf_counter()
            try:
                result = function()
            except BaseException as error:
                status = _status(getattr(error, "status", None), type(error).__name__)
                self._end(number, described.text, status, perf_counter() - begin, "")
                raise
            seconds = perf_counter() - begin
            status, returned = described.outcome(result)
            self._end(number, described.text, status, seconds, returned)
            return result

    def close(self) -> None:
        """End the file."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1

    def _begin(self, text: str) -> int:
        self.count += 1
        self._write(("\n" if self._open_line else "") + text)  # a call within a call: the FMU called back
        self._open_line = self.count
        return self.count

    def _end(self, number: int, text: str, status: str, seconds: float, returned: str) -> None:
        again = "" if self._open_line == number else f"... {text}"
        self._write(f"{again} -> {status}, {1e6 * seconds:.1f} us" + (f", {returned}" if returned else "") + "\n")
        self._open_line = 0

    def _write(self, text: str) -> None:
        if self.broken is None and self._file >= 0:
            try:
                os.write(self._file, text.encode("utf-8", "backslashreplace"))
            except OSError as error:  # a full disk ends the log, not the run
                self.broken = f"The call log {self.path} ends after {self.count} calls: {error.strerror or error}."


def _instant(time: float) -> str:
    return "-" if isnan(time) else f"{time:.9g}"


def _status(status: Any, otherwise: str) -> str:
    return STATUSES[status] if isinstance(status, int) and 0 <= status < len(STATUSES) else otherwise
