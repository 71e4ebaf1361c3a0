"""A text table shows numbers in the units that the FMUs declare, and gives back SI to the last bit."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from test_fmus.build import linear_fmu

import cosim
from cosim.results.declared_units import own_numbers
from cosim.results.result import Result, SignalInfo
from cosim.results.results_folder import read_results, write_results
from cosim.results.table_layout import table_of
from plant_models.hybrid.units import parse_unit

UNITS = ("km/h", "km", "kN", "t", "mph", "bar", "kW", "mm", "deg", "rpm", "%", "degC")
NUMBERS = arrays.arrays(float, st.integers(0, 20), elements=st.floats(-1e9, 1e9) | st.sampled_from([np.inf, np.nan]))


@given(raw=NUMBERS, name=st.sampled_from(UNITS))
def test_numbers_of_an_fmu_are_shown_and_come_back_to_the_last_bit(raw: np.ndarray, name: str) -> None:
    unit = parse_unit(name)
    values = unit.factor * raw + unit.offset
    shown = own_numbers(values, unit)
    assert shown is not None
    assert (unit.factor * shown + unit.offset).tobytes() == values.tobytes()
    if unit.offset == 0.0:
        np.testing.assert_allclose(shown, raw, rtol=1e-15, atol=1e-300)


def test_what_no_number_of_the_unit_gives_stays_in_si() -> None:
    unit = parse_unit("km/h")
    values = np.nextafter(unit.factor * np.linspace(50.0, 51.0, 1000), np.inf)
    assert own_numbers(values, unit) is None


def result() -> Result:
    time, raw = np.arange(5.0), np.array([0.0, 11.7, 50.1, 80.3, np.nan])
    speed = SignalInfo("plant.vIst", "m/s", "km/h", declared_unit="km/h")
    signals = [speed, SignalInfo("plant.aIst"), SignalInfo("plant.odd", "furlong"), SignalInfo("observer.speed", "m/s")]
    table = table_of(
        ["time", *(s.name for s in signals)], [time, parse_unit("km/h").factor * raw + 0.0, time, time, time]
    )
    return Result(table, signals)


def test_a_folder_shows_declared_units_and_is_read_in_si(tmp_path: Path) -> None:
    before = result()
    write_results(before, tmp_path)
    with (tmp_path / "table.csv").open() as file:
        headings, *rows = csv.reader(file)
    assert headings == ["time", "plant.vIst [km/h]", "plant.aIst", "plant.odd [furlong]", "observer.speed [m/s]"]
    assert [float(row[1]) for row in rows[:4]] == pytest.approx([0.0, 11.7, 50.1, 80.3], rel=1e-15)
    back = Result.of(read_results(tmp_path))
    assert back.table.tobytes() == before.table.tobytes()
    assert list(back.signals) == list(before.signals)
    (tmp_path / "copy").mkdir()
    alone = (tmp_path / "table.csv").rename(tmp_path / "copy" / "log.csv")
    assert cosim.load_result(alone)["plant.vIst"].tobytes() == before["plant.vIst"].tobytes()
    assert back.declared("plant.vIst")[1] == pytest.approx(11.7, rel=1e-15)
    assert back.declared("observer.speed").tolist() == back["observer.speed"].tolist()


def test_an_older_folder_without_units_is_what_it_was(tmp_path: Path) -> None:
    before = result()
    write_results(before, tmp_path)
    text = (tmp_path / "table.csv").read_text()
    rows = [",".join(map(repr, row)) for row in before.table.tolist()]
    names = ",".join(f'"{name}"' for name in before)
    (tmp_path / "table.csv").write_text("\n".join([names, *rows]) + "\n")
    assert (tmp_path / "table.csv").read_text() != text
    assert read_results(tmp_path).table.tobytes() == before.table.tobytes()


@pytest.mark.compiler
@pytest.mark.parametrize(("si", "heading", "last"), [(False, "fmu.v [km/h]", 36.0), (True, "fmu.v [m/s]", 10.0)])
def test_a_run_shows_what_its_fmu_declares_unless_si_is_wanted(
    si: bool, heading: str, last: float, tmp_path: Path
) -> None:
    fmu = linear_fmu(tmp_path, "train", [[0]], [[1]], [[3.6]], [[0]], inputs=["a"], outputs=["v"], units={"v": "km/h"})
    scenario = cosim.Scenario(stop=10.0, step=1.0, report={"si": si}).add("fmu", fmu=fmu, parameters={"a": 1.0})
    outcome = scenario.run()
    outcome.write(tmp_path / "out", report=False)
    with (tmp_path / "out" / "table.csv").open() as file:
        headings, *rows = csv.reader(file)
    assert headings[1] == heading
    assert float(rows[-1][1]) == pytest.approx(last, rel=1e-12)
    assert outcome["fmu.v"][-1] == pytest.approx(10.0, rel=1e-12)
    assert cosim.load_result(tmp_path / "out")["fmu.v"].tobytes() == outcome["fmu.v"].tobytes()
