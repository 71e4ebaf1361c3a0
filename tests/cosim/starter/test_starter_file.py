"""Starter scenarios: every file that is written loads, is valid and runs as written where the guesses are right."""

from __future__ import annotations

import tomllib
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_fmus.build import linear_fmu
from test_fmus.description import Model, Variable, description_xml
from test_fmus.typed import typed_fmu

import fmu_observer
import plant_models
from cosim import Scenario
from cosim.errors import FmuLoadError, OutputError, ScenarioError
from cosim.starter.starter_file import StarterWishes, starter, write_starter
from fmus import cached_fmu

TIME = Variable("time", 0, "independent")
HIDDEN = (("spring.s_rel", "m"), ("force.s", "m"), ("mass.s", "m"), ("mass.v", "m/s"))
FLAGS = {"canHandleVariableCommunicationStepSize": "true"}


def described(
    folder: Path, *variables: Variable, version: Any = 2, name: str = "vendor", edit: tuple[str, str] = ("", "")
) -> Path:
    """An FMU with a description and nothing to run."""
    text = description_xml(Model(name, "0", [TIME, *variables], FLAGS), version).replace(*edit)
    path = folder / f"{name}.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", text)
    return path


def out(name: str, reference: int, unit: str | None = None, **more: Any) -> Variable:
    return Variable(name, reference, "output", unit=unit, **more)


def into(name: str, reference: int, unit: str | None = None, **more: Any) -> Variable:
    return Variable(name, reference, "input", unit=unit, start=more.pop("start", 0.0), **more)


# -- FMUs that run
# -------------------------------------------------------------------------------------------------------


@pytest.mark.compiler
@pytest.mark.parametrize("version", [2, 3])
def test_a_locomotive_runs_as_written_and_is_localised(version: Any, tmp_path: Path) -> None:
    fmu = cached_fmu(plant_models.Locomotive(), fmi_version=version)
    made = write_starter(fmu, tmp_path / "mine.toml")
    assert made.kind == "train"
    assert "PLEASE CHECK" not in made.text
    outcome = Scenario.load(tmp_path / "mine.toml").run()
    assert outcome.failure is None
    # Every 100 m from 50 m on, as far as the train comes; over 60 s that is more than 500 m at up to 50 km/h.
    end = outcome["plant.position"][-1]
    assert len([e for e in outcome.result.events if e.kind == "true"]) == int((end - 50.0) / 100.0) + 1 >= 5
    late = outcome["time"] > 10.0
    error = outcome["observer.speed"] - outcome["plant.speed"]
    assert np.max(np.abs(error[late])) < 0.05 * np.max(outcome["plant.speed"])
    assert np.max(outcome["plant.speed"]) > 10.0


@pytest.mark.compiler
@pytest.mark.parametrize("version", [1, 2, 3])
def test_a_plant_in_german_and_other_units_is_driven_in_si(version: Any, tmp_path: Path) -> None:
    """A point of 90 t in kN, km and km/h: the observer, told in N, m and m/s, sees the speed that the FMU tells in
    km/h.
    """
    units = {"Zugkraft": "kN", "Weg": "km", "Geschwindigkeit": "km/h"}
    A, B, C, D = [[0, 1], [0, 0]], [[0], [1000 / 90e3]], [[1e-3, 0], [0, 3.6]], [[0], [0]]
    fmu = linear_fmu(
        tmp_path,
        "zug",
        A,
        B,
        C,
        D,
        version=version,
        inputs=["Zugkraft"],
        outputs=["Weg", "Geschwindigkeit"],
        units=units,
    )
    made = write_starter(fmu, tmp_path / "zug.toml")
    assert made.kind == "train"
    outcome = Scenario.load(tmp_path / "zug.toml").run(overrides={"stop": 20.0})
    assert outcome.failure is None
    assert outcome["plant.Geschwindigkeit"][-1] == pytest.approx(50.0 / 3.6, rel=0.05)  # recorded in SI
    assert outcome["observer.speed"][-1] == pytest.approx(outcome["plant.Geschwindigkeit"][-1], rel=0.02)
    assert len(outcome.result.events) >= 1


@pytest.mark.compiler
def test_an_observer_is_put_beside_a_locomotive(tmp_path: Path) -> None:
    fmu = cached_fmu(fmu_observer.OBSERVERS["takagi_sugeno_cdo"](), fmi_version=3)
    made = write_starter(fmu, tmp_path / "mine.toml")
    assert made.kind == "observer"
    outcome = Scenario.load(tmp_path / "mine.toml").run(overrides={"stop": 6.0})
    assert outcome.failure is None
    assert {e.outcomes["observer"] for e in outcome.result.events} == {"accepted"}
    assert outcome["observer.speed"][-1] == pytest.approx(outcome["plant.speed"][-1], abs=0.1)


