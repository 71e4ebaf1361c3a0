"""Units of a calibration: whatever units an FMU declares, a recording means the same parameters."""

from __future__ import annotations

import tomllib
import zipfile
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import cosim
import fmus
from cosim.calibration.fitting import Calibration, calibrate
from cosim.calibration.fmu_runs import FmuRuns
from cosim.calibration.recorded_signals import CalibrationError, RecordedSignals
from cosim.calibration.scenario_runs import ScenarioRuns
from cosim.cli import main
from cosim.errors import CosimError
from plant_models import PLANTS

KNOWN = {"traction_coefficient": 1.0, "davis_a": 1800.0, "davis_b": 80.0, "train_speed": 3.0, "internal_step": 0.1}
GUESS = {"mass": 70e3, "davis_c": 5.0}
TIME = np.arange(0.0, 30.25, 0.5)
EFFORT = np.where(TIME < 15.0, 60e3, 10e3)
SAME = 1e-5
"""How far apart two ends of the optimiser may be, relative: least squares end at 1e-8 of the cost."""


@pytest.fixture(scope="module")
def train() -> Path:
    return fmus.cached_fmu(PLANTS["longitudinal_train"](), fmi_version=3)


def declared(train: Path, path: Path, speed: float | None, effort: float | None) -> Path:
    """The train, whose numbers of speed and effort are said to be in units of this many m/s and N; None: in none."""
    with zipfile.ZipFile(train) as source, zipfile.ZipFile(path, "w") as target:
        for name in source.namelist():
            content = source.read(name)
            if name == "modelDescription.xml":
                content = in_units(content.decode(), speed, effort).encode()
            target.writestr(name, content)
    return path


def in_units(text: str, speed: float | None, effort: float | None) -> str:
    lines = []
    for line in text.splitlines():
        for signal, unit, factor in (("speed", "m/s", speed), ("effort", "N", effort)):
            if f'name="{signal}"' in line and f'unit="{unit}"' in line:
                own = "" if factor is None else f' unit="of_{signal}"'
                lines.append(line.replace(f' unit="{unit}"', own))
                break
        else:
            lines.append(line)
    units = [
        f'<Unit name="of_{name}"><BaseUnit {powers} factor="{factor!r}"/></Unit>'
        for name, powers, factor in (("speed", 'm="1" s="-1"', speed), ("effort", 'kg="1" m="1" s="-2"', effort))
        if factor is not None
    ]
    return "\n".join(lines).replace("</UnitDefinitions>", f"{''.join(units)}</UnitDefinitions>")


@pytest.fixture(scope="module")
def recorded(train: Path) -> RecordedSignals:
    """A journey of 80 t with noise, in SI and in the numbers of the train, which are the same."""
    bare = RecordedSignals(TIME, {"speed": np.zeros_like(TIME)}, {"effort": EFFORT})
    with closing(FmuRuns(train, list(GUESS), fixed=KNOWN)) as runs:
        speed = runs.run({"mass": 80e3, "davis_c": 7.0}, bare)[0]
    noisy = speed + 0.02 * np.random.default_rng(5).standard_normal(len(TIME))
    return RecordedSignals(TIME, {"speed": noisy}, {"effort": EFFORT}, {"speed": "m/s", "effort": "N"})


def found(path: Path, recorded: RecordedSignals) -> Calibration:
    with closing(FmuRuns(path, list(GUESS), fixed=KNOWN, guesses=GUESS)) as runs:
        return calibrate(runs, recorded)


@pytest.fixture(scope="module")
def expected(train: Path, recorded: RecordedSignals) -> Calibration:
    """In SI throughout."""
    return found(train, recorded)


def in_si(recorded: RecordedSignals, speed: float, effort: float) -> RecordedSignals:
    """What a train whose numbers stand in such units leaves behind, in SI."""
    measured = {"speed": speed * recorded.measured["speed"]}
    return RecordedSignals(TIME, measured, {"effort": effort * EFFORT}, recorded.units)


@settings(max_examples=4)
@given(speed=st.floats(0.1, 10.0), effort=st.floats(1e-3, 1e3))
@example(speed=1.0 / 3.6, effort=1000.0)
def test_any_units_give_the_same_parameters(
    train: Path,
    recorded: RecordedSignals,
    expected: Calibration,
    tmp_path_factory: pytest.TempPathFactory,
    speed: float,
    effort: float,
) -> None:
    path = declared(train, tmp_path_factory.mktemp("units") / "other.fmu", speed, effort)
    other = found(path, in_si(recorded, speed, effort))
    assert other.values == pytest.approx(expected.values, rel=SAME)
    assert other.recorded.units == {"speed": "of_speed", "effort": "of_effort"}
    assert not [text for text in other.remarks if "unit" in text]


def test_without_units_the_numbers_are_taken_as_they_are_and_this_is_said(
    train: Path, recorded: RecordedSignals, expected: Calibration, tmp_path: Path
) -> None:
    bare = RecordedSignals(TIME, recorded.measured, recorded.inputs, dict.fromkeys(recorded.units, "1"))
    for path, said in (
        (declared(train, tmp_path / "none.fmu", None, None), "speed (unit in the recording: none, in the model: none)"),
        (train, "effort (unit in the recording: none, in the model: N)"),
    ):
        other = found(path, bare)
        assert other.values == expected.values
        (remark,) = [text for text in other.remarks if "unit" in text]
        assert said in remark


