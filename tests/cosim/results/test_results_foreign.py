"""MATLAB, Modelica, Parquet, HDF5 and NumPy files that other tools made; the trajectories are built here by SciPy."""

from __future__ import annotations

import math
from datetime import timedelta
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pandas as pd
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st
from odd_results import odd_result
from scipy.io import savemat

from cosim import load_result
from cosim.errors import OutputError
from cosim.results.formats.foreign_mat import _split_description
from cosim.results.result import SignalInfo


def letters(texts: list[str], transposed: bool = False) -> np.ndarray:
    """A matrix of letters, filled up with spaces; as bytes of UTF-8 in Latin-1, which is how SciPy writes version 4."""
    encoded = [text.encode().decode("latin-1") for text in texts]
    rows = [text.ljust(max(map(len, encoded))) for text in encoded]
    return np.array(["".join(column) for column in zip(*rows, strict=True)] if transposed else rows)


def trajectory(path: Path, order: str, version: str = "4", **changed: Any) -> Path:
    """A file as Dymola writes it: float32, an alias with a minus, a parameter, units in the descriptions."""
    flip = order == "binTrans"
    numbers = {
        "dataInfo": np.array(
            [[0, 1, 0, -1], [2, 2, 0, -1], [2, -2, 0, -1], [2, 3, 0, -1], [1, 2, 0, 0], [1, -2, 0, 0]], "i4"
        ),
        "data_1": np.array([[0, 80.0], [1, 80.0]]),
        "data_2": np.array([[0, 1.0, 36], [0.5, 2.0, 72], [0.5, 3.0, 72], [1, 4.0, 108]], "f4"),
    } | changed
    descriptions = ["Time in [s]", "Länge [m]", "", "fast [km/h|m/s]", "Mass [kg]", "locked [:#(type=Boolean)]"]
    content = {
        "Aclass": letters(["Atrajectory", "1.1", "", order]),
        "name": letters(["time", "x", "minus_x", "train.speed", "mass", "minus_mass"], flip),
        "description": letters(descriptions, flip),
    }
    content |= {name: value.T if flip else value for name, value in numbers.items() if value is not None}
    savemat(path, content, format=version)
    return path


@pytest.mark.parametrize("order", ["binTrans", "binNormal"])
@pytest.mark.parametrize("version", ["4", "5"])
def test_trajectories_of_modelica_tools(order: str, version: str, tmp_path: Path) -> None:
    result = load_result(trajectory(tmp_path / "dsres.mat", order, version))
    assert result.table.dtype.names == ("time", "x", "minus_x", "train.speed")
    assert result.table.tolist() == [(0, 1, -1, 10), (0.5, 2, -2, 20), (0.5, 3, -3, 20), (1, 4, -4, 30)]
    assert list(result.signals) == [
        SignalInfo("x", "m", description="Länge"),
        SignalInfo("minus_x"),
        SignalInfo("train.speed", "m/s", "m/s", description="fast"),
    ]
    assert result.summary["parameters"] == {"mass": 80.0, "minus_mass": -80.0}
    assert result.summary["events_recorded"] is False


def test_texts_over_time_are_left_out(tmp_path: Path) -> None:
    info = np.array([[0, 1, 0, -1], [2, 2, 0, -1], [3, 1, 0, -1], [2, 3, 0, -1], [1, 2, 0, 0], [1, -2, 0, 0]], "i4")
    path = trajectory(tmp_path / "t.mat", "binTrans", dataInfo=info, stringData=np.zeros((4, 4)))
    assert load_result(path).table.dtype.names == ("time", "x", "train.speed")


def test_plots_exported_by_dymola(tmp_path: Path) -> None:
    content = {"names": letters(["Time", "a.b"]), "data": np.array([[0, 1.0], [2, 3.0]])}
    savemat(
        tmp_path / "p.mat", {"Aclass": letters(["Atrajectory", "1.0", "Stored", "binNormal"]), **content}, format="4"
    )
    result = load_result(tmp_path / "p.mat")
    assert (result.table.dtype.names, result.table.tolist()) == (("time", "a.b"), [(0, 1), (2, 3)])


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"data_2": None}, "lacks data_2"),
        ({"dataInfo": np.array([[0, 1, 0, -1]] * 5)}, "contradicts itself"),
        ({"dataInfo": np.array([[0, 1, 0, -1]] * 5 + [[2, 9, 0, 0]])}, "'minus_mass' should be in row 9 of data_2"),
        ({"dataInfo": np.array([[0, 1, 0, -1]] * 5 + [[3, 1, 0, 0]])}, "'minus_mass' should be in row 1 of data_3"),
        ({"data_1": np.empty((0, 0))}, "'mass' should be in row 2 of data_1"),
    ],
)
def test_trajectory_that_contradicts_itself_is_refused(changed: dict[str, Any], message: str, tmp_path: Path) -> None:
    with pytest.raises(OutputError, match=message):
        load_result(trajectory(tmp_path / "t.mat", "binTrans", **changed))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", ("", None, None)),
        ("Mass", ("Mass", None, None)),
        ("Mass [kg]", ("Mass", "kg", None)),
        ("[kg]", ("", "kg", None)),
        ("Angle [rad|deg]", ("Angle", "rad", "deg")),
        ("On [:#(type=Boolean)]", ("On", None, None)),
        ("a[1] of [m|mm:#(fixed)]", ("a[1] of", "m", "mm")),
        ("row [1] of it", ("row [1] of it", None, None)),
    ],
)
def test_units_in_descriptions(text: str, expected: tuple[str, str | None, str | None]) -> None:
    assert _split_description(text) == expected


