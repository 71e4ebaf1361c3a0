"""Warnings of a command on the error stream, a line each. Whoever warns writes to the log; nobody else prints them."""

from __future__ import annotations

import logging
import re
import sys
import warnings
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import Any, TextIO

from fmus.cli.colour import coloured
from fmus.plain import plain
from fmus.tables.terminal import terminal_width

_SENTENCE_END = re.compile(r"(?<=[.;]) ")


@contextmanager
def warnings_in_lines(*, whole: bool) -> Iterator[None]:
    """Print what is written to the log meanwhile, from warnings on, and what Python itself warns of: of each the first
    sentence, and no more of it than a terminal is wide.

    Args:
        whole: whether each is printed whole instead.
    """
    lines = _Lines(whole)
    root = logging.getLogger()
    root.addHandler(lines)
    before, warnings.showwarning = warnings.showwarning, _logged
    try:
        yield
    finally:
        warnings.showwarning = before
        root.removeHandler(lines)
        if lines.cut:
            print("(--verbose shows warnings whole)", file=sys.stderr, flush=True)


def _logged(message: Warning | str, category: type[Warning], filename: str, lineno: int, *_: Any, **__: Any) -> None:
    """A warning of Python, with its place at its end, as a line of the log."""
    logging.getLogger("py.warnings").warning("%s (%s, %s:%d)", message, category.__name__, filename, lineno)


class _Lines(logging.Handler):
    """Prints what is logged; `cut` says whether something was left out."""

    def __init__(self, whole: bool) -> None:
        super().__init__(logging.WARNING)
        self._whole, self.cut = whole, False

    def emit(self, record: logging.LogRecord) -> None:
        text = plain(record.getMessage())
        shown = text if self._whole else _shortened(text, sys.stderr)
        self.cut = self.cut or shown != text
        with _beside_bars():
            print(f"{coloured('warning:', 'doubtful', sys.stderr)} {shown}", file=sys.stderr, flush=True)


def _beside_bars() -> AbstractContextManager[Any]:
    """Progress bars stay off the screen meanwhile; nothing is loaded where there is none."""
    loaded = sys.modules.get("tqdm")
    return nullcontext() if loaded is None else loaded.tqdm.external_write_mode(sys.stderr)


def _shortened(text: str, stream: TextIO) -> str:
    """A text in one line."""
    first = _SENTENCE_END.split(" ".join(text.split()), maxsplit=1)[0]
    width = terminal_width(stream)
    room = None if width is None else max(width - len("warning:  ..."), 20)
    if room is not None and len(first) > room:
        first = first[: first.rfind(" ", 0, room + 1) if " " in first[: room + 1] else room]
    return first if first == text else f"{first.rstrip('.;:,')} ..."