@pytest.mark.compiler
@pytest.mark.parametrize("version", [1, 2, 3])
def test_without_signals_of_a_train_the_fmu_runs_alone(version: Any, tmp_path: Path) -> None:
    """Numbers, truth values, texts, enumerations, bytes and arrays as inputs: what can be set stands there at its start
    value.
    """
    made = write_starter(typed_fmu(tmp_path, version=version), tmp_path / "mine.toml", StarterWishes(probe=False))
    assert made.kind == "alone"
    parameters = tomllib.loads(made.text)["components"]["fmu"]["parameters"]
    assert (parameters["u_int32"], parameters["u_boolean"], parameters["u_string"]) == (0, False, "")
    assert ("# u_matrix = ..." in made.text) == (version == 3)
    assert Scenario.load(tmp_path / "mine.toml").run().failure is None


# -- descriptions
# --------------------------------------------------------------------------------------------------------


def valid(path: Path) -> Scenario:
    """The scenario in a file, checked as far as it can be without running."""
    scenario = Scenario.load(path)
    scenario.structure()
    return scenario


def test_a_train_without_position_has_no_balises(tmp_path: Path) -> None:
    fmu = described(tmp_path, into("Zugkraft", 1, "kN"), out("vRad", 2, "m/s"), out("v", 3, "m/s"))
    made = write_starter(fmu, tmp_path / "mine.toml")
    table = valid(tmp_path / "mine.toml").table()
    assert table.balises is None
    assert '# position = "plant.NAME"' in made.text
    assert "position: not found" in made.remarks
    assert "plant.vRad -> odometer.wheel_speed" in table.connections
    assert table.report.true_speed == "plant.v"


def test_a_train_that_hides_position_and_speed_is_searched(tmp_path: Path) -> None:
    hidden = [Variable(name, number, "local", unit=unit) for number, (name, unit) in enumerate(HIDDEN, start=3)]
    made = write_starter(described(tmp_path, into("f", 1, "N"), out("y", 2), *hidden), tmp_path / "mine.toml")
    table = valid(tmp_path / "mine.toml").table()
    assert table.balises is not None
    assert (table.balises.position, table.balises.speed) == ("plant.mass.s", "plant.mass.v")
    assert "plant.mass.v -> odometer.wheel_speed" in table.connections
    assert "a local variable" in made.text


def test_an_output_is_preferred_to_a_local_that_fits_as_well(tmp_path: Path) -> None:
    hidden = [Variable(name, number, "local", unit=unit) for number, (name, unit) in enumerate(HIDDEN, start=4)]
    shown = (into("f", 1, "N"), out("position", 2, "m"), out("speed", 3, "m/s"))
    write_starter(described(tmp_path, *shown, *hidden), tmp_path / "mine.toml")
    balises = valid(tmp_path / "mine.toml").table().balises
    assert balises is not None
    assert (balises.position, balises.speed) == ("plant.position", "plant.speed")


def test_a_train_without_effort_has_no_driver(tmp_path: Path) -> None:
    fmu = described(tmp_path, out("position", 1, "m"), out("speed", 2, "m/s"), out("traction_force", 3, "N"))
    write_starter(fmu, tmp_path / "mine.toml")
    table = valid(tmp_path / "mine.toml").table()
    assert "driver" not in table.components
    assert "plant.traction_force -> observer.effort" in table.connections


def test_the_observer_beside_a_plant_is_told_all_that_is_known(tmp_path: Path) -> None:
    """In place of its own defaults, which are those of a train of 1 kg."""
    masses = Variable("Masse", 4, "parameter", start=420.0, unit="t"), Variable("davis_b", 5, "parameter", start=77.0)
    write_starter(
        described(tmp_path, into("F", 1, "N"), out("s", 2, "m"), out("v", 3, "m/s"), *masses), tmp_path / "m.toml"
    )
    observer = valid(tmp_path / "m.toml").table().components["observer"]
    assert observer.observer == "quasi_lpv_uio"
    reported = {"mass": 420e3, "davis_a": 4200.0, "davis_b": 77.0, "odometer_period": 0.01}
    assert {name: observer.parameters[name] for name in reported} == reported


def test_without_an_effort_the_odometer_is_reset_at_balises(tmp_path: Path) -> None:
    write_starter(described(tmp_path, out("position", 1, "m"), out("speed", 2, "m/s")), tmp_path / "mine.toml")
    table = valid(tmp_path / "mine.toml").table()
    assert table.components["observer"].observer == "odometer_reset"
    assert not [c for c in table.connections if "effort" in str(c)]


