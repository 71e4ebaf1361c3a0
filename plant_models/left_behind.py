"""Temporary files and folders that a process which was killed left behind: the next one of the same user removes them.

Their names say whose they are. Standard library only.
"""

from __future__ import annotations

import os
import shutil
import socket
import sys
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from tempfile import gettempdir

_HOST = sha256(socket.gethostname().encode()).hexdigest()[:6]
_swept: set[tuple[str, str]] = set()
"""Folders and prefixes that this process has looked at."""


def owned(prefix: str, folder: Path | str | None = None) -> str:
    """A prefix for a temporary file or folder that says whose it is, as `tempfile` takes it. What processes that are
    gone have left under it is removed, once in a process.

    Args:
        prefix: of all such files. folder: where they lie; None for the one of the machine.
    """
    place = str(folder or gettempdir())
    if (place, prefix) not in _swept and sys.platform != "win32":  # where a process cannot be asked for harmlessly
        _swept.add((place, prefix))
        with suppress(OSError):
            _sweep(place, prefix)
    return f"{prefix}{_HOST}-{os.getpid()}-"


def _sweep(place: str, prefix: str) -> None:
    with os.scandir(place) as entries:
        left = [entry for entry in entries if entry.name.startswith(prefix)]
    for entry in left:
        host, _, rest = entry.name.removeprefix(prefix).partition("-")
        number = rest.partition("-")[0]
        if host != _HOST or not number.isdecimal() or _is_alive(int(number)):
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
