"""Result files: what was written is read back to the last bit, by our readers and by fmpy, MATLAB's format and JSON."""

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import fmpy.util
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import loadmat

from cosim.errors import OutputError
from cosim.results.formats.csv_file import CsvFormat, write_csv
from cosim.results.formats.mat_file import MatFormat, _matlab_names
from cosim.results.record_rows import TELEGRAM_ROWS, _outcomes_text, parse_outcomes
from cosim.results.result import BaliseRecord, Result, SignalInfo
from cosim.results.results_folder import check_writable, read_results, write_results
from cosim.results.summary_file import read_summary, write_summary

ODD = (0.1, -0.0, 5e-324, -2.2250738585072011e-308, 1.7976931348623157e308, math.inf, -math.inf, math.nan, 1 / 3)


def make_table(columns: dict[str, Any]) -> np.ndarray:
    rows = len(next(iter(columns.values())))
    table = np.empty(rows, [(name, np.float64) for name in columns])
    for name, values in columns.items():
        table[name] = values
    return table


def bits(table: np.ndarray) -> tuple[tuple[str, ...] | None, bytes]:
    return table.dtype.names, table.tobytes()


@pytest.fixture
def result() -> Result:
    time = [0.0, 0.1, 0.1, 0.2]  # an event at 0.1 s: before and after
    table = make_table(
        {"time": time, "locomotive.position": [0.0, 0.1, 0.1, 1 / 3], "observer.slip": [0, 1e-310, math.nan, -0.0]}
    )
    signals = [
        SignalInfo("locomotive.position", "m", "km", "continuous", "of the front end"),
        SignalInfo("observer.slip", variability="discrete"),
    ]
    events = [
        BaliseRecord(
            0.1,
            0.15,
            'B;1, "north"',
            1 / 3,
            0.1,
            2.0,
            13.9,
            "true",
            "rollback",
            1e-12,
            {"a;b": "accepted", "c=d%": "late"},
        ),
        BaliseRecord(0.2, math.nan, "", 10.0, 10.0, kind="missed"),
    ]
    return Result(table, signals, events, {"step": 0.1, "warnings": ["été"]}, "stopped")


def equal_events(first: Any, second: Any) -> bool:
    return repr(list(first)) == repr(list(second))  # repr, since NaN differs from itself


# --- CSV --------------------------------------------------------------------------------------------------------------


def test_csv_reads_back_bit_by_bit(result: Result, tmp_path: Path) -> None:
    write_csv(tmp_path / "t.csv", result.table)
    assert bits(CsvFormat.read(tmp_path / "t.csv").table) == bits(result.table)


def test_fmpy_reads_the_csv_bit_by_bit(result: Result, tmp_path: Path) -> None:
    write_csv(tmp_path / "t.csv", result.table)
    assert bits(fmpy.util.read_csv(tmp_path / "t.csv")) == bits(result.table)


def test_we_read_the_csv_of_fmpy(result: Result, tmp_path: Path) -> None:
    fmpy.util.write_csv(tmp_path / "t.csv", result.table)
    assert bits(CsvFormat.read(tmp_path / "t.csv").table) == bits(result.table)


@settings(max_examples=60, deadline=None)
@given(rows=st.lists(st.tuples(st.floats(), st.floats() | st.sampled_from(ODD)), max_size=8))
def test_csv_keeps_every_float(rows: list[tuple[float, float]], tmp_path_factory: pytest.TempPathFactory) -> None:
    table = np.array(rows, dtype=[("time", "f8"), ("a.b", "f8")])
    for name in table.dtype.names or ():  # the payload bits of a NaN have no text
        table[name][np.isnan(table[name])] = math.nan
    path = tmp_path_factory.mktemp("csv") / "t.csv"
    write_csv(path, table)
    assert bits(CsvFormat.read(path).table) == bits(table)
    if len(table):
        assert bits(fmpy.util.read_csv(path)) == bits(table)


def test_csv_names_may_hold_commas_and_quotes(tmp_path: Path) -> None:
    table = make_table({"time": [0.0], "a[1,2]": [1.0], 'der("x")': [2.0], "#c": [3.0]})
    write_csv(tmp_path / "t.csv", table)
    assert bits(CsvFormat.read(tmp_path / "t.csv").table) == bits(table)