def test_workspace_of_matlab(tmp_path: Path) -> None:
    content = {
        "tout": np.arange(3.0),
        "v": [[1.0], [2.0], [3.0]],
        "on": np.array([True, False, True]),
        "K": np.eye(2),
        "s": "text",
    }
    savemat(tmp_path / "w.mat", content | {"K": np.eye(2), "s": "text"})
    result = load_result(tmp_path / "w.mat")
    assert (result.table.dtype.names, result.table.tolist()) == (("time", "v", "on"), [(0, 1, 1), (1, 2, 0), (2, 3, 1)])
    savemat(tmp_path / "w.mat", {"K": np.eye(2)})
    with pytest.raises(OutputError, match=r"no vector 'time'; it holds: K \(2, 2\)"):
        load_result(tmp_path / "w.mat")


def test_frame_written_by_pandas(tmp_path: Path) -> None:
    frame = pd.DataFrame(
        {"v": [36.0, None], "n": [1, 2], "on": [True, False], "lap": [timedelta(minutes=1)] * 2},
        index=pd.Index([0.0, 0.5], name="time"),
    )
    frame.attrs["units"] = {"v": "km/h"}
    frame.to_parquet(tmp_path / "f.parquet")
    result = load_result(tmp_path / "f.parquet")
    np.testing.assert_array_equal(np.array(result.table.tolist()), [[0, 10, 1, 1, 60], [0.5, math.nan, 2, 0, 60]])
    assert result.signals[0] == SignalInfo("v", "m/s", "km/h")
    frame.assign(mode="coasting").to_parquet(tmp_path / "f.parquet")
    with pytest.raises(OutputError, match="column 'mode' must hold numbers"):
        load_result(tmp_path / "f.parquet")


def test_data_set_written_by_xarray(tmp_path: Path) -> None:
    speed = ("time", np.array([36.0, 72.0], "f4"), {"units": "km/h"})
    data = xr.Dataset({"v": speed, "map": (("x", "y"), np.eye(3))}, coords={"time": [0.0, 0.5]})
    data.to_netcdf(tmp_path / "d.nc", engine="h5netcdf")
    result = load_result(tmp_path / "d.nc")
    assert (result.table.dtype.names, result.table["v"].tolist()) == (("time", "v"), [10.0, 20.0])
    assert result.signals[0] == SignalInfo("v", "m/s", "km/h")


def test_groups_of_hdf5_become_names(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "g.h5", "w") as file:
        file["run/time"], file["run/train/speed"] = [0.0, 1.0], [[3.0], [4.0]]
        file["run/train/speed"].attrs["UNIT"] = np.array([b"m/s"])
        file["run/other"], file["run/label"] = [1.0, 2.0, 3.0], ["a", "b"]
    result = load_result(tmp_path / "g.h5")
    assert (result.table.dtype.names, result.table.tolist()) == (("time", "run.train.speed"), [(0, 3), (1, 4)])
    assert result.signals[0].unit == "m/s"
    with h5py.File(tmp_path / "g.h5", "w") as file:
        file["x"] = [0.0]
    with pytest.raises(OutputError, match="no vector 'time'; it holds: x"):
        load_result(tmp_path / "g.h5")


def test_arrays_of_numpy(tmp_path: Path) -> None:
    rows = [(0.0, True, 3, (1.0, 2.0)), (0.5, False, 4, (3.0, 4.0))]
    np.save(tmp_path / "a.npy", np.array(rows, [("time", "f8"), ("on", "?"), ("n", "i4"), ("force", "f8", (2,))]))
    result = load_result(tmp_path / "a.npy")
    assert result.table.dtype.names == ("time", "on", "n", "force[1]", "force[2]")
    assert result.table.tolist() == [(0, 1, 3, 1, 2), (0.5, 0, 4, 3, 4)]
    for array, message in (
        (np.eye(2), r"expected a structured array.*got shape \(2, 2\)"),
        (np.array([(0.0, "a")], [("time", "f8"), ("s", "U1")]), "field 's' must hold numbers"),
    ):
        np.save(tmp_path / "a.npy", array)
        with pytest.raises(OutputError, match=message):
            load_result(tmp_path / "a.npy")


@pytest.mark.parametrize("name", ["t.mat", "t.modelica.mat", "t.h5", "t.parquet", "t.npy"])
@settings(derandomize=True, max_examples=60, deadline=None)  # the same bytes each time: what reads them is not ours
@given(changes=st.lists(st.tuples(st.floats(0, 1, exclude_max=True), st.integers(0, 255)), min_size=1, max_size=4))
def test_broken_file_is_a_result_or_refused_in_words(
    name: str, changes: list[tuple[float, int]], tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.getbasetemp() / name
    if not path.exists():
        odd_result(4, ("a", "b")).save(path)
    content = bytearray(path.read_bytes())
    for share, value in changes:
        content[int(share * len(content))] = value
    broken = path.with_name(f"broken_{name}")
    broken.write_bytes(content)
    try:
        reported = load_result(broken).summary["file"]
    except OutputError as error:
        reported = str(error)
    assert str(broken) in reported
