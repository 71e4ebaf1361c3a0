"""Whose code runs: looking runs none, and what was run here before is known by its content. Knows no files' meaning.

Code of others runs behind two doors only: `plant_models.user_file` runs Python, `cosim.components.unpacking` unpacks an
FMU for its library to be loaded. Both ask here first, and note what they let pass.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from plant_models.disk_cache.entries import keep, recall
from plant_models.disk_cache.files import file_digest

WHY_NOT = "is code, and looking runs none; --trust runs it (trust=True in a script)"

_KIND = "run_before"
_is_looking: ContextVar[bool] = ContextVar("is_looking", default=False)
_known: set[str] = set()
"""Digests of what this process ran, or found among what was run before."""


@contextmanager
def looking(really: bool = True) -> Iterator[None]:
    """Within this context no code of others is run: the doors refuse.

    Args:
        really: False for a context in which it is run: what a user names as code by itself.
    """
    token = _is_looking.set(really)
    try:
        yield
    finally:
        _is_looking.reset(token)


def is_looking() -> bool:
    """Whether no code of others may be run."""
    return _is_looking.get()


def remember(files: Iterable[Path]) -> None:
    """Note by their content that files are run here, or may be. Where the cache cannot be written this process alone
    knows.

    Args:
        files: of Python, or FMUs.
    """
    for file in strangers(files):
        digest = file_digest(file)
        _known.add(digest)
        keep(_KIND, digest, file.name)


def strangers(files: Iterable[Path]) -> list[Path]:
    """Of these files the ones with a content that was never run here.

    Args:
        files: of Python, or FMUs; those that are not there are left out.
    """
    return [file for file in files if file.is_file() and not _is_known(file)]


def _is_known(file: Path) -> bool:
    digest = file_digest(file)
    if digest not in _known and recall(_KIND, digest) is not None:
        _known.add(digest)
    return digest in _known
