"""What commands print and write: data as JSON, paths, warnings, a text or a picture in a file."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, TextIO

from cosim.errors import OutputError
from fmus.cli.colour import coloured
from fmus.plain import plain
from fmus.tables.terminal import terminal_width

_SENTENCE_END = re.compile(r"(?<=[.;]) ")


def print_notice(text: str) -> None:
    """Print a line to standard error.

    Args:
        text: the line.
    """
    print(text, file=sys.stderr, flush=True)


def print_warning(text: str) -> None:
    """Print a warning to standard error.

    Args:
        text: of the warning.
    """
    print_notice(f"{coloured('warning:', 'doubtful', sys.stderr)} {plain(text)}")


class Warnings:
    """Warnings on the error stream, a line each: the first sentence, and no more of it than a terminal is wide.

    Args:
        whole: whether each is printed whole instead. before: called before each, to take a progress bar off the screen.
    """

    def __init__(self, *, whole: bool, before: Callable[[], None] = lambda: None) -> None:
        self._whole, self._before, self._cut = whole, before, False

    def __call__(self, text: str) -> None:
        """Print one.

        Args:
            text: of the warning.
        """
        shown = text if self._whole else _shortened(text, sys.stderr)
        self._cut = self._cut or shown != text
        self._before()
        print_warning(shown)

    def end(self) -> None:
        """Say how the rest can be read, where something was left out."""
        if self._cut:
            print_notice("(--verbose shows warnings whole)")


def _shortened(text: str, stream: TextIO) -> str:
    """A text in one line."""
    first = _SENTENCE_END.split(" ".join(text.split()), maxsplit=1)[0]
    width = terminal_width(stream)
    room = None if width is None else max(width - len("warning:  ..."), 20)
    if room is not None and len(first) > room:
        first = first[: first.rfind(" ", 0, room + 1) if " " in first[: room + 1] else room]
    return first if first == text else f"{first.rstrip('.;:,')} ..."


def ignore(_text: str) -> None:
    """Print nothing, where somebody asked for quiet.

    Args:
        _text: what is not printed.
    """


def write_text(path: Path, text: str) -> None:
    """Write a text file.

    Args:
        path: of the file. text: its contents.

    Raises:
        OutputError: it cannot be written.
    """
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise OutputError(f"{path} cannot be written: {error.strerror or error}.") from error


def save_figure(figure: Any, path: Path) -> None:
    """Write a picture; its ending decides the format.

    Args:
        figure: of matplotlib. path: of the file.

    Raises:
        OutputError: the ending is unknown or the file cannot be written.
    """
    try:
        figure.savefig(path)
    except (OSError, ValueError) as error:  # matplotlib refuses endings that it does not know by a ValueError
        raise OutputError(f"{path} cannot be written: {error}.") from error
