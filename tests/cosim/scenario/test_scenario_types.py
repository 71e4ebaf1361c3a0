"""Scenario files with values that are no numbers: texts, bytes, items, arrays, and what cannot be recorded."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mock_slaves import Mock, component, variable
from test_fmus.typed import expected, typed_fmu

import cosim
from cosim.components.start_values import start_values
from cosim.errors import CosimError, CouplingError, ScenarioError
from cosim.results.results_folder import read_results

FILE = """
stop = 0.2
step = 0.1
connections = ["one.y_matrix -> two.u_matrix", "one.y_string -> two.u_string", "one.y_int64 -> two.u_int64"]

[components.one]
fmu = "typed.fmu"
record = ["u_vector", "u_enumeration"]

[components.one.parameters]
u_matrix = [[1, 2], [3, 4]]
u_vector = 5
u_string = "Grüße"
u_binary = "00ff"
u_int64 = 9007199254740993
u_boolean = true
u_enumeration = "busy"
n = 2

[components.two]
fmu = "typed.fmu"

[components.two.parameters]
n = 2
"""


@pytest.mark.compiler
def test_a_file_with_everything_in_it(tmp_path: Path) -> None:
    """9007199254740993 is the first integer that no double holds; the shape is used although it stands last."""
    typed_fmu(tmp_path)
    (tmp_path / "types.toml").write_text(FILE, encoding="utf-8")
    outcome = cosim.Scenario.load(str(tmp_path / "types.toml")).run()
    assert outcome.failure is None
    rows = expected("u_matrix", expected("u_matrix", [[1, 2], [3, 4]]))
    for i in (1, 2):
        for j in (1, 2):
            np.testing.assert_array_equal(outcome[f"two.y_matrix[{i},{j}]"], rows[i - 1][j - 1])
    np.testing.assert_array_equal(outcome["one.u_vector[2]"], 5.0)
    np.testing.assert_array_equal(outcome["one.u_enumeration"], 2.0)
    np.testing.assert_array_equal(outcome["one.y_enumeration"], 3.0)
    assert outcome["one.y_boolean"][0] == 0.0
    assert "one.y_matrix[1,3]" not in outcome.result.table.dtype.names
    stated = outcome.result.summary["components"][0]["parameters"]
    assert stated["u_int64"] == 9007199254740993
    assert (stated["u_string"], stated["u_binary"], stated["u_boolean"]) == ("Grüße", "00ff", True)
    outcome.write(tmp_path / "out", report=False)
    kept = read_results(tmp_path / "out")
    assert kept.summary["components"][0]["parameters"] == stated
    np.testing.assert_array_equal(kept.table, outcome.result.table)


@pytest.mark.compiler
@pytest.mark.parametrize(
    ("record", "parameters", "match"),
    [
        (["y_string"], {}, r"one.y_string cannot be recorded: it is a String, and results are a table of numbers"),
        (["y_pair_binary"], {}, r"one.y_pair_binary cannot be recorded: it is a Binary"),
        (["y_vector[4]"], {}, r"one: no element 'y_vector\[4\]' in a Float64 array of shape \(3,\)"),
        (
            [],
            {"u_vector": [1.0, 2.0]},
            r"one.u_vector: expected 3 values for a Float64 array of shape \(3,\) \(got 2 in shape \(2,\)\)",
        ),
        ([], {"u_int8": 1.5}, r"one.u_int8: expected a whole number for a Int8 \(got 1.5\)"),
        ([], {"u_int8": 300}, r"one.u_int8: expected -128 to 127 for a Int8 \(got 300\)"),
        ([], {"u_string": 3}, r"one.u_string: expected a text for a String \(got 3\)"),
        ([], {"u_binary": "xyz"}, r"one.u_binary: expected bytes or a hexadecimal text"),
        ([], {"u_float64": "3"}, r"one.u_float64: expected a number, or a list of numbers for a vector \(got '3'\)"),
        ([], {"n": 2.5}, r"one.n: expected a whole number for a UInt64"),
        (
            [],
            {"u_enumeration": 4},
            r"one.u_enumeration: 4 is no item of the enumeration: calm \(1\), busy \(2\), angry \(3\)",
        ),
    ],
)
def test_what_does_not_fit_is_said_before_the_run(
    tmp_path: Path, record: list[str], parameters: Any, match: str
) -> None:
    path = typed_fmu(tmp_path)
    with pytest.raises(CosimError, match=match):
        cosim.Scenario(stop=0.1, step=0.1).add("one", fmu=str(path), record=record, parameters=parameters).run()


@pytest.mark.parametrize("value", [float("nan"), {"a": 1}, [1.0, [float("inf")]]])
def test_a_file_takes_finite_values_only(value: Any) -> None:
    with pytest.raises(
        ScenarioError, match=r"components.one.parameters.x: expected a finite number, true or false, a text"
    ):
        cosim.Scenario(stop=1.0, step=0.1).add("one", fmu="x.fmu", parameters={"x": value}).run()


class Vectors(Mock):
    def more_variables(self) -> list[Any]:
        scalars = [variable(f"mass[{i}]", "parameter", 10 + i, "Float64") for i in (1, 2)]
        return [*scalars, variable("count", "structuralParameter", 20, "UInt64", min="1", max="4")]


def test_vectors_of_scalars_and_structural_parameters_first() -> None:
    made = component(Vectors())
    assert start_values(made, {"mass": [1, 2.5]}) == {"mass[1]": 1.0, "mass[2]": 2.5}
    assert list(start_values(made, {"mass": 3, "count": 2}).items()) == [
        ("count", 2),
        ("mass[1]", 3.0),
        ("mass[2]", 3.0),
    ]
    with pytest.raises(CouplingError, match=r"mock.count: 5 lies outside what the component declares: 1 to 4"):
        start_values(made, {"count": 5})
    with pytest.raises(CouplingError, match=r"mock.count: 0 lies outside what the component declares: 1 to 4"):
        start_values(made, {"count": 0})
    with pytest.raises(CouplingError, match=r"mock: no variable 'mas'; did you mean 'mass\[1\]', 'mass\[2\]'\?"):
        start_values(made, {"mas": 1.0})
