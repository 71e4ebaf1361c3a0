"""The recorder against a plain list: what is kept, in memory and in a file, decimated, filled by others, interrupted,
full.
"""

from __future__ import annotations

import resource
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from traced_memory import recorded

from cosim.errors import OutputError
from cosim.results import recorder as recorder_module
from cosim.results.recorder import Recorder
from cosim.results.result import SignalInfo
from cosim.results.row_file import RowFile

SIGNALS = [SignalInfo("a.x"), SignalInfo("a.y")]
ROW = 24  # bytes of a row of two signals


@pytest.fixture(autouse=True)
def small_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recorder_module, "BLOCK", 20 * ROW)


def rows_of(table: np.ndarray) -> list[tuple[float, float, float]]:
    return [tuple(row) for row in table.tolist()]


def row(number: int) -> tuple[float, float, float]:
    return 0.1 * number, float(number), -float(number) if number % 11 in (3, 4, 8) else 0.0


def add_points(recorder: Recorder, start: int, count: int) -> None:
    values = np.zeros(2)
    for number in range(start, start + count):
        t, *values[:] = row(number)  # the same array again and again, as the master hands it over
        recorder.add(t, values)


class Reference:
    """What is to be kept, said in the plainest way: all rows with a mark, thinned at the end."""

    def __init__(self, every: int, switching: bool) -> None:
        self.every, self.switching, self.all, self.points = every, switching, [], 0

    def point(self, number: int) -> None:
        follows_event = bool(self.all) and self.all[-1][1] == "event"
        switches = self.switching and bool(self.all) and (row(number)[2] == 0.0) != (self.all[-1][0][2] == 0.0)
        due = self.points % self.every == 0 or follows_event or switches
        self.all.append((row(number), "keep" if due else "drop"))
        self.points += 1

    def event(self, number: int) -> None:
        self.all.append((row(number), "event"))

    def kept(self) -> list[tuple[float, float, float]]:
        last = len(self.all) - 1
        return [r for i, (r, mark) in enumerate(self.all) if mark != "drop" or i == last]


OPERATIONS = st.lists(st.tuples(st.sampled_from(["points", "event", "block"]), st.integers(0, 40)), max_size=25)


@given(OPERATIONS, st.integers(1, 7), st.booleans(), st.sampled_from([1, 30 * ROW, 1e9]), st.integers(0, 50))
def test_exactly_the_rows_that_are_due_are_kept(
    operations: list[tuple[str, int]], every: int, switching: bool, memory: float, expected: int
) -> None:
    recorder = Recorder(SIGNALS, expected, memory=memory, every=every, switching=(1,) if switching else ())
    reference, number = Reference(every, switching), 0
    for what, count in operations:
        if what == "points":
            add_points(recorder, number, count)
        elif what == "event":
            recorder.add_event(row(number)[0], np.array(row(number)[1:]))
            reference.event(number)
            number += 1
            continue
        added = fill(recorder, number, count) if what == "block" else count
        for k in range(number, number + added):
            reference.point(k)
        number += added
    assert rows_of(recorder.table()) == reference.kept()
    assert recorder.count == len(reference.kept())


def fill(recorder: Recorder, start: int, count: int) -> int:
    """Fill a block as foreign code does, one row more than is committed; returns how many rows were committed."""
    free = recorder.block(count + 1)
    assert 1 <= len(free) <= count + 1
    assert free.flags.c_contiguous
    assert free.shape[1:] == (3,)
    for i in range(len(free)):
        free[i] = row(start + i)
    committed = min(count, len(free))
    recorder.commit(committed)
    return committed


def test_a_table_can_be_taken_while_the_recording_goes_on() -> None:
    for memory in (1e9, 50 * ROW):
        recorder = Recorder(SIGNALS, 0, memory=memory)
        add_points(recorder, 0, 70)
        first = recorder.table()
        add_points(recorder, 70, 80)
        assert rows_of(first) == [row(k) for k in range(70)]
        assert rows_of(recorder.table()) == [row(k) for k in range(150)]


def test_values_of_another_type_and_layout_are_copied() -> None:
    recorder = Recorder(SIGNALS, 4)
    recorder.add(0.0, np.array([1, 2]))
    recorder.add(1.0, np.array([3.0, 0.0, 4.0])[::2])
    assert rows_of(recorder.table()) == [(0.0, 1.0, 2.0), (1.0, 3.0, 4.0)]


def test_past_the_stated_size_rows_are_in_a_file_without_a_name(tmp_path: Path) -> None:
    recorder = Recorder(SIGNALS, 10**6, memory=100 * ROW, folder=tmp_path)
    add_points(recorder, 0, 100)
    assert not isinstance(recorder.table(), np.memmap)
    add_points(recorder, 100, 1)
    table = recorder.table()
    assert isinstance(table, np.memmap)
    assert list(tmp_path.iterdir()) == []
    del recorder
    assert rows_of(table) == [row(k) for k in range(101)]  # the file lives as long as its table
    table["a.x"] *= 2.0  # as the conversion to SI does
    assert table["a.x"][100] == 200.0


