"""Files written whole or not at all. Touches only the file it is given, and a hidden folder beside it while it
writes.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

from cosim.errors import OutputError


def write_page(path: str | Path, text: str) -> Path:
    """Write a page to a place that the user named; its folder is created.

    Args:
        path: the file.
        text: the page.

    Returns:
        The path.

    Raises:
        OutputError: it cannot be written.
    """
    file = Path(path)
    try:
        write_file(file, text.encode("utf-8", "backslashreplace"))
    except OSError as error:
        raise OutputError(
            f"{file} cannot be written: {error.strerror or error}. Choose another place with --out."
        ) from error
    return file


def write_file(path: Path, data: bytes) -> None:
    """Write a file beside its place first, so that no half of it is ever seen.

    Args:
        path: the file; replaced where it exists; its folder is created.
        data: its content.

    Raises:
        OSError: it cannot be written; a former one is still whole.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=path.parent, prefix=".writing-") as scratch:
        part = Path(scratch) / path.name
        part.write_bytes(data)
        part.replace(path)
