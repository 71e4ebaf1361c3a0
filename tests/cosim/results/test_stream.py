"""Streaming: a folder that is a whole result at every moment, whoever kills the program; and the same numbers as
without.
"""

from __future__ import annotations

import io
import os
import resource
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from small_scenarios import small
from test_fmus.build import linear_fmu
from test_fmus.description import Version
from traced_memory import recorded

from cosim import Scenario
from cosim.diagnostics.messages import MessageLog
from cosim.errors import CosimError, OutputError
from cosim.provenance import rerun
from cosim.results import recorder as recorder_module
from cosim.results import stream as stream_module
from cosim.results.formats.growing_npy import growing_header, read_grown
from cosim.results.load_result import load_result
from cosim.results.recorder import Recorder
from cosim.results.result import BaliseRecord, SignalInfo
from cosim.results.results_folder import read_results
from cosim.results.si import InFormerUnits
from cosim.results.stream import Stream
from plant_models.hybrid.units import Unit, parse_unit

SIGNALS = [SignalInfo("a.speed", "km/h"), SignalInfo("a.place", "m")]
UNITS: dict[str, Unit] = {"a.speed": parse_unit("km/h"), "a.place": parse_unit("m")}
DTYPE = np.dtype([("time", float), ("a.speed", float), ("a.place", float)])
ROW = 24


def quietly(scenario: Scenario, **arguments: Any) -> Any:
    return scenario.run(overrides={"certificates": "ignore"}, warn=lambda _text: None, **arguments)


def make_stream(folder: Path, events: list[BaliseRecord] | None = None, log: MessageLog | None = None) -> Stream:
    return Stream(folder, SIGNALS, UNITS.get, {}, lambda: events or [], [log or MessageLog("a")])


def row(number: int) -> tuple[float, float, float]:
    return 0.1 * number, 3.6 * number, -float(number)


# -- the file ---------------------------------------------------------------------------------------------------------


@given(st.lists(st.text("aµ.[],'(){} 1é", min_size=1, max_size=40), unique=True, max_size=30), st.integers(0, 3))
def test_the_header_is_the_one_that_numpy_writes(names: list[str], rows: int) -> None:
    dtype = np.dtype([("time", float), *((name, float) for name in names if name != "time")])
    expected = io.BytesIO()
    np.lib.format.write_array(expected, np.zeros(rows, dtype), version=(3, 0))
    header = growing_header(dtype, rows)
    assert header + bytes(rows * dtype.itemsize) == expected.getvalue()
    assert len(growing_header(dtype, 10**15)) == len(header)


def test_what_the_power_took_is_left_out(tmp_path: Path) -> None:
    rows = np.array([row(k) for k in range(200)], DTYPE)
    file = tmp_path / "table.npy"
    for whole, missing in ((200, 0), (150, 50), (2, 30)):  # rows on the disk, and rows of which it holds zeros only
        file.write_bytes(growing_header(DTYPE, 200) + rows[:whole].tobytes() + bytes(missing * ROW))
        np.testing.assert_array_equal(read_grown(file), rows[:whole])
        file.write_bytes(file.read_bytes()[: -missing * ROW or None] + b"half a row")
        np.testing.assert_array_equal(read_grown(file), rows[:whole])
    file.write_bytes(growing_header(DTYPE, 200))
    assert read_grown(file).shape == (0,)


@pytest.mark.parametrize(
    "content",
    [b"", b"time,a\n1,2\n", growing_header(DTYPE, 2)[:100], b"\x93NUMPY\x03\x00\x10\x00\x00\x00{'descr': 'f8'}  "],
)
def test_what_is_no_table_is_said_to_be_none(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "table.npy").write_bytes(content)
    with pytest.raises(ValueError, match="is not a result table"):
        read_grown(tmp_path / "table.npy")


# -- the recorder -----------------------------------------------------------------------------------------------------

OPERATIONS = st.lists(st.tuples(st.sampled_from(["points", "event", "block"]), st.integers(1, 40)), max_size=20)


