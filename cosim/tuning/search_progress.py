"""Progress of a search, in runs."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[int, int, str], None]


class Bar:
    """What is to come is known as far as populations have one size.

    Args:
        progress: called with runs done, runs in all as far as known, and what is done; None for nobody.
    """

    def __init__(self, progress: Progress | None) -> None:
        self.text = ""
        self._progress, self._done, self._total = progress, 0, 0

    def expect(self, now: int, later: int) -> None:
        """Before a population.

        Args:
            now: runs of it. later: populations of this search after it.
        """
        self._total = self._done + now * (1 + later)

    def step(self) -> None:
        """A run is done."""
        self._done += 1
        if self._progress is not None:
            self._progress(self._done, max(self._total, self._done), self.text)
