"""Progress on the error stream: a bar where somebody can see it, else lines. No bar is loaded that nobody sees."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from fmus.cli.progress_lines import ProgressLines

Report = Callable[[Any, Any], None]
"""Called with how much is done and how much there is."""
Progress = Report | bool | None
"""Where progress is reported: a function; None or True for a bar where somebody can see one, False for nowhere."""
SIMULATED_TIME = "{percentage:3.0f}%|{bar}| {n:.1f}/{total:.1f} s simulated, {elapsed} elapsed"
"""Shape of a bar in simulated seconds."""
_DELAY = 1.0
"""What is done sooner [s] needs no bar in a script."""
_LINES_AFTER = 15.0
"""What is done sooner [s] needs no lines in a pipe."""


class ProgressBar:
    """A progress bar where somebody can see it; in a pipe a line now and then.

    Args:
        unit: what is counted. silent: whether it stays away in any case.
        shape: as tqdm's ``bar_format``; None for the usual one. delay: time before the bar appears [s].
        lines_after: time before the first line [s]; None for none.
    """

    def __init__(
        self,
        unit: str = "it",
        *,
        silent: bool = False,
        shape: str | None = None,
        delay: float = 0.0,
        lines_after: float | None = _LINES_AFTER,
    ) -> None:
        self._style = {"unit": unit, "bar_format": shape, "delay": delay}
        self._hidden = silent or not (sys.stderr.isatty() or "ipykernel" in sys.modules)
        has_lines = self._hidden and not silent and lines_after is not None
        self._lines = ProgressLines(unit, lines_after or 0.0) if has_lines else None
        self._bar: Any = None

    def __call__(self, done: float, total: float, what: str = "") -> None:
        """Move the bar.

        Args:
            done: how much is done. total: how much there is. what: is being done.
        """
        if self._lines is not None:
            self._lines(done, total, what)
        if self._hidden:
            return
        if self._bar is None:
            from tqdm import tqdm  # noqa: PLC0415 - only for those who watch

            self._bar = tqdm(total=total, leave=False, file=sys.stderr, **self._style)
        self._bar.total = total  # more than was expected, where one thing leads to another
        self._bar.set_description_str(what, refresh=bool(what))
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


@contextmanager
def reported(progress: Progress, unit: str = "it", shape: str | None = None) -> Iterator[Report | None]:
    """The function that a script has its progress reported to; None where it wants none.

    Args:
        progress: as the script states it. unit, shape: of the bar, where there is one.
    """
    if callable(progress) or progress is False:
        yield progress or None
        return
    with ProgressBar(unit, shape=shape, delay=_DELAY, lines_after=None) as bar:
        yield bar
