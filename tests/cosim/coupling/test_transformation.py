"""Transformations of connections: lines and tables of a scenario, and what they do to the numbers."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from ssp_files import ramp_fmu, sum_fmu
from test_fmus.build import linear_fmu

from cosim import Scenario
from cosim.coupling.inputs import Inputs
from cosim.coupling.transformation import Transformation, as_affine
from cosim.errors import ScenarioError
from cosim.run.connections import parse_connections
from cosim.scenario.scenario_tables import ConnectionTable

NUMBERS = st.integers(-20, 20).map(float)


def test_lines_and_tables_become_links() -> None:
    table = ConnectionTable.model_validate({"from": "a.x", "to": "b.u", "factor": 2.0, "units": "ignore"})
    links = parse_connections(["a.x -> b.u, c.m[1,2] , c.v", table], "here")
    assert links[:3] == [("a.x", "b.u"), ("a.x", "c.m[1,2]"), ("a.x", "c.v")]
    assert links[3:] == [("a.x", "b.u", Transformation(2.0, 0.0, False))]


def scenario(folder: Path, **table: object) -> Scenario:
    made = Scenario(stop=1.0, step=0.25).add("ramp", fmu=str(ramp_fmu(folder))).add("sum", fmu=str(sum_fmu(folder)))
    made._data["connections"] = [{"from": "ramp.speed", "to": "sum.u", **table}]
    return made


@pytest.mark.compiler
def test_a_linear_transformation_in_a_run(tmp_path: Path) -> None:
    outcome = scenario(tmp_path, factor=0.5, offset=-3.0).run(warn=lambda _text: None)
    # powers of two and small integers: exact
    assert np.array_equal(outcome["sum.y"], 2.0 * (0.5 * outcome["ramp.speed"] - 3.0))
    assert outcome.result.summary["connections"] == ["0.5 * ramp.speed + -3 -> sum.u"]


@pytest.mark.compiler
@pytest.mark.parametrize(("units", "factor"), [("convert", 3.6), ("ignore", 1.0)])
def test_units_are_converted_or_ignored_also_after_the_round_trip(tmp_path: Path, units: str, factor: float) -> None:
    meter = linear_fmu(tmp_path, "meter", [], [], [], [[1]], version=2, units={"u1": "km/h", "y1": "km/h"})
    made = Scenario(stop=1.0, step=0.25).add("ramp", fmu=str(ramp_fmu(tmp_path))).add("meter", fmu=str(meter))
    made._data["connections"] = [{"from": "ramp.speed", "to": "meter.u1", "factor": 2.0, "units": units}]
    again = Scenario.load(made.export_ssp(tmp_path / "meter.ssp"))
    for outcome in (made.run(warn=lambda _text: None), again.run(warn=lambda _text: None)):
        shown = outcome["meter.y1"] * 3.6  # results are in SI
        assert np.abs(shown - 2.0 * factor * outcome["ramp.speed"]).max() < 1e-12  # some roundings of numbers up to 100


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"factor": 2.0, "values": [[1.0, 2.0]]}, "connections.0: give either 'factor' and 'offset', or 'values'"),
        ({"values": [[1.0, 2.0], [1.0, 3.0]]}, "connections.0: 'values' gives two targets for one source"),
        ({"unit": "ignore"}, "connections.0.unit: unknown key; did you mean 'units'"),
        ({"factor": "two"}, "connections.0.factor: "),
    ],
)
def test_a_table_that_cannot_be(tmp_path: Path, table: dict[str, object], message: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        scenario(tmp_path, **table).table()
    assert message in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


def test_a_table_of_values_passes_what_it_does_not_name() -> None:
    values, buffer, sent = np.array([1.0, 2.0, 3.0] * 2), np.zeros(2), []
    sources = [("c", "x"), ("c", "y")]
    inputs = Inputs(
        ["a", "b"],
        np.array([0, 2]),
        sources,
        np.array([1.0, 2.0]),
        np.zeros(2),
        values,
        buffer,
        lambda: sent.append(buffer.copy()),
        {0: {1.0: 7.0, 7.0: 9.0}},
    )
    for value, expected in ((1.0, 7.0), (7.0, 9.0), (5.0, 5.0)):
        values[0] = value
        inputs.gather()
        inputs.send()
        assert sent[-1].tolist() == [expected, 6.0]


@given(st.dictionaries(NUMBERS, NUMBERS, max_size=4), st.frozensets(NUMBERS, min_size=1, max_size=4))
def test_a_table_is_linear_only_where_a_line_is_exactly_equal(
    table: dict[float, float], domain: frozenset[float]
) -> None:
    found = as_affine(table, domain)
    mapped = {x: table.get(x, x) for x in domain}
    if found is not None:
        assert all(found[0] * x + found[1] == y for x, y in mapped.items())
        return
    first, last = min(mapped), max(mapped)
    slope = (Fraction(mapped[last]) - Fraction(mapped[first])) / (Fraction(last) - Fraction(first))
    bent = any(Fraction(mapped[first]) + slope * (Fraction(x) - Fraction(first)) != y for x, y in mapped.items())
    assert bent or Fraction(float(slope)) != slope  # a slope such as 1/3 rounds: the table stays a table