@given(OPERATIONS, st.integers(1, 5), st.sampled_from([0.0, 1e9]))
def test_at_every_moment_the_file_holds_the_first_rows(
    operations: list[tuple[str, int]], every: int, seconds: float
) -> None:
    """Against a recorder without a stream, converted by hand: 3.6 km/h are 1 m/s."""
    windows: list[np.ndarray] = []
    with TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        patch.setattr(recorder_module, "BLOCK", 20 * ROW)
        patch.setattr(stream_module, "SECONDS", seconds)
        plain = Recorder(SIGNALS, 100, every=every)
        streamed = Recorder(SIGNALS, 100, every=every, stream=make_stream(Path(folder)))
        number, file = 0, Path(folder) / "table.npy"
        for what, count in operations:
            number += operate(plain, streamed, what, count, number)
            windows.append(np.load(file, allow_pickle=False))
            assert seconds > 0.0 or what == "block" or every > 1 or len(windows[-1]) == streamed.count
        expected = plain.table().copy()
        expected["a.speed"] = UNITS["a.speed"].factor * expected["a.speed"]
        np.testing.assert_array_equal(streamed.table(), expected)
        np.testing.assert_allclose(expected["a.speed"], -expected["a.place"], rtol=5e-16)  # three roundings of 1.1e-16
        for seen in windows:
            np.testing.assert_array_equal(seen, expected[: len(seen)])
        np.testing.assert_array_equal(np.load(file, allow_pickle=False), expected)


def operate(plain: Recorder, streamed: Recorder, what: str, count: int, number: int) -> int:
    """The same rows to both recorders; returns how many."""
    if what == "block":
        rows = [recorder.block(count) for recorder in (plain, streamed)]
        count = min(map(len, rows))
        for recorder, free in zip((plain, streamed), rows, strict=True):
            free[:count] = [row(number + k) for k in range(count)]
            recorder.commit(count)
        return count
    count = 1 if what == "event" else count
    for recorder in (plain, streamed):
        add = recorder.add if what == "points" else recorder.add_event
        for k in range(count):
            add(row(number + k)[0], np.array(row(number + k)[1:]))
    return count


def test_a_table_in_si_is_read_as_it_was_recorded() -> None:
    raw = np.array([row(k) for k in range(5)], DTYPE)
    table = raw.copy()
    table["a.speed"] = raw["a.speed"] / 3.6
    former = InFormerUnits(table, {"a.speed": UNITS["a.speed"], "a.degrees": parse_unit("degC")})
    assert (len(former), former.dtype) == (5, DTYPE)
    np.testing.assert_allclose(former["a.speed"], raw["a.speed"], rtol=5e-16)  # as above
    np.testing.assert_array_equal(former["a.place"], raw["a.place"])
    warm = np.array([(0.0, 283.15)], [("time", float), ("a.degrees", float)])
    degrees = InFormerUnits(warm, {"a.degrees": parse_unit("degC")})["a.degrees"]
    assert degrees == pytest.approx([10.0], rel=1e-14)  # one rounding of 283


def test_memory_stays_flat_and_the_end_is_trimmed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """30 MB of rows with blocks of 0.5 MB; what was reserved beyond them is given back."""
    monkeypatch.setattr(recorder_module, "BLOCK", 0.5e6)
    signals, values = [SignalInfo(f"a.s{i}") for i in range(99)], np.ones(99)
    stream = Stream(tmp_path, signals, lambda _name: None, {}, list, [])
    recorder = Recorder(signals, 0, stream=stream)
    table, peak = recorded(recorder, values, 37_500)
    assert table.nbytes == 30e6
    assert peak < 1.5e6  # a block, its copy in SI
    stream.finish()
    size = (tmp_path / "table.npy").stat().st_size
    assert size == 30e6 + len(growing_header(table.dtype, 0))


def test_telegrams_and_messages_follow(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stream_module, "SECONDS", 0.0)
    events, log = (
        [BaliseRecord(0.1, 0.2, "B1", 5.0, 5.0, odometer_reading=1.0, outcomes={"a;b": "accepted"})],
        MessageLog("a"),
    )
    recorder = Recorder(SIGNALS, 0, stream=Stream(tmp_path, SIGNALS, UNITS.get, {}, lambda: events, [log]))
    for k in range(3):
        log.add(0.1 * k, f"said {k}", "warning")
        recorder.add(*row_of(k))
        found = read_results(tmp_path)
        assert [m.text for m in found.messages] == [f"said {i}" for i in range(k + 1)]
        assert list(found.events) == events
        events.append(BaliseRecord(k, k, f"B{k + 2}", 1 / 3, 5.0, odometer_reading=2.0))
    with (tmp_path / "events.csv").open("a") as file:
        file.write("9.0,9.0,torn")
    assert [e.identity for e in read_results(tmp_path).events] == ["B1", "B2", "B3"]