@pytest.mark.parametrize("text", ["", "x,y\n1,2\n", '"time","a"\n1.0\n', '"time","a"\n1.0,two\n', '"time"\n1.0,2.0\n'])
def test_csv_that_is_no_result_table_is_refused(text: str, tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text(text)
    with pytest.raises(ValueError, match="not a result table"):
        CsvFormat.read(tmp_path / "t.csv")


@pytest.mark.parametrize("dtype", [[("t", "f8")], [("time", "f8"), ("a", "i4")], [("time", "f4")]])
def test_table_of_another_layout_is_not_written(dtype: Any, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="result table"):
        write_csv(tmp_path / "t.csv", np.zeros(2, dtype))


# --- MATLAB -----------------------------------------------------------------------------------------------------------


def test_mat_reads_back_bit_by_bit(result: Result, tmp_path: Path) -> None:
    MatFormat.write(tmp_path / "t.mat", result)
    back = MatFormat.read(tmp_path / "t.mat")
    assert bits(back.table) == bits(result.table)
    assert list(back.signals) == list(result.signals)
    assert equal_events(back.events, result.events)


@pytest.mark.parametrize("rows", [0, 1, 2])
@pytest.mark.parametrize("telegrams", [0, 1])
def test_mat_of_few_rows_and_telegrams(rows: int, telegrams: int, result: Result, tmp_path: Path) -> None:
    small = replace(result, table=result.table[:rows], events=result.events[:telegrams])
    MatFormat.write(tmp_path / "t.mat", small)
    back = MatFormat.read(tmp_path / "t.mat")
    assert bits(back.table) == bits(small.table)
    assert equal_events(back.events, small.events)


def test_mat_of_time_alone(tmp_path: Path) -> None:
    table = make_table({"time": [0.0, 1.0]})
    MatFormat.write(tmp_path / "t.mat", Result(table, []))
    assert bits(MatFormat.read(tmp_path / "t.mat").table) == bits(table)


def test_mat_as_matlab_sees_it(result: Result, tmp_path: Path) -> None:
    MatFormat.write(tmp_path / "t.mat", result)
    seen = loadmat(tmp_path / "t.mat")
    assert seen["locomotive_position"].shape == (4, 1)
    assert seen["units"]["locomotive_position"][0, 0][0] == "m"
    assert seen["events"]["stamp"][0, 0].ravel().tolist() == [0.1, 0.2]


def test_mat_of_another_kind_is_refused(tmp_path: Path) -> None:
    (tmp_path / "t.mat").write_bytes(b"time,a\n" * 40)
    with pytest.raises(ValueError, match="not a MATLAB result file"):
        MatFormat.read(tmp_path / "t.mat")


def test_matlab_names_are_legal_and_clashes_are_numbered() -> None:
    names = _matlab_names(["a.b_c", "a_b.c", "units", "end", "1st", "é"], ["units"])
    assert list(names.values()) == ["a_b_c", "a_b_c_2", "units_2", "xend", "x1st", "x_"]


@given(st.lists(st.text(max_size=80), unique=True, max_size=20))
def test_matlab_names_are_unique_identifiers(names: list[str]) -> None:
    legal = list(_matlab_names(names).values())
    assert len(set(legal)) == len(names)
    assert all(name.isidentifier() and name.isascii() and name[0].isalpha() and len(name) <= 63 for name in legal)


# --- events and summary -----------------------------------------------------------------------------------------------


def test_events_read_back(result: Result, tmp_path: Path) -> None:
    TELEGRAM_ROWS.write(tmp_path / "e.csv", result.events)
    assert equal_events(TELEGRAM_ROWS.read(tmp_path / "e.csv"), result.events)


@given(
    st.dictionaries(
        st.text(st.characters(exclude_categories=["Cs"]), max_size=6), st.text("ab;=%3", max_size=4), max_size=4
    )
)
def test_outcomes_read_back(outcomes: dict[str, str]) -> None:
    assert parse_outcomes(_outcomes_text(outcomes)) == outcomes


def test_an_outcome_of_an_earlier_version_is_read_under_its_name_of_today(result: Result, tmp_path: Path) -> None:
    TELEGRAM_ROWS.write(tmp_path / "e.csv", [replace(result.events[0], outcomes={"observer": "told", "told": "late"})])
    (event,) = TELEGRAM_ROWS.read(tmp_path / "e.csv")
    assert event.outcomes == {"observer": "notified", "told": "late"}


def test_broken_event_row_names_its_line(result: Result, tmp_path: Path) -> None:
    path = tmp_path / "e.csv"
    TELEGRAM_ROWS.write(path, result.events)
    path.write_text(path.read_text().replace("0.2,nan", "soon,nan"))
    with pytest.raises(ValueError, match="line 3"):
        TELEGRAM_ROWS.read(path)


def test_summary_is_strict_json(tmp_path: Path) -> None:
    path = tmp_path / "s.json"
    write_summary(
        path,
        {"z": np.float32(0.5), "a": [math.nan, math.inf, -math.inf], "n": np.arange(2), "b": np.True_, "p": Path("x")},
    )
    strict = json.loads(path.read_text(), parse_constant=lambda text: pytest.fail(f"{text} is not JSON"))
    assert strict == {"a": [None, "inf", "-inf"], "b": True, "n": [0, 1], "p": "x", "z": 0.5}
    assert list(strict) == sorted(strict)
    assert read_summary(path)["a"] == [None, math.inf, -math.inf]


# --- folder -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("formats", [("csv", "mat"), ("csv",), ("mat",), ("npy",)])
def test_folder_reads_back(formats: tuple[str, ...], result: Result, tmp_path: Path) -> None:
    paths = write_results(result, tmp_path / "new" / "out", formats)
    back = read_results(tmp_path / "new" / "out")
    assert set(paths) == {*formats, "events", "messages", "summary"}
    assert sorted(p.name for p in (tmp_path / "new" / "out").iterdir()) == sorted(p.name for p in paths.values())
    assert bits(back.table) == bits(result.table)
    assert list(back.signals) == list(result.signals)
    assert equal_events(back.events, result.events)
    assert (back.summary, back.failure) == (result.summary, result.failure)


def test_table_of_an_earlier_run_does_not_stay(result: Result, tmp_path: Path) -> None:
    write_results(result, tmp_path)
    write_results(result, tmp_path, ("mat",))
    assert not (tmp_path / "table.csv").exists()


def test_folder_below_a_file_is_refused_before_the_run(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="Choose another output folder"):
        check_writable(tmp_path / "file" / "out")


def test_folder_without_permission_is_refused_before_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("tempfile.TemporaryFile", refuse)  # the mode bits would not stop a superuser
    with pytest.raises(OutputError, match="Permission denied"):
        check_writable(tmp_path)


def test_file_name_taken_by_a_folder_is_refused(result: Result, tmp_path: Path) -> None:
    (tmp_path / "table.csv").mkdir()
    with pytest.raises(OutputError, match=r"table\.csv is a folder"):
        write_results(result, tmp_path)


def test_failed_write_leaves_the_former_files(result: Result, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_results(result, tmp_path)
    before = {p.name: p.read_bytes() for p in tmp_path.iterdir()}

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("cosim.results.results_folder.write_summary", full)
    with pytest.raises(OutputError, match="No space left"):
        write_results(replace(result, table=result.table[:1]), tmp_path)
    assert {p.name: p.read_bytes() for p in tmp_path.iterdir()} == before


def test_unknown_format_is_refused(result: Result, tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="'csv'"):
        write_results(result, tmp_path, ("cvs",))


@pytest.mark.parametrize("missing", ["table.csv", "events.csv", "summary.json"])
def test_incomplete_folder_names_the_file(missing: str, result: Result, tmp_path: Path) -> None:
    write_results(result, tmp_path, ("csv",))
    (tmp_path / missing).unlink()
    with pytest.raises(OutputError, match="No complete result"):
        read_results(tmp_path)


def test_summary_of_another_layout_is_refused(result: Result, tmp_path: Path) -> None:
    write_results(result, tmp_path, ("csv",))
    (tmp_path / "summary.json").write_text("{}")
    with pytest.raises(OutputError, match="layout"):
        read_results(tmp_path)
