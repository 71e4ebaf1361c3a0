"""A file that libraries write which cannot cope with a full disk: what the disk refuses is told at the end.

HDF5 ends the process where a write fails and it cannot close its file. This file takes all that is written, remembers
the first refusal, and raises it when it is closed. Touches only the file it is given.
"""

from __future__ import annotations

import io
from pathlib import Path
from types import TracebackType
from typing import Any


class GuardedFile:
    """A new binary file to write and read back, for ``h5py.File``.

    Args:
        path: of the file.

    Raises:
        OSError: it cannot be opened; or, when it is closed, it could not be written.
    """

    def __init__(self, path: str | Path) -> None:
        self._file = io.FileIO(path, "w+b")
        self.refusal: OSError | None = None

    def write(self, data: Any) -> int:
        """Write all of it, or remember why that failed.

        Args:
            data: bytes.
        """
        view = memoryview(data).cast("B")
        done = 0
        try:
            while done < len(view):
                done += self._file.write(view[done:]) or 0
        except OSError as error:
            self.refusal = self.refusal or error
            self._file.seek(len(view) - done, io.SEEK_CUR)
        return len(view)

    def readinto(self, buffer: Any) -> int:
        """Fill the buffer; what the disk did not take reads as zeros.

        Args:
            buffer: to be filled.
        """
        view = memoryview(buffer).cast("B")
        done = self._file.readinto(view) or 0
        while done < len(view) and (more := self._file.readinto(view[done:])):
            done += more
        view[done:] = bytes(len(view) - done)
        return len(view)

    def read(self, size: int = -1) -> bytes:
        """As of any file; by this h5py knows that it is one.

        Args:
            size: bytes at most; -1 for all.
        """
        return self._file.read(size) or b""

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        """As of any file.

        Args:
            offset: [bytes].
            whence: from where on, as in `io`.
        """
        return self._file.seek(offset, whence)

    def tell(self) -> int:
        """As of any file."""
        return self._file.tell()

    def truncate(self, size: int | None = None) -> int:
        """As of any file.

        Args:
            size: [bytes]; None for the present place.
        """
        try:
            return self._file.truncate(size)
        except OSError as error:
            self.refusal = self.refusal or error
            return self._file.tell() if size is None else size

    def flush(self) -> None:
        """Nothing is held back."""

    def __enter__(self) -> GuardedFile:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()
        if self.refusal is not None:
            raise self.refusal
