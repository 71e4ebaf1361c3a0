"""Columns of a table at Boolean, integer and enumeration inputs: whole ones drive them, others are refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_fmus.typed import expected, typed_fmu

from cosim import Scenario
from cosim.errors import CouplingError

RANGES = {
    "boolean": (0, 1),
    "enumeration": (1, 3),
    "int8": (-128, 127),
    "uint8": (0, 255),
    "int16": (-(2**15), 2**15 - 1),
    "uint16": (0, 2**16 - 1),
    "int32": (-(2**31), 2**31 - 1),
    "uint32": (0, 2**32 - 1),
    "int64": (-(2**53), 2**53),
    "uint64": (0, 2**53),
}
OLD = ("boolean", "enumeration", "int32")
"""Types that FMI 1 and 2 have as well."""


@pytest.fixture(scope="module")
def typed(tmp_path_factory: pytest.TempPathFactory) -> dict[int, Path]:
    return {version: typed_fmu(tmp_path_factory.mktemp("typed"), version=version) for version in (1, 2, 3)}  # type: ignore[arg-type]


def driven(
    folder: Path, fmu: Path, columns: dict[str, Any], start: int = 0, master: Any = None, **change: Any
) -> Scenario:
    """An FMU whose inputs are driven by a table with a row a second, changed on their way."""
    names = list(columns)
    rows = [",".join(map(str, (t, *row))) for t, row in enumerate(zip(*columns.values(), strict=True))]
    (folder / "inputs.csv").write_text("\n".join([",".join(["time", *names]), *rows]) + "\n")
    scenario = Scenario(folder=folder, start=start, stop=len(rows) - 1, step=0.5, master=master or {})
    scenario.add("inputs", recording="inputs.csv").add("x", fmu=str(fmu))
    return scenario.connect(*(f"inputs.{name} -> x.u_{name}" for name in names), **change)


@pytest.mark.parametrize("version", [1, 2, 3])
@pytest.mark.parametrize("stepper", ["auto", "python"])
def test_whole_columns_drive_inputs_of_every_whole_type(
    tmp_path: Path, typed: dict[int, Path], version: int, stepper: str
) -> None:
    """Each row until the next one, whatever its type holds."""
    draw = np.random.default_rng(version)
    names = [name for name in RANGES if version == 3 or name in OLD]
    columns = {name: draw.integers(*RANGES[name], size=6, endpoint=True) for name in names}
    outcome = driven(tmp_path, typed[version], columns, master={"stepper": stepper}).run()
    between = slice(1, None, 2)
    for name in names:
        values = [int(value) for value in columns[name][:-1]]
        assert outcome[f"inputs.{name}"][between].tolist() == values
        assert outcome[f"x.y_{name}"][between].tolist() == [expected(f"u_{name}", value) for value in values], name


def test_words_for_truth_values_are_taken(tmp_path: Path, typed: dict[int, Path]) -> None:
    outcome = driven(tmp_path, typed[2], {"boolean": ["true", "false", "true"]}).run()
    assert outcome["inputs.boolean"].tolist() == [1.0, 1.0, 0.0, 0.0, 1.0]


@pytest.mark.parametrize(
    ("name", "values", "words"),
    [
        ("boolean", [0, 1, 0.5], r"a Boolean; row 3 \(t = 2 s\): expected true or false for a Boolean \(got 0\.5\)"),
        ("boolean", [0, 1, 2], r"row 3 .* \(got 2\.0\)"),
        ("int32", [0, 1e-9, 3.5], r"row 2 \(t = 1 s\): expected a whole number for a Int.* \(got 1e-09\)"),
        ("int32", [0, 3e9, 1], r"row 2 .*expected -2147483648 to 2147483647"),
        ("enumeration", [1, 7, 1], r"row 2 .*7 is no item of the enumeration"),
    ],
)
def test_a_value_that_is_none_of_the_input_is_named(
    tmp_path: Path, typed: dict[int, Path], name: str, values: list[float], words: str
) -> None:
    """Column, row, time and value, and what was expected."""
    with pytest.raises(CouplingError, match=rf"inputs\.{name} -> x\.u_{name}: inputs\.{name} is a .*{words}"):
        driven(tmp_path, typed[2], {name: values}).run()


def test_the_row_is_that_of_the_table_and_counts_only_in_the_run(tmp_path: Path, typed: dict[int, Path]) -> None:
    """The half in the first row is never played; that in the fourth one is."""
    with pytest.raises(CouplingError, match=r"row 4 \(t = 3 s\)"):
        driven(tmp_path, typed[2], {"boolean": [0.5, 0, 1, 0.5, 1]}, start=1).run()


def test_the_value_at_the_end_of_the_connection_counts(tmp_path: Path, typed: dict[int, Path]) -> None:
    """Halves become whole by a factor, and any value by a table of values."""
    doubled = driven(tmp_path, typed[2], {"int32": [0.5, 1.5, 2.5]}, factor=2.0).run()
    assert doubled["x.y_int32"][1::2].tolist() == [expected("u_int32", value) for value in (1, 3)]
    mapped = driven(tmp_path, typed[2], {"boolean": [0.25, 7.0, 0.25]}, values=[[0.25, 0], [7, 1]]).run()
    assert mapped["x.y_boolean"][1::2].tolist() == [1.0, 0.0]
    with pytest.raises(CouplingError, match=r"row 1 .*got 0\.25"):
        driven(tmp_path, typed[2], {"int32": [0.5, 1.5, 2.5]}, factor=0.5).run()