def test_a_component_of_a_scenario_is_calibrated_to_the_same_parameters(
    train: Path, recorded: RecordedSignals, expected: Calibration, tmp_path: Path
) -> None:
    other = declared(train, tmp_path / "other.fmu", 1.0 / 3.6, 1e3)
    journey = in_si(recorded, 1.0 / 3.6, 1e3)
    rows = np.c_[TIME, journey.inputs["effort"]]
    np.savetxt(tmp_path / "log.csv", rows, delimiter=",", header="time,effort [N]", comments="")
    scenario = cosim.Scenario(stop=float(TIME[-1]), step=0.5).add("train", fmu=other, parameters=KNOWN | GUESS)
    scenario.add("log", recording=tmp_path / "log.csv", interpolation={"effort": "hold"})
    scenario.connect("log.effort -> train.effort")
    measured = RecordedSignals(TIME, {"train.speed": journey.measured["speed"]}, units={"train.speed": "m/s"})
    with closing(ScenarioRuns(scenario, [f"train.{name}" for name in GUESS])) as runs:
        values = calibrate(runs, measured).values
    assert values == pytest.approx({f"train.{n}": v for n, v in expected.values.items()}, rel=SAME)


def test_a_unit_that_measures_something_else_is_refused_with_its_place(
    train: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    np.savetxt(
        tmp_path / "run.csv", np.c_[TIME, EFFORT, TIME], delimiter=",", header="time,effort [N],speed [kg]", comments=""
    )
    assert main(["calibrate", str(train), str(tmp_path / "run.csv"), "--parameters", "mass=70e3"]) == 2
    assert "run.csv, column 'speed' -> speed: units 'kg' and 'm/s' do not fit" in capsys.readouterr().err


def test_an_input_of_a_driven_fmu_is_converted_too(train: Path, tmp_path: Path) -> None:
    """One FMU takes newtons, the other kilonewtons, its mass is in tonnes; the same is done to both."""
    kilo = declared(train, tmp_path / "kilo.fmu", None, 1e3)
    known = KNOWN | {"davis_c": 7.0}
    scaled = {name: value * (1e-3 if name.startswith("davis") else 1.0) for name, value in known.items()}
    fixed = [word for name, value in scaled.items() for word in ("--set", f"{name}={value}")]
    drive = [f"{name}={value}" for name, value in (known | {"mass": 80e3}).items()]
    words = ["--parameters", "mass=70", "--signals", "speed", "--stop", "30", "--drive", *drive, "effort=60e3"]
    files = ["--toml", str(tmp_path / "found.toml")]
    assert main(["calibrate", str(kilo), str(train), *words, *fixed, *files]) == 0
    values = tomllib.loads((tmp_path / "found.toml").read_text())["parameters"]
    assert values["mass"] == pytest.approx(80.0, rel=SAME)


def test_a_unit_nobody_explains_goes_to_its_own_name_only(recorded: RecordedSignals, train: Path) -> None:
    with pytest.raises(CalibrationError, match="nothing defines the unit 'furlong'"):
        found(train, RecordedSignals(TIME, recorded.measured, recorded.inputs, {"speed": "furlong"}))


def test_units_that_are_stated_are_declared_ones(train: Path, recorded: RecordedSignals, tmp_path: Path) -> None:
    sealed = declared(train, tmp_path / "sealed.fmu", None, None)
    journey = in_si(recorded, 1.0 / 3.6, 1e3)
    declares = found(declared(train, tmp_path / "declares.fmu", 1.0 / 3.6, 1e3), journey)
    stated = {"speed": "km/h", "effort": {"unit": "kN"}}
    with closing(FmuRuns(sealed, list(GUESS), fixed=KNOWN, guesses=GUESS, units=stated)) as runs:
        assert runs.unit("speed") == "km/h"
        states = calibrate(runs, journey)
    assert states.values == pytest.approx(declares.values, rel=1e-12)  # the factors are the same but for rounding
    with pytest.raises(CosimError, match="units: speed: Input should be"):
        FmuRuns(sealed, list(GUESS), units={"speed": 3.6})
    with pytest.raises(CosimError, match="sped"):
        FmuRuns(sealed, list(GUESS), fixed=KNOWN, units={"sped": "km/h"})


def test_the_command_takes_units_of_the_fmu_that_is_fitted_or_of_the_one_that_is_driven(
    train: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sealed = declared(train, tmp_path / "sealed.fmu", None, None)
    known = [f"{name}={value}" for name, value in (KNOWN | {"davis_c": 7.0, "mass": 80e3}).items()]
    drive = ["--drive", *known, "effort=60e3", "--stop", "30"]
    files = ["--toml", str(tmp_path / "found.toml")]
    fixed = [word for name, value in (KNOWN | {"davis_c": 7.0}).items() for word in ("--set", f"{name}={value}")]
    fitted = ["--parameters", "mass=70e3", "--signals", "speed", *fixed, *files]
    assert (
        main(["calibrate", str(sealed), str(train), *drive, *fitted, "--unit", "speed=m/s", "--unit", "effort=N"]) == 0
    )
    assert tomllib.loads((tmp_path / "found.toml").read_text())["parameters"]["mass"] == pytest.approx(80e3, rel=SAME)
    assert "unit is missing" not in capsys.readouterr().out
    resistance = [
        "calibrate",
        "running_resistance",
        str(sealed),
        *drive,
        "--set",
        "mass=80e3",
        "--signals",
        "speed=speed",
    ]
    assert main([*resistance, "--unit", "speed=m/s", "--unit", "effort=N"]) in (
        0,
        1,
    )  # whatever is identified of a journey so short
    assert "unit is missing" not in capsys.readouterr().out
    assert main(["calibrate", "running_resistance", str(tmp_path / "log.csv"), "--unit", "speed=m/s"]) == 2
    assert "--unit belongs to an FMU" in capsys.readouterr().err
