"""Files by their content: digests, and seals by which a file in the cache is known to be the one that was put there."""

from __future__ import annotations

import hashlib
import time
from pathlib import Path

from plant_models.disk_cache.entries import whole_file

SETTLED = 2.0
"""A file changed less than this ago [s] may change again without a trace in its time stamps."""

Stamp = tuple[int, int, int, int, int]
"""Device, number, size [bytes], and times of the last change of content and of state [ns] of a file."""
_known: dict[Path, tuple[Stamp, str]] = {}


def file_digest(path: Path) -> str:
    """SHA-256 of the content of a file; read again only where the file system says that it changed.

    Args:
        path: of the file.

    Returns:
        64 hexadecimal digits.

    Raises:
        OSError: it cannot be read.
    """
    stamp = settled_stamp(path)
    known = _known.get(path)
    if known is not None and known[0] == stamp:
        return known[1]
    with path.open("rb") as stream:
        digest = hashlib.file_digest(stream, "sha256").hexdigest()
    _known.pop(path, None)
    if stamp is not None:
        _known[path] = stamp, digest
    return digest


def settled_stamp(path: Path) -> Stamp | None:
    """What the file system says of a file or folder that changes with it; None where it may change without a trace.

    Args:
        path: of it.

    Raises:
        OSError: it cannot be looked at.
    """
    status = path.stat()
    if abs(time.time() - max(status.st_mtime, status.st_ctime)) <= SETTLED:
        return None
    return status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns, status.st_ctime_ns


def seal(path: Path) -> None:
    """Note the digest of a file beside it.

    Args:
        path: of the file.

    Raises:
        OSError: the note cannot be written.
    """
    with whole_file(_seal_of(path)) as stream:
        stream.write(file_digest(path).encode())


def is_sealed(path: Path) -> bool:
    """Whether a file is the one that `seal` saw: a full disk, a machine that stopped or another program may have left
    something else.

    Args:
        path: of the file.
    """
    try:
        return _seal_of(path).read_text() == file_digest(path)
    except (OSError, ValueError):
        return False


def _seal_of(path: Path) -> Path:
    """Where the digest of a file is noted."""
    return path.with_suffix(".sha256")
