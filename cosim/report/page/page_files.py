"""Files written whole or not at all. Touches only the places it is given, and a hidden folder beside them while it
writes.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from cosim.errors import OutputError
from plant_models.left_behind import owned


@contextmanager
def explained(what: str, advice: str) -> Iterator[None]:
    """Turns what the file system refuses into an error for users.

    Args:
        what: what is written, and where to.
        advice: what to do where it cannot be.

    Raises:
        OutputError: the file system refused something.
    """
    try:
        yield
    except OSError as error:
        raise OutputError(f"{what}: {error.strerror or error}. {advice}") from error


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
    with explained(f"{file} cannot be written", "Choose another place with --out."):
        write_file(file, page_bytes(text))
    return file


def page_bytes(text: str) -> bytes:
    """A text as it stands in a file, whatever is in it.

    Args:
        text: of the page.
    """
    return text.encode("utf-8", "backslashreplace")


def write_file(path: Path, data: bytes) -> None:
    """Write a file beside its place first, so that no half of it is ever seen.

    Args:
        path: the file; replaced where it exists; its folder is created.
        data: its content.

    Raises:
        OSError: it cannot be written; a former one is still whole.
    """
    write_files(path.parent, {path.name: data})


def write_files(folder: Path, contents: Mapping[str, bytes]) -> None:
    """Write files that belong together: none takes its place before all are written.

    Args:
        folder: created where it does not exist.
        contents: by name of the file.

    Raises:
        OSError: one cannot be written; former ones are still whole.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder, prefix=owned(".writing-", folder)) as scratch:
        for name, data in contents.items():
            (Path(scratch) / name).write_bytes(data)
        for name in contents:
            (Path(scratch) / name).replace(folder / name)