def row_of(number: int) -> tuple[float, np.ndarray]:
    return row(number)[0], np.array(row(number)[1:])


# -- runs -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("every", [1, 7])
def test_a_streamed_run_is_an_equal_run(tmp_path: Path, every: int) -> None:
    scenario = small().master(record_every=every)
    kept, streamed = quietly(scenario), quietly(scenario, stream=tmp_path)
    np.testing.assert_array_equal(streamed.result.table, kept.result.table)
    assert list(streamed.result.events) == list(kept.result.events)
    assert streamed.result.signals == kept.result.signals
    found = load_result(tmp_path)
    np.testing.assert_array_equal(found.table, kept.result.table)
    assert (list(found.events), found.failure) == (list(kept.result.events), None)
    assert found.summary["premises"] == kept.result.summary["premises"]
    inode = (tmp_path / "table.npy").stat().st_ino
    assert set(streamed.write(tmp_path, report=False)) == {"npy", "events", "messages", "summary", "made_from"}
    assert (tmp_path / "table.npy").stat().st_ino == inode  # not copied
    other = streamed.write(tmp_path / "other", report=False)["npy"]
    assert other.read_bytes() == (tmp_path / "table.npy").read_bytes()


def test_formats_that_are_asked_for_are_written_as_well(tmp_path: Path) -> None:
    streamed = quietly(small().report(tables=["csv"]), stream=tmp_path)
    assert not (tmp_path / "table.csv").exists()
    assert set(streamed.write(tmp_path, report=False)) == {"csv", "npy", "events", "messages", "summary", "made_from"}


@pytest.mark.compiler
@pytest.mark.parametrize(("version", "stepper"), [(2, "compiled"), (3, "compiled"), (3, "python")])
def test_a_foreign_fmu_in_kilometres_per_hour(
    tmp_path: Path, version: Version, stepper: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """v' = -v from 36 km/h: 10 exp(-t) m/s, to the rounding of 400 exact steps."""
    monkeypatch.setattr(recorder_module, "BLOCK", 1e3)
    fmu = linear_fmu(
        tmp_path, "coast", [[-1.0]], [[0.0]], [[1.0]], [[0.0]], version=version, x0=[36.0], units={"y1": "km/h"}
    )
    scenario = Scenario(stop=4.0, step=0.01, master={"stepper": stepper}).add("train", fmu=str(fmu))
    kept, streamed = quietly(scenario), quietly(scenario, stream=tmp_path / "out")
    np.testing.assert_array_equal(streamed.result.table, kept.result.table)
    assert (
        streamed.result.info("train.y1")
        == kept.result.info("train.y1")
        == read_results(tmp_path / "out").info("train.y1")
    )
    assert (streamed.result.info("train.y1").unit, streamed.result.info("train.y1").display_unit) == ("m/s", "km/h")
    table = np.load(tmp_path / "out" / "table.npy")
    np.testing.assert_allclose(table["train.y1"], 10.0 * np.exp(-table["time"]), rtol=1e-12)


def test_nothing_of_a_former_run_is_left_and_who_reads_it_may_go_on(tmp_path: Path) -> None:
    for name in ("table.csv", "table.mat", "report.html"):
        (tmp_path / name).write_text("of a former run")
    seen: list[list[str]] = []
    first = quietly(
        small(), stream=tmp_path, progress=lambda _t, _stop: seen.append(sorted(p.name for p in tmp_path.iterdir()))
    )
    assert seen[0] == [".block", "events.csv", "made_from", "messages.csv", "summary.json", "table.npy"]
    before = first.result.table.copy()
    quietly(small().set("locomotive.train_speed", 5.0), stream=tmp_path)
    np.testing.assert_array_equal(first.result.table, before)


def test_a_run_that_cannot_begin_leaves_former_results_whole(tmp_path: Path) -> None:
    quietly(small()).write(tmp_path, report=False)
    before = {p: p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()}
    with pytest.raises(CosimError, match="every"):
        quietly(small().set("driver.every", 2).master(control="doubling"), stream=tmp_path)
    assert {p: p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()} == before


@pytest.mark.parametrize("block", [4e3, 40e3])
def test_a_full_disk_ends_the_run_and_the_folder_has_every_row_that_fits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, block: float
) -> None:
    monkeypatch.setattr(recorder_module, "BLOCK", block)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, hard))
    try:
        outcome = quietly(small().set("step", 0.001), stream=tmp_path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert outcome.failure is not None
    assert f"cannot be streamed to {tmp_path} any further: File too large" in outcome.failure
    whole = quietly(small().set("step", 0.001)).result.table
    fit = (60_000 - len(growing_header(whole.dtype, 0))) // whole.dtype.itemsize
    assert len(outcome.result.table) == fit
    assert f"The {fit} rows up to there are kept" in outcome.failure
    np.testing.assert_array_equal(read_results(tmp_path).table, whole[: len(outcome.result.table)])


@pytest.mark.parametrize("kind", ["stream", "fallback"])
def test_a_folder_that_is_removed_on_the_way_costs_no_row(tmp_path: Path, kind: str) -> None:
    """Where a telegram comes that it should take the run ends, in words; its rows are there."""
    expected = quietly(small())
    removed: list[float] = []

    def remove(now: float, _end: float) -> None:
        removed.append(now)
        shutil.rmtree(tmp_path / "run", ignore_errors=True)

    outcome = quietly(small(), progress=remove, **{kind: tmp_path / "run"})
    assert removed
    assert "No such file or directory" in str(outcome.failure)
    rows = outcome.result.table
    assert len(rows) > 10
    assert np.array_equal(rows, expected.result.table[: len(rows)])
    outcome.write(tmp_path / "run", report=False)
    assert len(load_result(tmp_path / "run").table) == len(rows)


def test_a_folder_that_cannot_be_written_is_refused_before_the_run(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match=r"cannot be written to .*file/out"):
        quietly(small(), stream=tmp_path / "file" / "out")


ENVIRONMENT = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}

