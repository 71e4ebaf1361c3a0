"""Tables of other tools as CSV, folders, and what is said of files that hold no result."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import fmpy.util
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from odd_results import bits, odd_result

from cosim import load_result
from cosim.errors import OutputError
from cosim.results.result import SignalInfo
from cosim.results.results_folder import write_results

NAN = math.nan
SI = {"v": SignalInfo("v", "m/s", "km/h")}

TABLES = {
    "plain, as FMI-LS-REF": ("time,v,b[1]\n0,10,1\n0.5,20,2\n", {}),
    "fmpy": ('"time","v","b[1]"\n0.0,10.0,1.0\n0.5,20.0,2.0\n', {}),
    "OpenModelica, with a last separator": ('"time","v","b[1]",\n0,10,1,\n0.5,20,2,\n', {}),
    "Dymola, with units": ('"Time [s]","v [km/h]","b[1]"\n0,36,1\n0.5,72,2\n', SI),
    "units without space": ("time[s],v[km/h],b[1]\n0,36,1\n0.5,72,2\n", SI),
    "units below": ("time;v;b[1]\ns;km/h;-\n0;36;1\n0,5;72;2\n", SI),
    "spreadsheet with decimal commas": ("\ufefftime;v [km/h];b[1]\r\n0;36,0;1\r\n0,5;72;2\r\n\r\n;;\r\n\r\n", SI),
    "spreadsheet with a hint": ("sep=;\ntime;v;b[1]\n0;10;1\n0,5;20;2\n", {}),
    "tabs and milliseconds": ("Time [ms]\tv\tb[1]\n0\t10\t1\n500\t20\t2\n", {}),
    "row numbers of a data frame": (",time,v,b[1]\n0,0.0,10.0,1\n1,0.5,20.0,2\n", {}),
    "time in the middle": ("v,t,b[1]\n10,0,1\n20,0.5,2\n", {}),
    "a column twice": ("time,v,b[1],v\n0,10,1,10\n0.5,20,2,20\n", {}),
    "spaces": ("time, v (km/h), b[1] \n 0, 36, 1\n 0.5, 72, 2 \n", SI),
    "comments above": ("# of the bench, 2026\n\n% 2 Hz\ntime,v [km/h],b[1]\n0,36,1\n0.5,72,2\n", SI),
    "names in a comment, as of NumPy": ("# run 7\n# time,v,b[1]\n0,10,1\n0.5,20,2\n", {}),
    "names in a comment, decimal commas": ("# time;v;b[1]\n0,0;10;1\n0,5;20;2\n", {}),
    "numbers in quotes": ('"time","v","b[1]"\n"0","10","1"\n"0,5","20","2"\n', {}),
}


@pytest.mark.parametrize("kind", TABLES)
def test_csv_of_other_tools(kind: str, tmp_path: Path) -> None:
    text, signals = TABLES[kind]
    (tmp_path / "t.csv").write_bytes(text.encode())
    result = load_result(tmp_path / "t.csv")
    assert result.table.dtype.names == ("time", "v", "b[1]")
    assert result.table.tolist() == [(0.0, 10.0, 1.0), (0.5, 20.0, 2.0)]  # 36 / 3.6 and 72 / 3.6 are exact
    assert list(result.signals) == [signals.get(name, SignalInfo(name)) for name in ("v", "b[1]")]
    assert result.summary == {"file": str(tmp_path / "t.csv"), "events_recorded": False}


@pytest.mark.parametrize(
    ("text", "columns"),
    [
        ("time,a,b\n0,true,\n1,False,NA\n", {"a": [1.0, 0.0], "b": [NAN, NAN]}),
        ("time,a\n0,1.#INF\n1,-1.#IND00\n", {"a": [math.inf, NAN]}),
        ("time,a\n0,Infinity\n1,-inf\n", {"a": [math.inf, -math.inf]}),
        ("time,a\n0,1 2\n1,3 4\n", {"a[1]": [1.0, 3.0], "a[2]": [2.0, 4.0]}),
        ("time,a [km/h]\n0,36 72\n1,3.6 7.2\n", {"a[1]": [10.0, 1.0], "a[2]": [20.0, 2.0]}),
        ("time,a[1,2],b\n0,1,2\n1,3,4\n", {"a[1,2]": [1.0, 3.0], "b": [2.0, 4.0]}),
    ],
)
def test_cells_of_other_tools(text: str, columns: dict[str, list[float]], tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text(text)
    result = load_result(tmp_path / "t.csv")
    assert result.table.dtype.names == ("time", *columns)
    for name, values in columns.items():
        np.testing.assert_allclose(result[name], values, rtol=1e-15)  # one multiplication by 1000 / 3600


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
def test_encodings(encoding: str, tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_bytes("time;Öl [°C]\n0;20\n".encode(encoding))
    result = load_result(tmp_path / "t.csv")
    assert (result.signals[0].name, result.signals[0].unit, result["Öl"].tolist()) == ("Öl", "K", [293.15])


def test_fmpy_reads_what_we_read(tmp_path: Path) -> None:
    table = odd_result(9, ("train.speed", "a b")).table
    fmpy.util.write_csv(tmp_path / "t.csv", table)
    assert bits(load_result(tmp_path / "t.csv").table) == bits(fmpy.util.read_csv(tmp_path / "t.csv")) == bits(table)


@settings(max_examples=40, deadline=None)
@given(
    rows=st.lists(st.tuples(st.floats(0, 1e6), st.floats(allow_nan=False)), min_size=1, max_size=6).map(sorted),
    separator=st.sampled_from(";\t"),
    end=st.sampled_from(["\n", "\r\n"]),
    quoted=st.booleans(),
    bom=st.booleans(),
    blank=st.booleans(),
    unit=st.sampled_from(["", " [m/s]", "[m]"]),
)
def test_dialects_agree(
    rows: list[tuple[float, float]],
    separator: str,
    end: str,
    quoted: bool,
    bom: bool,
    blank: bool,
    unit: str,
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    mark = '"' if quoted else ""
    lines = [separator.join(f"{mark}{name}{mark}" for name in ("Time", f"x{unit}"))]
    lines += [separator.join(repr(value).replace(".", ",") for value in row) for row in rows]
    path = tmp_path_factory.mktemp("dialect") / "t.txt"
    path.write_bytes((("\ufeff" if bom else "") + end.join(lines) + end + (end * 2 if blank else "")).encode())
    result = load_result(path)
    assert result.table.tolist() == rows
    assert result.signals[0].unit == (unit.strip(" []") or "1")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is empty"),
        ("\n \n", "is empty"),
        ("0,1\n1,2\n", "line 1: expected names of columns"),
        ("time,a\n0,1\n\n1,two\n", r"line 4, column 'a': expected a number, got 'two'"),
        ("time,a\n0,1\n1\n", "line 3: expected 2 cells separated by commas, got 1"),
        ("of the bench\ntime,a\n0,1\n", "line 2: expected 1 .* as names in line 1 .* begins with # or %.*, got 2"),
        ("# nothing else\n", "is empty"),
        ("time;a\n0;1\n1;2;3\n", "line 3: expected 2 cells separated by semicolons, got 3"),
        ("time,a\n0,1\n2,1\n1,1\n", r"time goes backwards in row 3, from 2 to 1 s"),
        ("time,a\n0,1\nnan,1\n", r"the time in row 2 is not a finite number"),
        ("time,a,a\n0,1,2\n", "two different columns are called 'a'"),
        ("x,y\n0,1\n", "no column 'time'; columns: x, y"),
        ("time [m],y\n0,1\n", "unit of time 'm'"),
        ("time,,y\n0,1,2\n", "column 2 has no name"),
        ("time,a\n0,1 2\n1,3\n", "line 3, column 'a': expected as many numbers"),
        ("a\0b", "neither text nor one of the result formats"),
        ("PK\x03\x04", "is an archive"),
    ],
)
def test_csv_that_is_none_is_refused_in_words(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_bytes(text.encode())
    with pytest.raises(OutputError, match=message) as caught:
        load_result(path)
    assert str(path) in str(caught.value)


def test_headings_alone_are_an_empty_result(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text("time,v [m/s]\n")
    result = load_result(tmp_path / "t.csv")
    assert (len(result.table), result.signals[0]) == (0, SignalInfo("v", "m/s"))


def test_long_table_going_backwards_names_its_row(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cosim.results.formats.columns.CHUNK", 7)
    for row in (6, 7, 8, 13, 20):
        time = np.arange(30.0)
        time[row] = time[row - 1] - 0.5
        np.save(tmp_path / "t.npy", np.array(list(zip(time, time, strict=True)), [("time", "f8"), ("a", "f8")]))
        with pytest.raises(OutputError, match=f"backwards in row {row + 1}, from {row - 1} to {row - 1.5} s"):
            load_result(tmp_path / "t.npy")


# --- places -----------------------------------------------------------------------------------------------------------


def test_misspelt_path_names_its_neighbours(tmp_path: Path) -> None:
    (tmp_path / "train.csv").write_text("time\n")
    with pytest.raises(OutputError, match=r"There is no .*trian\.csv; did you mean 'train\.csv'"):
        load_result(tmp_path / "trian.csv")
    with pytest.raises(OutputError, match="there is no folder"):
        load_result(tmp_path / "results" / "trian.csv")


def test_folder_without_a_result_says_what_it_holds(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="It is empty"):
        load_result(tmp_path)
    write_results(odd_result(), tmp_path / "run", ("csv",))
    with pytest.raises(OutputError, match=r"Results are in: .*run\."):
        load_result(tmp_path)
    (tmp_path / "run" / "summary.json").unlink()
    with pytest.raises(OutputError, match=r"summary\.json is missing. For the table alone: .*table\.csv"):
        load_result(tmp_path / "run")
    assert bits(load_result(tmp_path / "run" / "table.csv").table)[1] == bits(odd_result().table)[1]


def test_broken_table_of_a_folder_is_named(tmp_path: Path) -> None:
    write_results(odd_result(), tmp_path, ("parquet",))
    (tmp_path / "table.parquet").write_bytes(b"PAR1")
    with pytest.raises(OutputError, match=r"table\.parquet is not a Parquet file"):
        load_result(tmp_path)


@pytest.mark.parametrize("name", ["t.parquet", "t.h5", "t.npy", "t.mat", "t.modelica.mat"])
@pytest.mark.parametrize("kept", [20, 300])
def test_file_cut_short_is_refused_in_words(name: str, kept: int, tmp_path: Path) -> None:
    odd_result(200, ("a", "b")).save(tmp_path / name)
    content = (tmp_path / name).read_bytes()
    (tmp_path / name).write_bytes(content[:kept])
    with pytest.raises(OutputError, match=name.replace(".", r"\.")):
        load_result(tmp_path / name)


def test_events_beside_a_table_are_its_own(tmp_path: Path) -> None:
    result = replace(odd_result(9, ("a",)), signals=[SignalInfo("a", "m")])
    assert [p.name for p in result.save(tmp_path / "run.csv")] == ["run.csv", "run.events.csv"]
    (tmp_path / "run.events.csv").write_text("stamp\n")
    with pytest.raises(OutputError, match=r"run\.events\.csv is not an event table"):
        load_result(tmp_path / "run.csv")