def test_a_wheel_that_turns_is_multiplied_by_a_radius_to_be_written(tmp_path: Path) -> None:
    fmu = described(tmp_path, into("F", 1, "N"), out("s", 2, "m"), out("v", 3, "m/s"), out("axle.speed", 4, "rpm"))
    made = write_starter(fmu, tmp_path / "mine.toml")
    (turned,) = [c for c in valid(tmp_path / "mine.toml").table().connections if not isinstance(c, str)]
    assert (turned.source, turned.target, turned.units) == ("plant.axle.speed", "odometer.wheel_speed", "ignore")
    assert turned.factor == pytest.approx(0.5 * np.pi / 30.0, rel=1e-12)
    assert "WRITE YOURS" in made.text


def test_units_that_nobody_understands_ask_for_a_factor(tmp_path: Path) -> None:
    parts = [into("force", 1, "kg"), out("position", 2, "m"), out("speed", 3, "s")]
    path = described(tmp_path, *parts, name="raw")
    with zipfile.ZipFile(path) as archive:
        text = archive.read("modelDescription.xml").decode()
    text = text[: text.index("<UnitDefinitions>")] + text[text.index("</UnitDefinitions>") + 18 :]
    text = text.replace('unit="s"', 'unit="kmh"').replace('unit="kg"', 'unit="kilonewton"')
    path = tmp_path / "vendor.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", text)
    made = write_starter(path, tmp_path / "mine.toml")
    table = valid(tmp_path / "mine.toml").table()
    tables = [c for c in table.connections if not isinstance(c, str)]
    assert {(c.source, c.target, c.factor, c.units) for c in tables} == {
        ("driver.effort", "plant.force", 1.0, "ignore"),
        ("plant.speed", "odometer.wheel_speed", 1.0, "ignore"),
    }
    assert table.balises is None
    assert made.text.count("is not understood: write the factor") == 2


def test_the_mass_is_taken_from_the_fmu_in_kg(tmp_path: Path) -> None:
    parts = [
        into("F", 1, "N"),
        out("s", 2, "m"),
        out("v", 3, "m/s"),
        Variable("Masse", 4, "parameter", start=420.0, unit="t"),
    ]
    write_starter(described(tmp_path, *parts), tmp_path / "mine.toml", StarterWishes("discrete_uio"))
    observer = valid(tmp_path / "mine.toml").table().components["observer"]
    assert (observer.observer, observer.parameters["mass"]) == ("discrete_uio", 420e3)


def test_a_mass_that_is_none_of_a_train_is_named_where_it_is_written(tmp_path: Path) -> None:
    mass = Variable("Masse", 4, "parameter", start=90.0, unit="kg")
    parts = [into("F", 1, "N"), out("s", 2, "m"), out("v", 3, "m/s"), mass]
    made = write_starter(described(tmp_path, *parts), tmp_path / "mine.toml")
    assert "NO MASS OF A TRAIN: where tonnes are meant write 90000" in made.text


def test_the_step_is_the_fmus_own(tmp_path: Path) -> None:
    parts = [into("F", 1, "N"), out("s", 2, "m"), out("v", 3, "m/s")]
    fmu = described(tmp_path, *parts, edit=('stopTime="1.0"', 'stopTime="1.0" stepSize="0.07"'))
    write_starter(fmu, tmp_path / "mine.toml")
    table = valid(tmp_path / "mine.toml").table()
    assert table.step == 0.07
    assert table.stop == pytest.approx(60.0, abs=0.07)


@pytest.mark.parametrize(
    ("advised", "expected"),
    [
        ('startTime="1000.0" stopTime="1120.0" stepSize="0.05"', (1000.0, 1120.0, 0.05)),
        ('startTime="0.0" stopTime="3605.0"', (0.0, 3605.0, 0.01)),
        ('startTime="0.0" stopTime="1.0"', (0.0, 60.0, 0.01)),
        ('startTime="0.0" stopTime="INF"', (0.0, 60.0, 0.01)),
    ],
)
def test_a_train_that_nobody_drives_runs_as_long_as_its_fmu_says(
    advised: str, expected: tuple[float, float, float], tmp_path: Path
) -> None:
    """What drives it is in it, and may come late; a second is the default of a tool, and no journey."""
    parts = (out("position", 1, "m"), out("speed", 2, "m/s"))
    fmu = described(tmp_path, *parts, edit=('startTime="0.0" stopTime="1.0"', advised))
    write_starter(fmu, tmp_path / "mine.toml")
    table = valid(tmp_path / "mine.toml").table()
    assert (table.start, table.stop, table.step) == pytest.approx(expected)


