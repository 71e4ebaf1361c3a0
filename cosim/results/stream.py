"""The stream: the results folder of a run that is still going on, so that what was computed outlives the program.

``table.npy`` is a whole NumPy file after every flush: rows are written first, their number in its header afterwards.
Rows are in SI. Those since the last flush are in the block, a file as well. Telegrams and packets are appended,
messages are few and written anew. Until the run ends ``summary.json`` says that it has not. Touches only the folder it
is given.
"""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np

from cosim.diagnostics.messages import MessageLog, in_order, write_messages
from cosim.errors import OutputError
from cosim.results.block_file import BLOCK_FILE, BlockFile
from cosim.results.formats.growing_npy import growing_header
from cosim.results.formats.known_formats import table_files, usual_file
from cosim.results.record_rows import PACKET_ROWS, TELEGRAM_ROWS
from cosim.results.result_data import BaliseRecord, PacketRecord, SignalInfo
from cosim.results.results_folder import EVENTS, LAYOUT, MESSAGES, PACKETS, SUMMARY, check_writable, remove_report
from cosim.results.row_file import RowFile
from cosim.results.si import UnitOf, convert, described, foreign_units
from cosim.results.summary_file import write_summary
from cosim.results.unfinished import EXPLAINED

SECONDS = 1.0
"""What was recorded is in the folder after so long at the latest [s]."""

_SYNC_SECONDS = 10.0
"""What is in the folder is on the disk itself after so long at the latest [s], should the power fail."""


class Stream:
    """A results folder that grows with its run.

    Args:
        directory: the folder; results that a former run left there are removed.
        signals: what is recorded, in the components' own units. unit_of: the unit of a column, None where there is
            none.
        summary: what is known before the run.
        events: the telegrams so far, which only grow. packets: those of the network beyond so many, as far as it is
            known what became of them; None where there is no network. logs: what the components have logged so far.

    `signals` describes the columns as they are in the file, in SI; `units` are those of the columns that are converted.

    Raises:
        OutputError: the folder cannot be written.
    """

    def __init__(
        self,
        directory: str | Path,
        signals: Sequence[SignalInfo],
        unit_of: UnitOf,
        summary: Mapping[str, Any],
        events: Callable[[], Sequence[BaliseRecord]],
        logs: Sequence[MessageLog],
        packets: Callable[[int], Sequence[PacketRecord]] | None = None,
    ) -> None:
        self.seconds = SECONDS
        self.directory = check_writable(directory)
        self.units = foreign_units(signals, unit_of)
        self.signals = described(signals, self.units)
        self._events, self._logs, self._packets = events, logs, packets
        self._stated = self._logged = self._sent = 0
        self._file: _StreamFile | None = None
        self._block: BlockFile | None = None
        self._begin(summary)

    def open(self, dtype: np.dtype[np.void]) -> RowFile:
        """The file of the table, with space for a row.

        Args:
            dtype: type of a row: its columns.

        Raises:
            OutputError: there is no space.
        """
        self._file = _StreamFile(self.directory / usual_file("npy"), dtype, self)
        return self._file

    def block(self, rows: int) -> BlockFile:
        """The block of rows that are not in the table yet, with space for the first.

        Args:
            rows: number of rows, at most.

        Raises:
            OutputError: there is no space.
        """
        units = [self.units.get(signal.name) for signal in self.signals]
        factors, offsets = (
            [neutral, *(neutral if u is None else getattr(u, name) for u in units)]
            for neutral, name in ((1.0, "factor"), (0.0, "offset"))
        )
        try:
            self._block = BlockFile(self.directory / BLOCK_FILE, rows, np.array(factors), np.array(offsets))
        except OSError as error:
            raise OutputError(f"Results cannot be streamed to {self.directory}: {error.strerror or error}.") from error
        return self._block

    def append(self) -> None:
        """Bring the telegrams, packets and messages into the folder that are not there yet.

        Raises:
            OSError: the disk refuses.
        """
        events = self._events()
        if len(events) > self._stated:
            self._add_rows(EVENTS, map(TELEGRAM_ROWS.cells, events[self._stated :]))
            self._stated = len(events)
        packets = () if self._packets is None else self._packets(self._sent)
        if packets:
            self._add_rows(PACKETS, map(PACKET_ROWS.cells, packets))
            self._sent += len(packets)
        total = sum(log.total for log in self._logs)
        if total > self._logged:
            draft = self.directory / f".{MESSAGES}"
            write_messages(draft, in_order(self._logs))
            draft.replace(self.directory / MESSAGES)
            self._logged = total

    def _add_rows(self, name: str, rows: Iterable[Iterable[str]]) -> None:
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerows(rows)
        with (self.directory / name).open("a", encoding="utf-8", newline="") as file:
            file.write(text.getvalue())

    def finish(self) -> None:
        """Give back the space that was reserved and not used; what is in the folder stays."""
        if self._file is not None:
            self._file.finish()
        if self._block is not None:
            self._block.remove()

    def _begin(self, summary: Mapping[str, Any]) -> None:
        """An empty result that says it has not ended; while its parts are brought together the folder has no
        summary.
        """
        folder = self.directory
        try:
            for name in (SUMMARY, BLOCK_FILE, PACKETS, *table_files().values()):
                (folder / name).unlink(missing_ok=True)
            remove_report(folder)
            TELEGRAM_ROWS.write(folder / EVENTS, ())
            if self._packets is not None:
                PACKET_ROWS.write(folder / PACKETS, ())
            write_messages(folder / MESSAGES, ())
            content = {
                "layout": LAYOUT,
                "ended": False,
                "failure": EXPLAINED,
                "signals": self.signals,
                "summary": dict(summary),
            }
            write_summary(folder / SUMMARY, content)
        except OSError as error:
            raise OutputError(f"Results cannot be streamed to {folder}: {error.strerror or error}.") from error


