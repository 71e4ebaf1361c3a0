"""What commands print and write besides their output: notices, a text or a picture in a file."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from cosim.errors import OutputError


def print_notice(text: str) -> None:
    """Print a line to standard error.

    Args:
        text: the line.
    """
    print(text, file=sys.stderr, flush=True)


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
