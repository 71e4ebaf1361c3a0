"""Every format gives back what was written, to the last bit, and readers of other people see the same."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
import sdf
import xarray as xr
from hypothesis import given, settings
from odd_results import NAMES, assert_equal, bits, odd_result, results
from scipy.io import loadmat

from cosim import load_result
from cosim.errors import OutputError
from cosim.results.formats import about
from cosim.results.formats.headings import split_unit, with_unit
from cosim.results.formats.known_formats import FORMATS, format_of
from cosim.results.result import Result, SignalInfo
from cosim.results.results_folder import check_writable, read_results, write_results

COMPLETE = tuple(name for name, item in FORMATS.items() if item.keeps)


def written(result: Result, folder: Path, name: str) -> Path:
    path = folder / f"t{FORMATS[name].endings[0]}"
    FORMATS[name].write(path, result)
    return path


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("rows", [0, 1, 2, 9])
@pytest.mark.parametrize("telegrams", [0, 1, 2])
def test_odd_results_are_read_back(name: str, rows: int, telegrams: int, tmp_path: Path) -> None:
    result = odd_result(rows)
    result = replace(result, events=result.events[:telegrams])
    path = written(result, tmp_path, name)
    assert bits(FORMATS[name].read(path).table) == bits(result.table)
    if name in COMPLETE:
        assert_equal(result, FORMATS[name].read(path))
        assert_equal(result, load_result(path))


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("names", [(), ("a",)])
def test_few_columns_are_read_back(name: str, names: tuple[str, ...], tmp_path: Path) -> None:
    result = odd_result(3, names)
    back = FORMATS[name].read(written(result, tmp_path, name))
    assert_equal(result, back if name in COMPLETE else replace(result, table=back.table))


@settings(max_examples=40, deadline=None)
@given(result=results())
@pytest.mark.parametrize("name", FORMATS)
def test_any_result_is_read_back(name: str, result: Result, tmp_path_factory: pytest.TempPathFactory) -> None:
    path = written(result, tmp_path_factory.mktemp("any"), name)
    back = FORMATS[name].read(path)
    assert_equal(result, back if name in COMPLETE else replace(result, table=back.table))


@pytest.mark.parametrize("name", [name for name in FORMATS if name != "hdf5"])
def test_thousands_of_columns_are_read_back(name: str, tmp_path: Path) -> None:
    result = odd_result(2, tuple(f"component.signal_{i}" for i in range(1500)))
    assert bits(FORMATS[name].read(written(result, tmp_path, name)).table) == bits(result.table)


def test_hdf5_ties_more_signals_to_time_than_an_object_header_holds(tmp_path: Path) -> None:
    result = Result(np.zeros(1, [(n, "f8") for n in ("time", *(f"s{i}" for i in range(4100)))]), [])
    with h5py.File(written(result, tmp_path, "hdf5")) as file:
        assert file["s4099"].dims[0][0] == file["time"]  # 4095 fit into 64 KB (h5py issue 1887)


@pytest.mark.parametrize("name", COMPLETE)
def test_blocks_make_one_table(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    result = odd_result(101, ("a", "b"))
    mapped = np.memmap(tmp_path / "rows", result.table.dtype, "w+", shape=(101,))
    mapped[:] = result.table
    monkeypatch.setattr(about.blocks, "__defaults__", (7 * result.table.dtype.itemsize,))
    assert_equal(result, load_result(written(replace(result, table=mapped), tmp_path, name)))
    assert [len(rows) for _, rows in about.blocks(mapped)] == [7] * 14 + [3]


def test_long_parquet_files_are_read_in_pieces(tmp_path: Path) -> None:
    table = np.arange(140_000.0).view([("time", "f8"), ("a", "f8")])
    assert bits(load_result(written(Result(table, [SignalInfo("a")]), tmp_path, "parquet")).table) == bits(table)


@pytest.mark.parametrize("name", ["parquet", "hdf5", "modelica"])
def test_summary_and_failure_are_kept(name: str, tmp_path: Path) -> None:
    back = load_result(written(odd_result(), tmp_path, name))
    assert back.failure == "stopped at 0.3 s"
    assert back.summary["largest"] == math.inf
    assert back.summary["components"][0]["parameters"] == {"mass": 80e3, "name": "text"}


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("dtype", [[("t", "f8")], [("time", "f8"), ("a", "i4")]])
def test_table_of_another_layout_is_not_written(name: str, dtype: Any, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="result table"):
        written(Result(np.zeros(2, dtype), []), tmp_path, name)


# --- as others read it ------------------------------------------------------------------------------------------------


def test_pandas_reads_the_parquet_file(tmp_path: Path) -> None:
    result = odd_result()
    frame = pd.read_parquet(written(result, tmp_path, "parquet"))
    assert frame.attrs["units"] == {"time": "s"} | {s.name: s.unit for s in result.signals}
    assert all(
        frame[n].to_numpy().tobytes() == np.ascontiguousarray(result.table[n]).tobytes() for n in ("time", *NAMES)
    )
    field = pq.read_schema(tmp_path / "t.parquet").field("der(train.x)")
    assert field.metadata == {
        b"unit": b"1",
        b"variability": b"discrete",
        b"description": "über [x]".encode(),
        b"display_unit": b"km/h",
    }


def test_h5py_and_xarray_read_the_hdf5_file(tmp_path: Path) -> None:
    names = ("train.speed", "a[1,2]")
    result = odd_result(9, names)
    path = written(result, tmp_path, "hdf5")
    with h5py.File(path) as file:
        assert file["/train.speed"].attrs["unit"] == "m/s"
        assert file["train.speed"].dims[0][0] == file["time"]
        assert file["events/stamp"][:].tolist() == [0.1, 0.2]
    with xr.open_dataset(path, engine="h5netcdf") as data:
        assert data["train.speed"].dims == ("time",)
        assert data["train.speed"].attrs["units"] == "m/s"
        assert data["a[1,2]"].to_numpy().tobytes() == np.ascontiguousarray(result["a[1,2]"]).tobytes()
        assert data.indexes["time"].tolist() == result.time.tolist()


def test_sdf_of_the_makers_of_dymola_reads_the_trajectory(tmp_path: Path) -> None:
    result = odd_result(9, ("train.speed", "train.a[1,2]"))
    result = replace(result, signals=[result.signals[0], replace(result.signals[1], description="plain [x]")])
    path = written(result, tmp_path, "modelica")
    train = sdf.load(str(path))["train"]
    speed = train["speed"]
    assert speed.data.tobytes() == np.ascontiguousarray(result["train.speed"]).tobytes()
    assert (speed.unit, train["a[1,2]"].display_unit, train["a[1,2]"].comment) == ("m/s", "km/h", "plain [x]")
    assert speed.scales[0].data.tolist() == result.time.tolist()
    assert train["mass"].data == 80e3


def test_scipy_sees_the_matrices_of_a_trajectory(tmp_path: Path) -> None:
    result = odd_result(9, ("train.speed", "train.a[1,2]"))
    seen = loadmat(written(result, tmp_path, "modelica"), chars_as_strings=False)
    assert list(seen)[-7:-1] == ["Aclass", "name", "description", "dataInfo", "data_1", "data_2"]
    assert ["".join(row).rstrip() for row in seen["Aclass"]] == ["Atrajectory", "1.1", "", "binTrans"]
    assert ["".join(column).rstrip("\0") for column in seen["name"].T] == [
        "time",
        "train.speed",
        "train.a[1,2]",
        "train.mass",
    ]
    assert seen["dataInfo"].T.tolist() == [[0, 1, 0, -1], [2, 2, 0, -1], [2, 3, 0, -1], [1, 2, 0, 0]]
    assert seen["data_1"].tolist() == [[0.0, 0.4], [80e3, 80e3]]
    assert seen["data_2"].tobytes(order="F") == result.table.tobytes()
    magic = b"A1 bt. ir1 na  Tj  re  ac  nt  so   r   y   "  # what OpenModelica's read_matlab4.c compares with
    assert (tmp_path / "t.modelica.mat").read_bytes()[27:71] == magic


def test_parameters_that_are_no_numbers_are_left_out(tmp_path: Path) -> None:
    parameters = {"mass": 1.0, "gap": math.nan, "text": "a", "on": True, "speed": 2.0}
    result = replace(
        odd_result(3, ("train.speed",)), summary={"components": [{"name": "train", "parameters": parameters}]}
    )
    seen = loadmat(written(result, tmp_path, "modelica"), chars_as_strings=False)
    names = ["".join(column).rstrip("\0") for column in seen["name"].T]
    assert names == ["time", "train.speed", "train.mass", "train.on"]  # a speed, with a column, is no constant
    assert seen["data_1"][1:].tolist() == [[1.0, 1.0], [1.0, 1.0]]


# --- in a folder ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", FORMATS)
def test_any_table_of_a_folder_brings_its_units_and_telegrams(name: str, tmp_path: Path) -> None:
    result = odd_result()
    paths = write_results(result, tmp_path / "out", tuple(FORMATS))
    for kind in set(FORMATS) - {name}:
        paths[kind].write_bytes(b"not read")
    assert_equal(result, load_result(paths[name]))
    paths = write_results(result, tmp_path / "out", (name,))
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == sorted(p.name for p in paths.values())
    assert_equal(result, read_results(tmp_path / "out"))
    assert_equal(result, load_result(tmp_path / "out"))


def test_format_without_its_package_is_refused_before_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cosim.results.formats.known_formats.is_installed", lambda package: package != "pyarrow")
    check_writable(tmp_path, ("csv", "hdf5"))
    with pytest.raises(OutputError, match=r"needs the package pyarrow: pip install 'pyarrow>="):
        check_writable(tmp_path, ("csv", "parquet"))
    with pytest.raises(OutputError, match="pyarrow"):
        write_results(odd_result(), tmp_path / "new", ("parquet",))
    assert not (tmp_path / "new").exists()


def test_folder_is_read_from_a_table_whose_package_is_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_results(odd_result(), tmp_path, ("parquet", "csv"))
    (tmp_path / "table.parquet").write_bytes(b"")
    monkeypatch.setattr("cosim.results.results_folder.is_installed", lambda _: False)
    assert_equal(odd_result(), read_results(tmp_path))


# --- one file ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("ending", [ending for item in FORMATS.values() for ending in item.endings])
def test_saved_file_is_loaded_with_units_and_telegrams(ending: str, tmp_path: Path) -> None:
    names = ("train.speed", "a[1,2]", "x [m]", "y [m]", "der(x)")
    units = ("m/s", "1", "N", "1", "kg.m2/s2")
    result = replace(odd_result(9, names), signals=[SignalInfo(n, u) for n, u in zip(names, units, strict=True)])
    paths = result.save(tmp_path / f"run.1{ending}")
    back = load_result(paths[0])
    assert [p.name for p in tmp_path.iterdir() if p.name.startswith(".")] == []
    assert bits(back.table) == bits(result.table)
    assert repr(list(back.events)) == repr(list(result.events))
    assert back.summary["events_recorded"] is True
    if ending != ".npy":  # which has no room for them
        assert list(back.signals) == list(result.signals)


def test_telegrams_of_another_file_are_not_taken(tmp_path: Path) -> None:
    odd_result().save(tmp_path / "run.csv")
    replace(odd_result(), events=[]).save(tmp_path / "run.h5")
    assert load_result(tmp_path / "run.h5").events == []
    replace(odd_result(), events=[]).save(tmp_path / "run.csv")
    assert load_result(tmp_path / "run.csv").events == []


def test_failed_save_leaves_the_former_file(tmp_path: Path) -> None:
    (tmp_path / "run.csv").write_text("former")
    with pytest.raises(OutputError, match=r"run\.csv cannot be written.*result table"):
        Result(np.zeros(2, [("t", "f8")]), []).save(tmp_path / "run.csv")
    assert [(p.name, p.read_text()) for p in tmp_path.iterdir()] == [("run.csv", "former")]
    with pytest.raises(OutputError, match="Choose another place"):
        odd_result().save(tmp_path / "nowhere" / "run.csv")


def test_full_disk_leaves_the_former_file_and_nothing_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fill(_: object, path: Path, *__: object) -> None:
        path.write_text("half")
        raise OSError(28, "No space left on device")

    (tmp_path / "run.csv").write_text("former")
    monkeypatch.setattr("cosim.results.save._write", fill)
    with pytest.raises(OutputError, match=r"run\.csv cannot be written: No space left"):
        odd_result().save(tmp_path / "run.csv")
    assert [(p.name, p.read_text()) for p in tmp_path.iterdir()] == [("run.csv", "former")]


def test_endings_of_formats() -> None:
    assert {e: format_of(Path(f"a.b{e}")).name for e in (".csv", ".MAT", ".modelica.mat", ".pq", ".hdf5")} == {
        ".csv": "csv",
        ".MAT": "mat",
        ".modelica.mat": "modelica",
        ".pq": "parquet",
        ".hdf5": "hdf5",
    }
    with pytest.raises(OutputError, match=r"one of .*\.csv, \.mat"):
        format_of(Path("run.txt"))


@given(results())
def test_headings_give_back_name_and_unit(result: Result) -> None:
    for signal in result.signals:
        unit = signal.unit.translate(dict.fromkeys(map(ord, "[]"), "x")).strip() or "1"
        name, back = split_unit(with_unit(signal.name, unit))
        assert (name, split_unit(f"n [{unit}]")[1]) == (signal.name, back or "1")


@pytest.mark.parametrize(
    ("heading", "expected"),
    [
        ("speed [m/s]", ("speed", "m/s")),
        ("speed[m/s]", ("speed", "m/s")),
        ("speed (km/h)", ("speed", "km/h")),
        ("a[1]", ("a[1]", None)),
        ("a[1,2]", ("a[1,2]", None)),
        ("a[left]", ("a[left]", None)),
        ("der(x)", ("der(x)", None)),
        ("a[1] [m]", ("a[1]", "m")),
        ("slip [-]", ("slip", "1")),
        ("T [°C]", ("T", "degC")),
        ("a [m/s²]", ("a", "m/s2")),
        ("p [inHg]", ("p", "inHg")),
        ("speed (estimated)", ("speed (estimated)", None)),
        ("f[]", ("f[]", None)),
        ("f []", ("f", "1")),
    ],
)
def test_headings_of_other_tools(heading: str, expected: tuple[str, str | None]) -> None:
    assert split_unit(heading) == expected
