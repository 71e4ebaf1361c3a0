"""Results as pandas and xarray see them."""

from __future__ import annotations

import math
import re
import sys
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from odd_results import NAMES, bits, odd_result, results

from cosim.errors import OutputError
from cosim.results.frames import from_pandas
from cosim.results.result import Result
from cosim.results.selection import selected


@settings(max_examples=40, deadline=None)
@given(results())
def test_frames_hold_every_bit(result: Result) -> None:
    frame, data = result.to_pandas(), result.to_xarray()
    assert frame.index.to_numpy().tobytes() == data["time"].to_numpy().tobytes() == np.array(result.time).tobytes()
    assert list(frame.columns) == [s.name for s in result.signals]
    for place, signal in enumerate(result.signals):
        column = np.array(result[signal.name]).tobytes()
        assert frame.iloc[:, place].to_numpy().tobytes() == column
        assert data[signal.name].to_numpy().tobytes() == column
        assert frame.attrs["units"][signal.name] == data[signal.name].attrs["units"] == signal.unit
        assert (
            frame.attrs["descriptions"][signal.name]
            == data[signal.name].attrs.get("long_name", "")
            == signal.description
        )
        assert data[signal.name].attrs.get("display_unit") == signal.display_unit


def test_rows_before_and_after_an_event_stay() -> None:
    frame = odd_result(9, ("a",)).to_pandas()
    assert frame.index.tolist() == [0.0, 0.0, 0.1, 0.1, 0.2, 0.2, 0.1 * 3, 0.1 * 3, 0.4]
    assert frame.attrs["failure"] == "stopped at 0.3 s"


def test_chosen_signals_only() -> None:
    result = odd_result()
    assert list(result.to_pandas(["units", "a"]).columns) == ["units", "a"]
    assert [n for n in result.to_xarray(["units"]).data_vars if not str(n).startswith("balise_")] == ["units"]
    with pytest.raises(KeyError, match=r"'unit' was not recorded; did you mean 'units'"):
        result.to_pandas(["unit"])


@pytest.mark.parametrize("key", [0, -1, None, 1.5, ("a",)])
def test_a_key_that_is_no_name_is_refused_in_words(key: Any) -> None:
    """A result is a mapping: rows are chosen behind the name of a signal."""
    result = odd_result()
    with pytest.raises(KeyError, match=rf"{re.escape(repr(key))} is no name of a signal; .*\[0\]"):
        result[key]
    assert [name in result for name in ("a", key, "x")] == [True, False, False]


def test_telegrams_as_rows() -> None:
    frame = odd_result().events_to_pandas()
    assert frame["stamp"].tolist() == [0.1, 0.2]
    assert frame["identity"].tolist() == ['B;1, "é"', ""]
    assert math.isnan(frame["delivered_at"][0])
    assert frame["outcome.a;b"].tolist() == ["c=d", ""]
    assert set(frame.attrs["units"]) < set(frame.columns)
    data = odd_result().to_xarray()
    assert data["balise_stamp"].dims == ("event",)
    assert data["balise_stamp"].to_numpy().tolist() == [0.1, 0.2]
    assert data["balise_position"].attrs["units"] == "m"
    assert len(odd_result(events=[]).events_to_pandas()) == odd_result(events=[]).to_xarray().sizes["event"] == 0


@pytest.mark.parametrize("as_index", [True, False])
def test_frames_come_back(as_index: bool) -> None:
    result = odd_result(9, tuple(name for name in NAMES if name != "time_"))
    frame = result.to_pandas()
    back = from_pandas(frame if as_index else frame.reset_index())
    assert bits(back.table) == bits(result.table) or any(s.unit == "°" for s in result.signals)
    assert [s.name for s in back.signals] == [s.name for s in result.signals]


def test_frame_of_somebody_else() -> None:
    frame = pd.DataFrame({"t": [0, 1], "v": pd.array([36, None], "Int64"), "on": [True, False]})
    frame.attrs = {"units": {"v": "km/h"}, "descriptions": {"v": "speed"}}
    result = from_pandas(frame)
    assert (result["v"][0], math.isnan(result["v"][1]), result["on"].tolist()) == (10.0, True, [1.0, 0.0])
    assert (result.signals[0].unit, result.signals[0].display_unit, result.signals[0].description) == (
        "m/s",
        "km/h",
        "speed",
    )
    with pytest.raises(OutputError, match="column 'mode' must hold numbers"):
        from_pandas(frame.assign(mode="coasting"))
    with pytest.raises(OutputError, match="no column 'time'"):
        from_pandas(pd.DataFrame({"v": [1.0]}, index=pd.Index([0], name="row")))


def test_package_that_is_missing_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(OutputError, match=r"package pandas .*pip install 'pandas>="):
        odd_result().to_pandas()


def test_selection_by_pattern() -> None:
    result = odd_result(4, ("train.speed", "train.position", "observer.speed", "a[1]"))
    chosen = selected(result, ["*.speed", "a[1]"])
    assert chosen.table.dtype.names == ("time", "train.speed", "observer.speed", "a[1]")
    assert [s.name for s in chosen.signals] == ["train.speed", "observer.speed", "a[1]"]
    assert chosen["a[1]"].tobytes() == np.array(result["a[1]"]).tobytes()
    with pytest.raises(OutputError, match=r"No signal 'train.sped' in the result; did you mean 'train\.speed'"):
        selected(result, ["train.sped"])