class _StreamFile(RowFile):
    """The table of a stream: a NumPy file with its number of rows kept true."""

    def __init__(self, path: Path, dtype: np.dtype[np.void], stream: Stream) -> None:
        self._dtype, self._stream = dtype, stream
        self._synced = monotonic()
        self._broken: OSError | None = None
        super().__init__(None, dtype.itemsize, 1, path, len(growing_header(dtype, 0)))
        self._make_whole()

    def reserve(self, rows: int) -> None:
        """As for any file of rows."""
        if self._broken is not None:
            raise self._broken
        if not self._reserved:  # with its header the file is a table, of no row if there is no space for any
            with suppress(OSError):
                self._file.write(growing_header(self._dtype, 0))
        super().reserve(rows)

    def write(self, first: int, rows: np.ndarray) -> None:
        """As for any file of rows; afterwards the folder holds a whole result."""
        own = rows.copy()
        convert(own.view(self._dtype)[:, 0], self._stream.units)
        super().write(first, own)
        self._make_whole()

    def converted(self, rows: np.ndarray) -> np.ndarray:
        """Structured rows as they would stand in the file."""
        own = rows.copy()
        convert(own, self._stream.units)
        return own

    def table(self, dtype: np.dtype[np.void]) -> np.ndarray:
        """All rows as a structured array that is a map of the file and cannot be changed, shape (count,)."""
        if not self.count:
            return np.empty(0, dtype)
        return np.memmap(self._file, dtype=dtype, mode="r", offset=self._offset, shape=(self.count,))

    def finish(self) -> None:
        """Cut off what is reserved."""
        self._file.truncate(self._offset + self.count * self._row_bytes)
        self._reserved = 0

    def _make_whole(self) -> None:
        """What goes with the rows. The rows are safe by now: what the disk refuses here ends the run before it takes
        more.
        """
        try:
            if monotonic() - self._synced > _SYNC_SECONDS:
                os.fsync(self._file.fileno())
                self._synced = monotonic()
            self._file.seek(0)
            self._file.write(growing_header(self._dtype, self.count))
            self._stream.append()
        except OSError as error:
            self._broken = error

    def explained(self, error: OSError) -> OutputError:
        """As for any file of rows, with the number of those in it."""
        return OutputError(
            f"The run cannot be streamed to {self._folder} any further: {error.strerror or error}. "
            f"{f'The {self.count} rows up to there are kept' if self.count else 'No row was recorded'}. "
            "Free the disk, choose another folder, or record less (record_every)."
        )
