"""Temporary files and folders that a process which was killed left behind: the next one of the same user removes them.

Their names say whose they are. Standard library only.
"""

from __future__ import annotations

import os
import re
import shutil
import sys
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from tempfile import gettempdir
from time import time


def _said(path: str) -> str:
    """What Linux says of itself in a file or a link; empty elsewhere."""
    place = Path(path)
    with suppress(OSError):
        return str(place.readlink()) if place.is_symlink() else place.read_text(encoding="utf-8", errors="replace")
    return ""


def _digest(text: str) -> str:
    return sha256(text.encode()).hexdigest()[:6]


_HOST = _digest(os.uname().nodename if hasattr(os, "uname") else "")
_NUMBERED = _digest(_said("/proc/sys/kernel/random/boot_id") + _said("/proc/self/ns/pid"))
"""Where numbers of processes mean the same: containers may share the name of the host and a folder, and each has a
process 1."""
_OWNER = re.compile(rf"[-_]{_HOST}-([0-9a-f]{{6}})-(\d+)-(\d+)-")
_FORGOTTEN = 7 * 86400.0
"""What lies untouched for so long is nobody's, though it cannot be asked who made it: before the last start of the
machine, or in another container [s].
"""
_swept: set[str] = set()
"""Folders that this process has looked at."""


def owned(prefix: str, folder: Path | str | None = None) -> str:
    """A prefix for a temporary file or folder that says whose it is, as `tempfile` takes it. What processes that are
    gone have left in the folder under such names is removed, once in a process.

    Args:
        prefix: ending in ``-`` or ``_``. folder: where they lie; None for the one of the machine.
    """
    place = str(folder or gettempdir())
    if place not in _swept and sys.platform != "win32":  # where a process cannot be asked for harmlessly
        _swept.add(place)
        with suppress(OSError):
            _sweep(place)
    return f"{prefix}{_HOST}-{_NUMBERED}-{os.getpid()}-{_begin(os.getpid())}-"


def _sweep(place: str) -> None:
    with os.scandir(place) as entries:
        left = [(entry, owner) for entry in entries if (owner := _OWNER.search(entry.name))]
    for entry, owner in left:
        with suppress(OSError):
            status = entry.stat(follow_symlinks=False)
            known = owner[1] == _NUMBERED
            is_left = not _is_alive(int(owner[2]), owner[3]) if known else status.st_mtime < time() - _FORGOTTEN
            if status.st_uid != os.getuid() or not is_left:
                continue
            if entry.is_dir(follow_symlinks=False):
                shutil.rmtree(entry.path, ignore_errors=True)
            else:
                Path(entry.path).unlink()


def _begin(process: int) -> str:
    """When a process began, as the system counts it, and no other one of its number; 0 where it does not say."""
    stat = _said(f"/proc/{process}/stat").rpartition(")")[2].split()
    return stat[19] if len(stat) > 19 and stat[0] != "Z" else "0"


def _is_alive(process: int, begin: str) -> bool:
    """Whether a process that began then runs; one that ended and that nobody asked how does not."""
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except OSError:  # it is somebody else's
        pass
    return _begin(process) == begin