def test_memory_stays_bounded_whatever_the_length(monkeypatch: pytest.MonkeyPatch) -> None:
    """100 MB of rows with 1 MB of memory; numpy tells tracemalloc of its arrays, and mapped pages are not among
    them.
    """
    monkeypatch.setattr(recorder_module, "BLOCK", 0.5e6)
    recorder, signals = Recorder([SignalInfo(f"a.s{i}") for i in range(99)], 0, memory=1e6), np.zeros(99)
    table, peak = recorded(recorder, signals, 120_000)
    assert table.nbytes > 90e6
    assert peak < 3e6  # the memory while it doubles, and a block
    np.testing.assert_array_equal(table["time"], np.arange(120_000.0))


@contextmanager
def disk_of(size: int) -> Iterator[None]:
    """No file may grow beyond `size` bytes: what a full disk looks like to a program, error number apart."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.parametrize("size", [0, 130 * ROW, 200 * ROW])
@pytest.mark.parametrize("every", [1, 3])
def test_a_full_disk_ends_the_recording_and_loses_nothing(size: int, every: int) -> None:
    recorder, reference = Recorder(SIGNALS, 0, memory=100 * ROW, every=every), Reference(every, False)

    def fill_up() -> None:
        for number in range(3000):
            add_points(recorder, number, 1)
            reference.point(number)

    with disk_of(size):
        with pytest.raises(OutputError, match=r"cannot continue on disk, in /.*: File too large.*record_every"):
            fill_up()
        table = recorder.table()
    kept = reference.kept()
    assert len(kept) >= 100
    assert rows_of(table)[: len(kept) - 1] == kept[:-1]  # the point that failed takes the place of the last one dropped
    assert len(kept) - 1 <= len(table) <= len(kept)
    assert isinstance(table, np.memmap) == (size > 0)  # what was accepted had its space reserved


def test_the_last_point_has_its_room_before_it_is_known_to_be_the_last() -> None:
    recorder = Recorder(SIGNALS, 0, memory=20 * ROW, every=2)
    add_points(recorder, 0, 39)  # 20 rows
    with disk_of(0):
        with pytest.raises(OutputError):
            add_points(recorder, 39, 1)
        assert rows_of(recorder.table()) == [row(2 * k) for k in range(20)]


def test_a_disk_that_breaks_its_promise_leaves_what_it_has_and_what_is_in_memory(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    recorder = Recorder(SIGNALS, 0, memory=50 * ROW)
    add_points(recorder, 0, 60)

    def refuse(*_: object) -> None:
        raise OutputError("gone")

    monkeypatch.setattr(RowFile, "write", refuse)
    assert rows_of(recorder.table()) == [row(k) for k in range(60)]


def test_rows_go_only_where_space_was_reserved(monkeypatch: pytest.MonkeyPatch) -> None:
    write, written = RowFile.write, []

    def watched(self: RowFile, first: int, rows: np.ndarray) -> None:
        assert (first + len(rows)) * ROW <= self._reserved
        written.append(first)
        write(self, first, rows)

    monkeypatch.setattr(RowFile, "write", watched)
    recorder = Recorder(SIGNALS, 0, memory=50 * ROW)
    for number in range(0, 400, 9):
        add_points(recorder, number, 9)
        recorder.table()
    assert len(written) > 40


def test_an_interrupt_while_rows_are_written_loses_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    recorder, write, interrupted = Recorder(SIGNALS, 0, memory=50 * ROW), RowFile.write, []

    def half(self: RowFile, first: int, rows: np.ndarray) -> None:
        if first >= 70 and not interrupted:
            interrupted.append(first)
            write(self, first, rows[: len(rows) // 2])
            raise KeyboardInterrupt
        write(self, first, rows)

    monkeypatch.setattr(RowFile, "write", half)
    with pytest.raises(KeyboardInterrupt):
        add_points(recorder, 0, 200)
    count = recorder.count
    assert interrupted == [70]
    assert rows_of(recorder.table()) == [row(k) for k in range(count)]
    assert count == 90


def test_a_disk_that_takes_no_rows_though_it_promised_is_explained(tmp_path: Path) -> None:
    rows = np.zeros(10, [("x", float), ("y", float), ("z", float)])
    file = RowFile(tmp_path, ROW, 10)
    with disk_of(0), pytest.raises(OutputError, match=r"cannot continue on disk, in .*: File too large"):
        file.write(0, rows)
    assert file.count == 0


def test_a_folder_that_is_not_there_is_named(tmp_path: Path) -> None:
    recorder = Recorder(SIGNALS, 0, memory=1.0, folder=tmp_path / "gone")
    with pytest.raises(OutputError, match=r"in .*gone: No such file or directory"):
        add_points(recorder, 0, 50)
    assert rows_of(recorder.table()) == [row(k) for k in range(16)]


def test_zeros_are_written_where_the_system_cannot_reserve(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr("os.posix_fallocate")
    recorder = Recorder(SIGNALS, 0, memory=30 * ROW)
    add_points(recorder, 0, 500)
    assert rows_of(recorder.table()) == [row(k) for k in range(500)]
    with disk_of(520 * ROW):
        with pytest.raises(OutputError, match="File too large"):
            add_points(recorder, 500, 500)
        table = recorder.table()
    assert rows_of(table)[:500] == [row(k) for k in range(500)]
    assert isinstance(table, np.memmap)
