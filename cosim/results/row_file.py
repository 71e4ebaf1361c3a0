"""A file of rows; without a name it vanishes with its last user, however that one ends. Touches only the folder it is
given.
"""

from __future__ import annotations

import errno
import os
import tempfile
import weakref
from pathlib import Path
from typing import Any

import numpy as np

from cosim.errors import OutputError

_UNSUPPORTED = (errno.EINVAL, errno.EOPNOTSUPP, errno.ENOSYS)
_DISK = "/var/tmp"  # where Unix keeps large temporary files
_ZEROS = bytes(1 << 20)


class RowFile:
    """Rows of a fixed size on disk. Space is reserved before rows are accepted, so that what was accepted can be
    written.

    Args:
        folder: where the file is; None for the one for large temporary files.
        row_bytes: size of a row [bytes].
        rows: rows to reserve space for.
        named: a new file to use, in place of one without a name. offset: where its rows begin [bytes].

    `count` is the number of rows in the file.

    Raises:
        OutputError: there is no space, or the folder cannot be written.
    """

    def __init__(
        self, folder: str | Path | None, row_bytes: int, rows: int, named: Path | None = None, offset: int = 0
    ) -> None:
        self._row_bytes, self._offset = row_bytes, offset
        self._folder = named.parent if named is not None else Path(folder or _folder_for_large_files())
        self.count = self._reserved = 0
        try:
            self._file: Any = _file_without_name(self._folder) if named is None else _new_file(named)
        except OSError as error:
            raise self.explained(error) from error
        weakref.finalize(self, self._file.close)  # the maps of the file live on
        try:
            self.reserve(rows)
        except OSError as error:
            raise self.explained(error) from error

    def reserve(self, rows: int) -> None:
        """Make sure that the file can hold so many rows.

        Args:
            rows: number of rows.

        Raises:
            OSError: there is no space for them.
        """
        size = self._offset + rows * self._row_bytes
        allocate(self._file.fileno(), self._reserved, size - self._reserved)
        self._reserved = max(size, self._reserved)

    def write(self, first: int, rows: np.ndarray) -> None:
        """Write rows from number `first` on; a C-contiguous array.

        Args:
            rows: structured rows, shape (n,).

        Raises:
            OutputError: the disk refuses.
        """
        data, at = rows.data.cast("B") if rows.size else memoryview(b""), self._offset + first * self._row_bytes
        try:
            self._file.seek(at)
            while data:
                data = data[self._file.write(data) or 0 :]
        except OSError as error:
            raise self.explained(error) from error
        self.count = first + len(rows)

    def converted(self, rows: np.ndarray) -> np.ndarray:
        """Structured rows as they would stand in the file.

        Args:
            rows: structured rows, shape (n,).
        """
        return rows

    def table(self, dtype: np.dtype[np.void]) -> np.ndarray:
        """All rows as a structured array that is a map of the file, shape (count,).

        Args:
            dtype: type of a row.
        """
        if not self.count:
            return np.empty(0, dtype)
        return np.memmap(self._file, dtype=dtype, mode="r+", shape=(self.count,))

    def explained(self, error: OSError) -> OutputError:
        """Why no more rows can be taken, in words.

        Args:
            error: of the file system.
        """
        reason = error.strerror or str(error)
        return OutputError(
            f"The recording outgrew its memory and cannot continue on disk, in {self._folder}: {reason}. What was "
            "recorded so far is kept. Free the disk, choose another folder (the environment variable TMPDIR), or "
            "record less (record_every)."
        )


def _file_without_name(folder: Path) -> Any:
    return tempfile.TemporaryFile(dir=folder, buffering=0)


def _new_file(path: Path) -> Any:
    """A new file of that name: whoever has the former one open keeps it as it is."""
    path.unlink(missing_ok=True)
    return path.open("x+b", buffering=0)


def _folder_for_large_files() -> str:
    """The folder for temporary files that the user chose, else one that is not in memory, as ``/tmp`` often is."""
    chosen = any(os.environ.get(name) for name in ("TMPDIR", "TEMP", "TMP"))
    return _DISK if not chosen and os.access(_DISK, os.W_OK | os.X_OK) else tempfile.gettempdir()


def allocate(descriptor: int, start: int, size: int) -> None:
    """Have the file system set space aside; where it cannot, zeros are written.

    Args:
        descriptor: of the file.
        start: first byte.
        size: number of bytes.
    """
    if size <= 0:
        return
    if hasattr(os, "posix_fallocate"):
        try:
            return os.posix_fallocate(descriptor, start, size)
        except OSError as error:
            if error.errno not in _UNSUPPORTED:
                raise
    os.lseek(descriptor, start, os.SEEK_SET)
    while size > 0:
        size -= os.write(descriptor, _ZEROS[:size])
