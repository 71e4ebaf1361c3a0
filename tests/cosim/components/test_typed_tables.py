"""Tables drive inputs of every type: whole numbers, truth values, items of enumerations by name or by number."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io
from hypothesis import given
from hypothesis import strategies as st
from test_fmus.typed import MOODS, expected, typed_fmu

from cosim import Scenario
from cosim.errors import CosimError, CouplingError, OutputError
from cosim.results.formats.foreign_csv import read_foreign_csv
from cosim.results.load_result import load_result

COLUMNS = ("u_float64", "u_int32", "u_boolean", "u_enumeration")
ROWS = [(0.5, 1, "false", "calm"), (0.7, 2, "true", "busy"), (0.9, 3, "true", "angry")]
NUMBERS = [(x, n, int(flag == "true"), MOODS.index(mood) + 1) for x, n, flag, mood in ROWS]
CELLS = {
    "a number": st.floats(-1e6, 1e6).map(repr) | st.integers(-9, 9).map(str),
    "true or false": st.sampled_from(["true", "false", "TRUE", "False"]),
}


def table(path: Path, rows: list[Any]) -> Path:
    """A table of these rows, half a second apart, in the format that the name means."""
    if path.suffix == ".csv":
        lines = [",".join(map(str, (0.5 * k, *row))) for k, row in enumerate(rows)]
        path.write_text("\n".join([",".join(("time", *COLUMNS)), *lines]) + "\n")
        return path
    if path.suffix == ".mat":
        columns = dict(zip(COLUMNS, map(list, zip(*rows, strict=True)), strict=True))
        columns["u_boolean"] = [flag in ("true", 1) for flag in columns["u_boolean"]]
        modes = columns["u_enumeration"]
        if isinstance(modes[0], str) and "cells" in path.name:  # else a matrix of letters
            columns["u_enumeration"] = np.array(modes, object).reshape(-1, 1)
        scipy.io.savemat(path, {"t": 0.5 * np.arange(len(rows)), "note": "of a workspace", **columns}, oned_as="column")
        return path
    pandas = pytest.importorskip("pandas")
    pytest.importorskip("pyarrow")
    frame = pandas.DataFrame(rows, columns=COLUMNS)
    frame["u_boolean"] = frame["u_boolean"].isin(["true", 1])
    frame.insert(0, "time", 0.5 * np.arange(len(rows)))
    frame.to_parquet(path)
    return path


def driven(fmu: Path, path: Path) -> Scenario:
    scenario = Scenario(stop=1.0, step=0.1).add("fmu", fmu=fmu).add("inputs", recording=path)
    return scenario.connect(*(f"inputs.{name} -> fmu.{name}" for name in COLUMNS))


@pytest.mark.compiler
@pytest.mark.parametrize("name", ["in.csv", "in.parquet", "in.mat", "in_cells.mat"])
@pytest.mark.parametrize("rows", [ROWS, NUMBERS], ids=["names", "numbers"])
@pytest.mark.parametrize("version", [1, 2, 3])
def test_columns_drive_inputs_of_their_types(version: Any, rows: list[Any], name: str, tmp_path: Path) -> None:
    outcome = driven(typed_fmu(tmp_path, version=version), table(tmp_path / name, rows)).run()
    assert outcome.failure is None
    times = outcome.result.time
    for time, row in ((0.2, NUMBERS[0]), (0.8, NUMBERS[1])):
        at = int(np.flatnonzero(np.isclose(times, time))[0])
        for column, value in zip(COLUMNS[1:], row[1:], strict=True):
            assert outcome[column.replace("u_", "fmu.y_")][at] == expected(column, value)


@pytest.fixture(scope="module")
def typed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return typed_fmu(tmp_path_factory.mktemp("typed"), version=2)


@pytest.mark.compiler
@pytest.mark.parametrize(
    ("row", "words"),
    [
        ((0.7, 2.5, "true", "busy"), ["inputs.u_int32", "row 2 (t = 0.5 s)", "whole number", "2.5"]),
        ((0.7, 2, "true", "buzy"), ["inputs.u_enumeration", "row 2 (t = 0.5 s)", "'buzy'", "'busy'"]),
        ((0.7, "x", "true", "busy"), ["line 3, column 'u_int32'", "expected a number", "'x'"]),
        ((0.7, 2, "1", "busy"), ["line 3, column 'u_boolean'", "expected true or false", "'1'"]),
    ],
)
def test_a_wrong_cell_is_refused_with_row_and_column(
    typed: Path, tmp_path: Path, row: tuple[Any, ...], words: list[str]
) -> None:
    path = table(tmp_path / "in.csv", [ROWS[0], row, ROWS[2]])
    with pytest.raises(CosimError) as error:
        driven(typed, path).run()
    for word in words:
        assert word in str(error.value)


@pytest.mark.compiler
def test_texts_drive_no_numbers(typed: Path, tmp_path: Path) -> None:
    scenario = Scenario(stop=1.0, step=0.1).add("fmu", fmu=typed)
    scenario.add("inputs", recording=table(tmp_path / "in.csv", ROWS)).connect("inputs.u_enumeration -> fmu.u_float64")
    with pytest.raises(CouplingError, match=r"holds texts.*fmu\.u_float64 is a Real"):
        scenario.run()


def test_texts_of_a_workspace_are_left_out_of_a_result(tmp_path: Path) -> None:
    """A workspace holds what it holds; nobody asked for these."""
    for name in ("in.mat", "in_cells.mat"):
        result = load_result(table(tmp_path / name, ROWS))
        assert set(result) == {"time", *COLUMNS} - {"u_enumeration"}


def test_a_table_of_texts_is_no_result(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="line 2, column 'u_enumeration': expected a number, got 'calm'"):
        read_foreign_csv(table(tmp_path / "in.csv", ROWS))


@given(data=st.data(), count=st.integers(2, 6))
def test_a_column_that_changes_its_kind_is_refused_where_it_does(data: st.DataObject, count: int) -> None:
    kind = data.draw(st.sampled_from(sorted(CELLS)))
    cells = data.draw(st.lists(CELLS[kind], min_size=count, max_size=count))
    odd = data.draw(st.integers(1, count - 1))
    other = data.draw(st.sampled_from([cell for name, cell in CELLS.items() if name != kind] + [st.just("calm")]))
    cells[odd] = data.draw(other)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "in.csv"
        path.write_text("time,x\n" + "".join(f"{k},{cell}\n" for k, cell in enumerate(cells)))
        with pytest.raises(OutputError) as error:
            read_foreign_csv(path, texts=True)
    assert f"line {odd + 2}, column 'x': expected {kind} as in the rows above, got '{cells[odd]}'" in str(error.value)
