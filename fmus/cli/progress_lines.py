"""Progress where nobody can see a bar, in a pipe or the log of a CI: a line on the error stream now and then."""

from __future__ import annotations

import sys
from time import monotonic

_EVERY = 30.0
"""Time between two lines [s]."""


class ProgressLines:
    """Lines of what is done.

    Args:
        unit: what is counted. after: time before the first line [s], so that what is done soon needs none.
    """

    def __init__(self, unit: str, after: float) -> None:
        self._unit, self._begin = unit, monotonic()
        self._next = self._begin + after

    def __call__(self, done: float, total: float, what: str = "") -> None:
        """Print a line, where it is time for one.

        Args:
            done: how much is done. total: how much there is. what: is being done.
        """
        now = monotonic()
        if now < self._next:
            return
        self._next = now + _EVERY
        counted = f"{done:.6g} of {total:.6g} {self._unit}s done after {now - self._begin:.0f} s"
        print(f"{counted}: {what}" if what else counted, file=sys.stderr, flush=True)
