"""Crashes: which FMUs ended a process, by the content of their files, so that they get processes of their own from then
on. Touches the cache folder only.
"""

from __future__ import annotations

import re
from contextlib import suppress
from pathlib import Path

from plant_models.disk_cache.folder import cache_folder

_DIGEST = re.compile(r"[0-9a-f]{64}")
_LONGEST = 400


def note_crash(digest: str, how: str) -> None:
    """Remember that a file ended a process; where that cannot be written it is not.

    Args:
        digest: of its content; another text for no file. how: where and in which way, in words.
    """
    if _DIGEST.fullmatch(digest):
        with suppress(OSError):
            _place(digest).parent.mkdir(parents=True, exist_ok=True)
            _place(digest).write_text(how[:_LONGEST], encoding="utf-8")


def noted_crash(digest: str) -> str:
    """How a file ended a process, in words; empty where none is known.

    Args:
        digest: of its content.
    """
    with suppress(OSError, UnicodeDecodeError):
        return _place(digest).read_text(encoding="utf-8")[:_LONGEST]
    return ""


def _place(digest: str) -> Path:
    return cache_folder() / "crashes" / digest
