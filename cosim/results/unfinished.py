"""What is left of a run that was streamed and did not end: its names, and one run at a time in a folder."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import ModuleType

from cosim.errors import OutputError

fcntl: ModuleType | None = None
with suppress(ImportError):  # Windows has none
    import fcntl

UNFINISHED = ".unfinished"
"""The folder, within that of the results, to which a run is streamed in case its process dies."""

DID_NOT_END = "the run did not end"
EXPLAINED = (
    f"{DID_NOT_END}: it is still going on, or its program was stopped from outside or taken along by an FMU. The rows "
    "are those written until then."
)


@contextmanager
def only_run(directory: Path) -> Iterator[None]:
    """Within this context no other run writes to a folder. The lock is the operating system's: nothing is left of it
    when the process is gone. Windows has none.

    Args:
        directory: the results folder, which exists.

    Raises:
        OutputError: another run is writing to it.
    """
    if fcntl is None:
        yield
        return
    descriptor = os.open(directory, os.O_RDONLY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(descriptor)
        raise OutputError(
            f"Another run is writing to {directory}: wait for its end, or choose another --out."
        ) from None
    except OSError:  # a file system without locks
        pass
    try:
        yield
    finally:
        os.close(descriptor)
