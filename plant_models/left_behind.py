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

_HOST = sha256(os.uname().nodename.encode()).hexdigest()[:6] if hasattr(os, "uname") else "000000"
_OWNER = re.compile(rf"[-_]{_HOST}-(\d+)-")
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
    return f"{prefix}{_HOST}-{os.getpid()}-"


def _sweep(place: str) -> None:
    with os.scandir(place) as entries:
        left = [(entry, owner) for entry in entries if (owner := _OWNER.search(entry.name))]
    for entry, owner in left:
        if _is_alive(int(owner[1])):
            continue
        with suppress(OSError):
            if entry.stat(follow_symlinks=False).st_uid != os.getuid():
                continue
            if entry.is_dir(follow_symlinks=False):
                shutil.rmtree(entry.path, ignore_errors=True)
            else:
                Path(entry.path).unlink()


def _is_alive(process: int) -> bool:
    """Whether a process runs; one that ended and that nobody asked how does not, though its number is taken."""
    try:
        os.kill(process, 0)
        if Path(f"/proc/{process}/stat").read_bytes().rpartition(b")")[2].split()[0] == b"Z":
            return False
    except (ProcessLookupError, OverflowError):
        return False
    except (OSError, IndexError):  # it is somebody else's, or the system says no more of it
        return True
    return True
