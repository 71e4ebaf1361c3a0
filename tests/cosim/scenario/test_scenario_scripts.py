"""Scenarios in scripts: saved and loaded again, made of one FMU alone, set by names of every kind."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from small_scenarios import small
from test_fmus.build import linear_fmu

from cosim import Scenario, shipped_scenarios
from cosim.errors import CosimError, ScenarioError


def double_integrator(folder: Path) -> Path:
    """``x'' = u``, exact for inputs that are held over a step."""
    folder.mkdir(parents=True, exist_ok=True)
    A, B, C, D = [[0, 1], [0, 0]], [[0], [1]], [[1, 0], [0, 1]], [[0], [0]]
    return linear_fmu(folder, "mass", A, B, C, D, version=2, inputs=["u"], outputs=["x", "v"])


@pytest.mark.parametrize("name", shipped_scenarios())
def test_what_ships_is_equal_after_saving(name: str, tmp_path: Path) -> None:
    scenario = Scenario.load(name)
    before, after = scenario.table(), Scenario.load(scenario.save(tmp_path / "saved.toml")).table()
    if name == "own_fmu":  # its path is relative, and the file stands elsewhere now
        place = tmp_path / str(after.components["plant"].fmu)
        assert place.resolve() == (scenario.folder / str(before.components["plant"].fmu)).resolve()
        both = (scenario, Scenario.load(tmp_path / "saved.toml"))  # nor is it there before somebody builds it
        before, after = (s.with_settings({"plant.fmu": place}).table() for s in both)
    if before.balises is not None and before.balises.file is not None:  # relative too
        place = (scenario.folder / before.balises.file).resolve()
        saved = Scenario.load(tmp_path / "saved.toml")
        assert after.balises is not None
        assert (saved.folder / str(after.balises.file)).resolve() == place
        before, after = (s.set("balises.file", str(place)).table() for s in (scenario, saved))
    assert after == before


def test_a_saved_scenario_runs_identically(tmp_path: Path) -> None:
    scenario = small(description="Two\nlines").set("balises.latency", 0.02).set("master.iteration.method", "aitken")
    scenario.connect()
    saved = Scenario.load(scenario.save(tmp_path / "deep" / "saved.toml"))
    assert saved.table() == scenario.table()
    a, b = scenario.run(), saved.run()
    np.testing.assert_array_equal(a.result.table, b.result.table)
    assert [e.delivered_at for e in a.result.events] == [e.delivered_at for e in b.result.events]


@settings(max_examples=100)
@example("lines\r\nof another system", {})
@given(
    st.text(max_size=20),
    st.dictionaries(
        st.text(min_size=1, max_size=5), st.floats(allow_nan=False, allow_infinity=False) | st.text(max_size=5)
    ),
)
def test_every_text_and_number_survives(title: str, parameters: dict[str, Any]) -> None:
    component = {"model": "driver", "parameters": parameters}
    scenario = Scenario(stop=1.0, step=0.1, title=title, components={"a": component})
    read = tomllib.loads(scenario.to_toml())
    assert read["title"] == title
    assert read["components"]["a"].get("parameters", {}) == parameters


def test_numbers_of_numpy_are_numbers(tmp_path: Path) -> None:
    scenario = (
        small()
        .set("step", np.float64(0.01))
        .set("locomotive.zone_from", np.array([1.0, 2.0, 3.0]))
        .set("balises.seed", np.int64(3))
    )
    scenario.set("observer.odometer_gain_speed", (np.float32(0.5), 0.25))
    table = Scenario.load(scenario.save(tmp_path / "saved.toml")).table()
    assert table.components["locomotive"].parameters["zone_from"] == [1.0, 2.0, 3.0]
    assert table.components["observer"].parameters["odometer_gain_speed"] == [0.5, 0.25]
    assert table.balises is not None
    assert (table.balises.seed, table.step) == (3, 0.01)


def test_paths_become_relative_to_the_saved_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "track.csv").write_text("identity,position\nA,1.0\n")
    monkeypatch.chdir(tmp_path)
    scenario = small().set("balises.layout", "csv").set("balises.file", "track.csv")
    saved = scenario.save("runs/saved.toml")
    assert 'file = "../track.csv"' in saved.read_text()
    assert 'file = "track.csv"' in scenario.to_toml()
    monkeypatch.chdir("/")
    assert [e.identity for e in Scenario.load(tmp_path / saved).run().result.events] == ["A"]


def test_what_cannot_be_saved_is_reported(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=r"ends in \.toml"):
        small().save(tmp_path / "x.ssp")
    with pytest.raises(ScenarioError, match=r"balises\.sed: unknown key"):
        small().set("balises.sed", 1).save(tmp_path / "x.toml")
    (tmp_path / "file").touch()
    with pytest.raises(CosimError, match="cannot be written"):
        small().save(tmp_path / "file" / "x.toml")


@pytest.mark.compiler
def test_a_scenario_out_of_a_package_is_saved_with_its_fmus(tmp_path: Path) -> None:
    """The folder in which a package is unpacked is gone with the scenario; the files beside the saved one are not."""
    fmu = double_integrator(tmp_path)
    package = Scenario.fmu(fmu, stop=1.0, step=0.1, inputs={"u": 2.0}, name="mass").export_ssp(tmp_path / "system.ssp")
    loaded = Scenario.load(package)
    expected = loaded.run().result.table
    saved = loaded.save(tmp_path / "there" / "saved.toml")
    del loaded
    np.testing.assert_array_equal(Scenario.load(saved).run().result.table, expected)
    assert [p.suffix for p in (tmp_path / "there" / "saved_files").iterdir()] == [".fmu"]


@pytest.mark.compiler
def test_an_fmu_alone_with_held_and_with_played_back_inputs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """``v = 2 t`` under ``u = 2``; under the ramp ``u = t`` the mean over each step gives ``v = t^2 / 2`` but for
    rounding.
    """
    double_integrator(tmp_path)
    monkeypatch.chdir(tmp_path)
    held = Scenario.fmu("mass.fmu", stop=1.0, step=0.1, inputs={"u": 2.0}, parameters={"x0[1]": 5.0}).run()
    np.testing.assert_allclose(held["fmu.v"], 2.0 * held["time"], rtol=1e-12)
    assert held["fmu.x"][0] == 5.0
    (tmp_path / "inputs.csv").write_text("time,u,other\n0,0,1\n10,10,1\n")
    scenario = Scenario.fmu("mass.fmu", stop=1.0, step=0.1, inputs="inputs.csv", name="plant")
    played = scenario.run()
    np.testing.assert_allclose(played["plant.v"], played["time"] ** 2 / 2.0, rtol=1e-9, atol=1e-12)
    assert any("not used: other" in w for w in played.warnings)
    monkeypatch.chdir("/")
    again = Scenario.load(scenario.save(tmp_path / "kept" / "x.toml")).run()
    np.testing.assert_array_equal(again.result.table, played.result.table)


@pytest.mark.compiler
def test_times_of_an_fmu_alone_are_its_own_unless_stated(tmp_path: Path) -> None:
    fmu = double_integrator(tmp_path)  # its default experiment ends at 1 s and names no step
    table = Scenario.fmu(fmu).table()
    assert (table.start, table.stop, table.step) == (0.0, 1.0, 1e-3)
    table = Scenario.fmu(fmu, start=1.0, stop=3.0, step=0.5).table()
    assert (table.start, table.stop, table.step) == (1.0, 3.0, 0.5)


@pytest.mark.compiler
def test_wrong_inputs_of_an_fmu_alone_are_reported(tmp_path: Path) -> None:
    fmu = double_integrator(tmp_path)
    with pytest.raises(ScenarioError, match=r"mass\.fmu has no input 'uu'; did you mean 'u'"):
        Scenario.fmu(fmu, inputs={"uu": 1.0})
    (tmp_path / "inputs.csv").write_text("time,w\n0,0\n1,1\n")
    with pytest.raises(
        ScenarioError, match=r"inputs\.csv: no column is named as an input of mass\.fmu\. Columns: w; inputs: u\."
    ):
        Scenario.fmu(fmu, inputs=tmp_path / "inputs.csv")
    with pytest.raises(CosimError, match=r"nowhere\.fmu"):
        Scenario.fmu("nowhere.fmu")


def test_set_reaches_tables_in_tables_and_says_what_it_cannot_reach() -> None:
    scenario = small().set("master.iteration.method", "aitken").set("locomotive.parameters.mass", 80e3)
    scenario.set("report.published.observer.all", 0.5)
    table = scenario.table()
    assert table.master.iteration.method == "aitken"
    assert table.components["locomotive"].parameters["mass"] == 80e3
    assert table.report.published == {"observer": {"all": 0.5}}
    with pytest.raises(ScenarioError, match=r"cannot set 'master\.stepper\.x': 'stepper' is no table"):
        scenario.set("master.stepper", "python").set("master.stepper.x", 1)
