"""Results that many runs read are read once in a process: again only where the file system says that they changed."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from plant_models.disk_cache.files import Stamp, settled_stamp

T = TypeVar("T")
_KEPT, _LARGEST = 16, 16_000_000
"""Readings that are kept, those used last, and the largest of them by its files [bytes]."""
_read: OrderedDict[tuple[object, Path], tuple[tuple[Stamp, ...], object]] = OrderedDict()


def read_once(read: Callable[[Path], T], path: Path) -> T:
    """What a reader makes of a file, or of the files in a folder; nobody may change it.

    Args:
        read: the reader. path: of the file or folder.

    Raises:
        Exception: whatever the reader raises.
    """
    key, stamps = (read, path), _stamps(path)
    known = _read.pop(key, None)
    if known is None or known[0] != stamps:
        known = (stamps or (), read(path))
    if stamps:
        _read[key] = known
        while len(_read) > _KEPT:
            _read.popitem(last=False)
    found: T = known[1]  # type: ignore[assignment] # of this reader
    return found


def _stamps(path: Path) -> tuple[Stamp, ...] | None:
    """Those of a file, or of a folder and what is in it; None of large ones, and where something may change without a
    trace.
    """
    try:
        found = [settled_stamp(each) for each in (path, *(sorted(path.iterdir()) if path.is_dir() else ()))]
    except OSError:
        return None
    stamps = tuple(stamp for stamp in found if stamp is not None)
    whole = len(stamps) == len(found) and sum(size for _, _, size, *_ in stamps) <= _LARGEST
    return stamps if whole else None
