"""The recorder: rows of values in memory and, past a stated size, in a file that nobody else sees. Touches no other
file.

Rows are copied once and never looked up. What does not fit into the stated memory goes to a `RowFile` block by block,
so that a run of any length needs no more memory than that.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from math import inf
from pathlib import Path
from time import monotonic
from typing import Any, Protocol

import numpy as np

from cosim.errors import OutputError
from cosim.results.block_file import COUNT, FIRST, BlockFile
from cosim.results.result_data import SignalInfo
from cosim.results.row_file import RowFile
from cosim.results.table_layout import table_dtype

MEMORY = 256e6  # rows stay in memory up to this size [bytes]
BLOCK = 4e6  # rows gathered before each writing to the file [bytes]
_FIRST_ROWS = 16
_FIRST_BLOCK = 512  # rows of a stream at least: a chunk of the compiled stepper has room for its events


class RowStream(Protocol):
    """Where rows go that must outlive the program, see `cosim.results.stream`."""

    seconds: float

    def open(self, dtype: np.dtype[np.void]) -> RowFile:
        """The file for rows of this type, with space for one.

        Args:
            dtype: type of a row: its columns.
        """
        ...

    def block(self, rows: int) -> BlockFile:
        """The block of at most so many rows that are not in the file yet.

        Args:
            rows: number of rows.
        """
        ...


class Recorder:
    """Rows ``(time, values...)``.

    Args:
        signals: what the values are.
        expected_rows: rows to make room for at first.
        memory: rows stay in memory up to this size; beyond it they stream to a file [bytes].
        folder: where that file is; by default the one for large temporary files. It has no name there, and is
            gone with the recorder and its table whatever happens to the program.
        every: keep each `every`-th communication point only, counted from the first. The last point, rows of events,
            and the point that follows an event are always kept.
        switching: places among the values of flags. A point at which one of them turns from zero to another number, or
            back, is always kept: when it did is then exact however few rows there are.
        stream: writes rows where others see them while the run goes on, block by block and whenever its `seconds` have
            passed; in memory is then no more than a block.

    `count` is the number of rows that are kept. Of a stream the block is first one row and is doubled whenever it is
    full, so that a run that dies at once leaves whole files as well. Where the disk has no space for a block it takes
    half of it, and so on, until there is none for a single row.
    """

    def __init__(
        self,
        signals: Sequence[SignalInfo],
        expected_rows: int,
        *,
        memory: float = MEMORY,
        folder: str | Path | None = None,
        every: int = 1,
        switching: Sequence[int] = (),
        stream: RowStream | None = None,
    ) -> None:
        self._dtype = table_dtype(["time", *(s.name for s in signals)])
        self._width = len(signals) + 1
        self._limit = max(int(memory // self._dtype.itemsize), _FIRST_ROWS)
        self._folder = folder
        self._file: RowFile | None = None
        self.every = every
        self._points, self._after_event, self._skipping = 0, False, False
        self._switching = np.asarray(switching if every != 1 else (), dtype=np.intp)
        self._flags = np.zeros(len(self._switching), dtype=bool)
        self._skipped = np.empty(self._width)
        self._source: np.ndarray | None = None
        self.count = self._first = 0  # `_first`: first row of the block in memory; all before it are in the file
        self._seconds, self._due = inf, inf  # when rows are to be brought into the file at the latest [s]
        self._block: BlockFile | None = None
        # first row and rows of the block, kept where they outlive the process if it is a stream's
        self._filled: Any = [0, 0]
        room = min(max(expected_rows // every + 1, _FIRST_ROWS), self._limit)
        if stream is None:
            self._use(np.empty((room, self._width)))
        else:
            self._use_stream(stream, max(room, _FIRST_BLOCK))

    def _use_stream(self, stream: RowStream, room: int) -> None:
        """Keep rows where they outlive the process: in blocks of at most `room`, for which the disk reserves space."""
        self._limit = max(min(int(BLOCK // self._dtype.itemsize), self._limit, room), _FIRST_ROWS)
        self._file = stream.open(self._dtype)
        self._seconds, self._due = stream.seconds, monotonic() + stream.seconds
        self._block = stream.block(self._limit)
        self._filled, self._buffer = self._block.cells, self._block.rows
        self._use(self._buffer[:1])

    @property
    def room(self) -> int:
        """How many rows the memory takes as it is."""
        return len(self._rows)

    @property
    def count_address(self) -> int | None:
        """Where somebody who fills a `block` may say with each row how many are filled in all; None where nobody reads
        it.

        They are counted from `block_start`.
        """
        return None if self._block is None else self._block.count_address

    @property
    def block_start(self) -> int:
        """How many rows are filled before those of the last `block`."""
        return self.count - self._first

    def add(self, t: float, values: np.ndarray) -> None:
        """Copy the row of a communication point: time [s] and values, shape (n,).

        Args:
            t: time [s].
            values: of the plan, shape (n,).

        Raises:
            OutputError: the file cannot take more rows; everything recorded so far is kept.
        """
        if self.every == 1 or self._is_due(values):
            self._append(t, values)
            return
        if self.count - self._first == len(self._rows):
            self._make_room()  # now, so that there is room for this row in case it is the last one
        self._skipped[0], self._skipped[1:] = t, values
        self._skipping = True

    def add_event(self, t: float, values: np.ndarray) -> None:
        """Copy the row of an event within a step or at its end; it is kept whatever `every` says. Otherwise as
        `add`.

        Args:
            t: time [s].
            values: shape (n,).
        """
        self._append(t, values)
        self._after_event, self._skipping = True, False
        self._flags = values[self._switching] != 0.0

    def block(self, rows: int) -> np.ndarray:
        """Free rows to be filled by somebody else, who says with `commit` how many of them are communication points
        now.

        Args:
            rows: how many are wanted, at least 1.

        Returns:
            A C-contiguous view of shape (m, 1 + n), 1 <= m <= rows; valid until the next call of anything here.

        Raises:
            OutputError: as for `add`.
        """
        if self.count - self._first == len(self._rows) or (self._due != inf and monotonic() >= self._due):
            self._make_room()
        start = self.count - self._first
        return self._rows[start : start + rows]

    def commit(self, rows: int) -> None:
        """The first `rows` rows of the last `block` hold communication points, in order."""
        if self.every != 1 and rows:
            start = self.count - self._first
            filled = self._rows[start : start + rows]
            due = (self._points + np.arange(rows)) % self.every == 0
            due[0] |= self._after_event
            flags = np.vstack([self._flags, filled[:, 1 + self._switching] != 0.0])
            due |= (flags[1:] != flags[:-1]).any(axis=1)
            self._flags = flags[-1]
            self._points, self._after_event, self._skipping = self._points + rows, False, not due[-1]
            self._skipped[:] = filled[-1]
            kept = filled[due]
            rows = len(kept)
            filled[:rows] = kept
        self.count += rows
        self._filled[COUNT] = self.count - self._first

    def table(self) -> np.ndarray:
        """The rows as a structured array, shape (rows,), ``time`` first.

        It is the recorder's own memory or, past the stated size, a map of its file of which only the pages in use are
        in memory:
        what is changed in the table is changed in the recorder.
        """
        if self._skipping:
            self._skipping = False
            self._append(self._skipped[0], self._skipped[1:])
        if self._file is None:
            return self._in_memory()
        try:
            self._flush()
        except OutputError:  # space was reserved, and the disk refuses all the same: the rest must fit into the memory
            return np.concatenate([np.asarray(self._file.table(self._dtype)), self._file.converted(self._in_memory())])
        with suppress(OSError):  # the next rows start behind these: it matters only if there are any
            self._file.reserve(self.count + len(self._rows))
        return self._file.table(self._dtype)

    # -- rows -------------------------------------------------------------------------------------------------------

    def _append(self, t: float, values: np.ndarray) -> None:
        place = self.count - self._first
        if place == len(self._rows):
            self._make_room()
            place = self.count - self._first
        if values is not self._source:  # the master hands over the same array at every step
            self._source = np.asarray(values, dtype=np.float64)
            self._view: Any = memoryview(self._source.data)
        at = place * self._width
        self._cells[at] = t
        self._cells[at + 1 : at + self._width] = self._view
        self.count += 1
        self._filled[COUNT] = place + 1
        if self._due != inf and monotonic() >= self._due:
            self._make_room()

    def _is_due(self, values: np.ndarray) -> bool:
        """Whether the next communication point is to be kept."""
        flags = values[self._switching] != 0.0
        due = self._points % self.every == 0 or self._after_event or bool((flags != self._flags).any())
        self._flags = flags
        self._points += 1
        self._after_event = self._skipping = False
        return due

    def _in_memory(self) -> np.ndarray:
        return self._rows[: self.count - self._first].view(self._dtype)[:, 0]

    # -- room -------------------------------------------------------------------------------------------------------

    def _use(self, rows: np.ndarray) -> None:
        self._rows = rows
        self._cells: Any = memoryview(rows.reshape(-1).data)

    def _make_room(self) -> None:
        """More memory as long as the limit allows it; the file from then on."""
        if self._file is None and len(self._rows) < self._limit:
            more = np.empty((min(2 * len(self._rows), self._limit), self._width))
            more[: self.count] = self._rows
            self._use(more)
            return
        wanted = 2 * len(self._rows)
        if self._file is None:
            wanted = min(max(int(BLOCK // self._dtype.itemsize), _FIRST_ROWS), len(self._rows))
            self._file = RowFile(self._folder, self._dtype.itemsize, len(self._rows))
            self._buffer = np.empty((wanted, self._width))
        self._flush()
        self._use(self._buffer[: self._reserved(min(wanted, len(self._buffer)))])

    def _reserved(self, wanted: int) -> int:
        """For how many of the wanted rows the disk sets space aside.

        Raises:
            OutputError: for none.
        """
        assert self._file is not None
        while True:
            try:
                self._file.reserve(self.count + wanted)
                if self._block is not None:
                    self._block.reserve(wanted)
                return wanted
            except OSError as error:
                if wanted == 1:
                    raise self._file.explained(error) from error
            wanted //= 2

    def _flush(self) -> None:
        """Bring the block in memory into the file; only then it counts as being there."""
        assert self._file is not None
        self._file.write(self._first, self._rows[: self.count - self._first])
        self._filled[COUNT], self._first = 0, self.count
        self._filled[FIRST] = self._first
        if self._seconds != inf:
            self._due = monotonic() + self._seconds
