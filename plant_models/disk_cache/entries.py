"""Entries: values as JSON under a digest of what they follow from, checked when they are read."""

from __future__ import annotations

import hashlib
import json
import logging
import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

from plant_models.disk_cache.folder import cache_folder

LOG = logging.getLogger("plant_models")
FORMAT = "fmu-observer cache 1"


class _DamagedEntryError(ValueError):
    """A file in the cache is not the entry that was searched for; the message says why."""


def remembered(kind: str, key: str | None, compute: Callable[[], Any]) -> Any:
    """A value from the cache, computed and kept where it is not there.

    A value that is kept goes through JSON at once, so it equals the one that a later call reads.

    Args:
        kind: what the value is, in one word; a folder of the cache.
        key: digest of all that the value follows from, see `plant_models.disk_cache.identity`; None where that is not
            known: then the value is computed, and nothing is read or kept.
        compute: computes the value: None, numbers, strings, and lists and dictionaries with names of these.

    Returns:
        The value; as `json.loads` gives it where there is a key.

    Raises:
        Exception: whatever `compute` raises; nothing is kept then.
    """
    if key is None:
        return compute()
    value = recall(kind, key)
    return keep(kind, key, compute()) if value is None else value


def recall(kind: str, key: str) -> Any:
    """The value of an entry, or None where there is none; a damaged or foreign entry is reported in the log.

    Args:
        kind: as for `remembered`. key: digest of what the value follows from.
    """
    path = _entry_path(kind, key)
    try:
        return _checked(path.read_bytes(), kind, key)
    except FileNotFoundError:
        return None
    except (OSError, ValueError) as error:
        LOG.warning("The cache entry %s is not used and made again: %s", path, error)
        return None


def keep(kind: str, key: str, value: Any) -> Any:
    """Write an entry in one move; a folder that cannot be written keeps nothing, which the log notes as information.

    Args:
        kind: as for `remembered`. key: digest of what the value follows from. value: as for `remembered`.

    Returns:
        The value as `recall` will give it.
    """
    text = json.dumps(value)
    head = {"format": FORMAT, "kind": kind, "key": key, "sha256": _digest(text.encode())}
    try:
        with whole_file(_entry_path(kind, key)) as stream:
            stream.write(f"{json.dumps(head)}\n{text}\n".encode())
    except OSError as error:
        LOG.info("Nothing is kept in the cache: %s", error)
    return json.loads(text)


def _entry_path(kind: str, key: str) -> Path:
    """Where an entry lies."""
    return cache_folder() / kind / f"{key}.json"


@contextmanager
def whole_file(path: Path, rights: int = 0o600) -> Iterator[BinaryIO]:
    """A stream into a file that is there all or not at all, beside others that write the same one.

    Args:
        path: of the file; its folder is made where it is missing, and an older file replaced in one move.
        rights: of the file.

    Raises:
        OSError: it cannot be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(prefix=f".{path.stem[:16]}-", suffix=".part", dir=path.parent)
    draft = Path(name)
    try:
        with os.fdopen(handle, "wb") as stream:
            yield stream
        draft.chmod(rights)
        draft.replace(path)
    finally:
        draft.unlink(missing_ok=True)


def _checked(content: bytes, kind: str, key: str) -> Any:
    first, _, rest = content.partition(b"\n")
    try:
        head = json.loads(first)
        found = {name: head[name] for name in ("format", "kind", "key", "sha256")}
    except (ValueError, KeyError, TypeError) as error:
        raise _DamagedEntryError("it has no head, so it is damaged or of another program.") from error
    text = rest.removesuffix(b"\n")
    expected = {"format": FORMAT, "kind": kind, "key": key, "sha256": _digest(text)}
    wrong = [name for name in expected if found[name] != expected[name]]
    if wrong:
        what = "its content is damaged" if wrong == ["sha256"] else "it is the entry of something else"
        raise _DamagedEntryError(f"{what} ({', '.join(wrong)} differ).")
    return json.loads(text)


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()