def test_an_fmu_that_names_no_end_runs_for_ten_seconds(tmp_path: Path) -> None:
    made = write_starter(described(tmp_path, out("level", 1), edit=(' stopTime="1.0"', "")), tmp_path / "mine.toml")
    assert (made.kind, "names no end of a run" in made.text) == ("alone", True)
    table = valid(tmp_path / "mine.toml").table()
    assert (table.stop, table.step) == (10.0, 0.01)


def test_texts_of_a_vendor_cannot_leave_their_line(tmp_path: Path) -> None:
    wild = 'a\nstop = 1\n"] # \\ " \t \x7f é → b'
    parts = [
        into('F "trac" -> \\ , x', 1, "N"),
        out("s", 2, "m"),
        out("v", 3, "m/s"),
        into("odd\nname = 3", 4),
        Variable("p.[q] #", 5, "parameter", start=1.5),
    ]
    fmu = described(
        tmp_path, *parts, edit=('name="s"', f'name="s" description="{"".join(f"&#{ord(c)};" for c in wild)}"')
    )
    made = write_starter(fmu, tmp_path / "mine.toml")
    table = valid(tmp_path / "mine.toml").table()
    assert table.stop == 60.0
    targets = [c.target for c in table.connections if not isinstance(c, str)]
    assert 'plant.F "trac" -> \\ , x' in targets
    uncommented = made.text.replace('\n# "p.[q] #" = 1.5', '\n"p.[q] #" = 1.5')
    assert tomllib.loads(uncommented)["components"]["plant"]["parameters"]["p.[q] #"] == 1.5


def test_the_path_is_relative_to_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    described(tmp_path, out("y", 1))
    (tmp_path / "runs").mkdir()
    monkeypatch.chdir(tmp_path)
    assert 'fmu = "../vendor.fmu"' in write_starter("vendor.fmu", "runs/mine.toml").text
    valid(tmp_path / "runs" / "mine.toml")


def test_a_very_large_fmu_gives_a_file_that_can_be_read(tmp_path: Path) -> None:
    parts = [into(f"u{i}", 1 + i) for i in range(300)] + [out("big", 400, shape=[100, 100]), out("few", 401, shape=[2])]
    made = starter(described(tmp_path, *parts, version=3), tmp_path / "mine.toml")
    assert len(made.text.splitlines()) < 160
    assert "... and 260 more" in made.text
    assert "output big[100, 100]: Float64" in made.text
    assert "few[2]" in made.text


# -- what is refused
# -----------------------------------------------------------------------------------------------------


def test_what_is_no_fmu_or_not_for_co_simulation_is_refused(tmp_path: Path) -> None:
    (tmp_path / "text.fmu").write_text("no archive")
    with pytest.raises(FmuLoadError, match=r"text\.fmu"):
        starter(tmp_path / "text.fmu", tmp_path / "mine.toml")
    with pytest.raises(FmuLoadError, match=r"nowhere\.fmu"):
        starter(tmp_path / "nowhere.fmu", tmp_path / "mine.toml")
    fmu = described(tmp_path, out("y", 1), version=3, edit=("<CoSimulation", "<ScheduledExecution"))
    with pytest.raises(FmuLoadError, match=r"offers scheduled execution only; .*Ask its maker"):
        write_starter(fmu, tmp_path / "mine.toml")
    assert not (tmp_path / "mine.toml").exists()


def test_a_file_that_exists_is_kept_unless_forced(tmp_path: Path) -> None:
    fmu = described(tmp_path, out("y", 1))
    (tmp_path / "mine.toml").write_text("mine")
    with pytest.raises(OutputError, match="exists already"):
        write_starter(fmu, tmp_path / "mine.toml")
    assert (tmp_path / "mine.toml").read_text() == "mine"
    write_starter(fmu, tmp_path / "mine.toml", force=True)
    valid(tmp_path / "mine.toml")
    with pytest.raises(OutputError, match=r"ends in \.toml"):
        write_starter(fmu, tmp_path / "mine.txt")


def test_an_observer_must_be_one_that_can_be_connected(tmp_path: Path) -> None:
    fmu = described(tmp_path, out("y", 1))
    with pytest.raises(ScenarioError, match="did you mean 'discrete_uio'"):
        starter(fmu, tmp_path / "mine.toml", StarterWishes("discrete_ui"))
    with pytest.raises(ScenarioError, match="No observer 'kalman_filter' that listens"):
        starter(fmu, tmp_path / "mine.toml", StarterWishes("kalman_filter"))
    assert "discrete_uio was not used." in starter(fmu, tmp_path / "mine.toml", StarterWishes("discrete_uio")).remarks