# -- deaths -----------------------------------------------------------------------------------------------------------

CHILD = """
import ctypes, os, signal, sys
from cosim.results import stream
from fmu_observer.block.fmi3_block import FMI3Block
from small_scenarios import small

folder, how = sys.argv[1:]
deaths = {"segfault": lambda: ctypes.string_at(0), "kill": lambda: os.kill(os.getpid(), signal.SIGKILL)}
do_step = FMI3Block.doStep

def fatal_step(self, currentCommunicationPoint, *arguments, **more):
    if currentCommunicationPoint > 0.295:
        deaths[how]()
    return do_step(self, currentCommunicationPoint, *arguments, **more)

stream.SECONDS = 0.0
FMI3Block.doStep = fatal_step
small(certificates="ignore").run(stream=folder)
"""


@pytest.mark.parametrize(("how", "code"), [("segfault", -signal.SIGSEGV), ("kill", -signal.SIGKILL)])
def test_what_was_computed_outlives_the_program(tmp_path: Path, how: str, code: int) -> None:
    """It dies within the step from 0.30 s on: all before that is there, and it runs again from what the folder
    holds.
    """
    done = subprocess.run(
        [sys.executable, "-c", CHILD, str(tmp_path), how], capture_output=True, check=False, env=ENVIRONMENT
    )
    assert done.returncode == code, done.stderr.decode()
    found, whole = load_result(tmp_path), quietly(small()).result
    assert found.failure is not None
    assert found.failure.startswith("the run did not end: ")
    assert found.failure.endswith("They end at t = 0.3 s.")
    assert found.summary["reached"] == found.time[-1] == 0.3
    np.testing.assert_array_equal(found.table, whole.table[: len(found.table)])
    assert list(found.events) == list(whole.events)[: len(found.events)]
    assert len(found.events) == 2  # at 1.0 m and 2.5 m; 10 m/s
    if how == "kill":  # once is enough
        again = rerun(tmp_path)
        assert again.verdict == "bit-identical"
        assert again.outcome.failure is None
