"""Progress bars on the error stream. Nothing is loaded where nobody can see one."""

from __future__ import annotations

import sys
from typing import Any


class ProgressBar:
    """A progress bar; appears only where somebody can see it.

    Args:
        unit: what is counted. silent: whether it stays away in any case.
        shape: as tqdm's ``bar_format``; None for the usual one.
    """

    def __init__(self, unit: str = "it", *, silent: bool = False, shape: str | None = None) -> None:
        self._style = {"unit": unit, "bar_format": shape}
        self._hidden = silent or not sys.stderr.isatty()
        self._bar: Any = None

    def __call__(self, done: float, total: float, what: str = "") -> None:
        """Move the bar.

        Args:
            done: how much is done. total: how much there is. what: is being done.
        """
        if self._hidden:
            return
        if self._bar is None:
            from tqdm import tqdm  # noqa: PLC0415 - only for those who watch

            self._bar = tqdm(total=total, leave=False, file=sys.stderr, **self._style)
        self._bar.set_description_str(what)
        self._bar.update(done - self._bar.n)

    def clear(self) -> None:
        """Take the bar off the screen until it moves again."""
        if self._bar is not None:
            self._bar.clear()

    def close(self) -> None:
        """Remove the bar."""
        if self._bar is not None:
            self._bar.close()

    def __enter__(self) -> ProgressBar:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
