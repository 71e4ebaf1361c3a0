"""The block of rows that a recorder fills, in memory that is a file: what is in it outlives the process, whatever ends
that.

The operating system keeps what was stored in a shared map also when the process is killed in the next instruction, so a
row costs no call and none is lost. Touches only the file it is given.
"""

from __future__ import annotations

import mmap
import weakref
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cosim.results.row_file import allocate

BLOCK_FILE = ".block"
"""Name of the file in a results folder that is being streamed to."""

FIRST, COUNT, WIDTH = range(3)
CELLS = 8
HEAD = 8 * CELLS
_TRIES = 10


class BlockFile:
    """A block of rows.

    Args:
        path: of the file, which is made anew. rows: room. factors, offsets: of each column to SI, shape (width,).

    `rows` is the block, shape (rows, width), in the units it is recorded in; `cells[COUNT]` says how many of its rows
    are filled and `cells[FIRST]` which number in the whole table the first one has. Both are kept by whoever fills it.
    Only rows may be filled that `reserve` has set space aside for: at first one.

    Raises:
        OSError: there is no space for it.
    """

    def __init__(self, path: Path, rows: int, factors: np.ndarray, offsets: np.ndarray) -> None:
        width = len(factors)
        self._path = path
        path.unlink(missing_ok=True)
        size = HEAD + 8 * width * (2 + rows)
        self._file: Any = path.open("x+b", buffering=0)
        weakref.finalize(self, self._file.close)
        self._row_bytes, self._reserved = 8 * width, 0
        self.reserve(1)
        self._file.truncate(size)
        self._map = mmap.mmap(self._file.fileno(), size)
        numbers = np.frombuffer(self._map, np.float64, offset=HEAD)
        numbers[:width], numbers[width : 2 * width] = factors, offsets
        self.rows = numbers[2 * width :].reshape(rows, width)
        self.cells = memoryview(self._map)[:HEAD].cast("q")
        self.cells[WIDTH] = width

    def reserve(self, rows: int) -> None:
        """Have space set aside for so many rows: to fill a hole of a map ends the process where the disk is full.

        Args:
            rows: number of rows, at most those that there is room for.

        Raises:
            OSError: there is no space.
        """
        size = HEAD + self._row_bytes * (2 + rows)
        allocate(self._file.fileno(), self._reserved, size - self._reserved)
        self._reserved = max(size, self._reserved)

    @property
    def count_address(self) -> int:
        """Where `cells[COUNT]` is, for somebody else than Python."""
        return int(np.frombuffer(self._map, np.int64, CELLS).ctypes.data) + 8 * COUNT

    def remove(self) -> None:
        """The rows are elsewhere now; whoever has the block still may fill it. In a folder that is read-only by now it
        stays, as an empty one.
        """
        with suppress(OSError):
            self._path.unlink()


@dataclass(frozen=True)
class _ReadBlock:
    """What a block held when it was read.

    Args:
        first: number of its first row in the table. rows: shape (rows, width). factors, offsets: to SI, shape (width,).
    """

    first: int
    rows: np.ndarray
    factors: np.ndarray
    offsets: np.ndarray

    def after(self, known: int, dtype: np.dtype[np.void]) -> np.ndarray:
        """The rows that are not among the first `known` of the table, in SI and of the table's type, shape (rows,).

        Args:
            dtype: type of a row of the table.

        Raises:
            ValueError: it is the block of another table.
        """
        if 8 * len(self.factors) != dtype.itemsize:
            raise ValueError(f"{BLOCK_FILE} is not the block of its table.")
        if self.first > known:  # of a table that has lost its end
            return np.empty(0, dtype)
        new = self.rows[known - self.first :]
        converted = np.where((self.factors == 1.0) & (self.offsets == 0.0), new, self.factors * new + self.offsets)
        return np.ascontiguousarray(converted).view(dtype)[:, 0] if len(converted) else np.empty(0, dtype)


def read_block(path: Path) -> _ReadBlock:
    """The block that a process left or is filling.

    Args:
        path: of the block.

    Raises:
        OSError: the file cannot be read. ValueError: it is no block.
    """
    head = b""
    for _ in range(_TRIES):  # it may be emptied into the table, and filled anew, while it is read
        content = path.read_bytes()
        former, head = head, content[: 8 * (FIRST + 1)]
        if former == head:
            break
    if len(content) < HEAD:
        raise ValueError(f"{path} is no block of rows.")
    first, count, width = (int(n) for n in np.frombuffer(content, np.int64, CELLS)[: WIDTH + 1])
    numbers = np.frombuffer(content[: len(content) // 8 * 8], np.float64, offset=HEAD)
    if width < 1 or not 0 <= count <= len(numbers) // width - 2:
        raise ValueError(f"{path} is no block of rows.")
    rows = numbers[2 * width : (2 + count) * width].reshape(count, width)
    return _ReadBlock(first, rows, numbers[:width], numbers[width : 2 * width])
