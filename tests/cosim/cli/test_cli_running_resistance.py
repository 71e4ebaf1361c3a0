"""``cosim calibrate running_resistance``: from tables and FMUs, what it prints and writes, exit codes, mistakes; train
models by name; and what the former ``cosim identify`` answers.
"""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest

from cosim.calibration.recorded_signals import RecordedSignals
from cosim.calibration.running_resistance import RunningResistance
from cosim.cli import main
from fmus.build import build_fmu
from plant_models.railway.vehicle.locomotive import Locomotive

LOA = {"net_acceleration": 1.2 - 0.46, "davis_b": 5.7e-3, "davis_c": -2.4e-4, "initial_speed": 1.0}
FIT = ["calibrate", "running_resistance"]


@pytest.fixture
def table(tmp_path: Path) -> Path:
    time = np.linspace(0.0, 60.0, 601)
    speed = RunningResistance().run(LOA, RecordedSignals(time, {}))[0]
    path = tmp_path / "run.csv"
    rows = np.c_[time, 3.6 * (speed + 0.02 * np.random.default_rng(1).standard_normal(601)), np.full(601, 60e3)]
    np.savetxt(path, rows, delimiter=",", header="time [s],speed [km/h],force [N]", comments="")
    return path


def test_from_a_table_with_a_mass_picture_and_parameters(table: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = table.parent
    words = [*FIT, str(table), "--inputs", "effort=force", "--set", "mass=50e3"]
    assert main([*words, "--plot", str(folder / "r.png"), "--toml", str(folder / "p.toml")]) == 0
    printed = capsys.readouterr().out
    assert "davis_a" in printed
    assert "95 % interval" in printed
    assert (folder / "r.png").read_bytes().startswith(b"\x89PNG")
    found = tomllib.loads((folder / "p.toml").read_text())["parameters"]
    assert set(found) == {"mass", "davis_a", "davis_b", "davis_c"}
    assert found["mass"] == 50e3
    assert found["davis_a"] == pytest.approx(0.46 * 50e3, rel=0.02)
    capsys.readouterr()
    assert main([*FIT, str(table), "--inputs", "effort=60e3", "--set", "mass=50e3", "--json"]) == 0
    constant = json.loads(capsys.readouterr().out)["parameters"]
    assert constant["davis_a"]["value"] == found["davis_a"]  # a constant is the column that never changes


def test_what_is_not_identified_ends_with_one(table: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*FIT, str(table), "--from", "30", "--to", "36", "--json"]) == 1
    data = json.loads(capsys.readouterr().out)
    assert not data["parameters"]["davis_b"]["identified"]
    assert data["parameters"]["initial_speed"]["identified"]
    assert any("would do" in remark for remark in data["remarks"])
    assert main([*FIT, str(table), "--from", "30", "--to", "36", "--set", "resolution=50"]) == 0


@pytest.mark.compiler
def test_an_fmu_is_driven(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Wheels slip a little under effort, which is not in the model: intervals are wide enough for it."""
    fmu = build_fmu(Locomotive(), tmp_path, fmi_version=2)
    words = [*FIT, str(fmu), "--drive", "effort=60e3", "--signals", "speed", "--json"]
    assert main([*words, "--set", f"mass={90e3 + 225.0 / 0.575**2}"]) == 0
    found = json.loads(capsys.readouterr().out)["parameters"]
    for name, true in {"davis_a": 900.0, "davis_b": 32.0, "davis_c": 1.7}.items():
        assert found[name]["low"] < true < found[name]["high"]
    assert main(words) == 0  # without a mass the effort is not known
    assert "net_acceleration" in json.loads(capsys.readouterr().out)["parameters"]


@pytest.mark.compiler
def test_a_train_model_of_the_package_by_its_name(table: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Per unit mass, the train is the model of the running resistance with dry friction and a track."""
    fixed = {"traction_coefficient": 1.0, "internal_step": 0.05, "mass": 50e3}
    settings = [word for name, value in fixed.items() for word in ("--set", f"{name}={value}")]
    guesses = ["davis_a=2e4", "davis_b=200", "davis_c=-10", "train_speed=1"]
    words = ["calibrate", "longitudinal_train", str(table), "--inputs", "effort=force", "--parameters", *guesses]
    assert main([*words, "--signals", "speed", *settings, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["parameters"]
    for name, true in {"davis_a": 0.46 * 50e3, "davis_b": 5.7e-3 * 50e3, "davis_c": -12.0, "train_speed": 1.0}.items():
        assert found[name]["value"] == pytest.approx(true, rel=0.05)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--to", "3"], "No sample is above 5 m/s"),
        (["--from", "100"], "fewer than two samples in the part to use; there are 601 in all, from 0 to 60 s"),
        (["--inputs", "effort=60e3"], "needs the mass"),
        (["--inputs", "effort=forse", "--set", "mass=1"], "did you mean 'force'"),
        (["--inputs", "efort=force", "--set", "mass=1"], "did you mean 'effort'"),
        (["--signals", "speed=speet"], "did you mean 'speed'"),
        (["--set", "mas=1"], "did you mean 'mass'"),
        (["--set", "mass=-1"], "expected a number above 0"),
        (["--parameters", "davis_a"], "fits all of its own"),
        (["--drive", "effort=1"], "--drive belongs to an FMU"),
        (["--plot", "none/r.png"], "cannot be written"),
        (["--plot", "r.nothing"], "cannot be written"),
        (["--toml", "none/p.toml"], "cannot be written"),
    ],
)
def test_mistakes_are_said_in_a_line(
    words: list[str], message: str, table: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*FIT, str(table), *words]) == 2
    assert message in capsys.readouterr().err


def test_a_table_without_a_speed_and_an_fmu_without_an_input(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "a.csv").write_text("time,b,c\n0,1,2\n1,2,3\n")
    assert main([*FIT, str(tmp_path / "a.csv")]) == 2
    assert "The recording holds: b, c. Say which belong together: --signals" in capsys.readouterr().err
    assert main([*FIT, str(tmp_path / "x.fmu")]) == 2
    assert "say by which input and how hard" in capsys.readouterr().err


def test_a_table_without_rows_is_refused_in_words(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "head.csv"
    path.write_text("time [s],speed [m/s]\n")
    assert main([*FIT, str(path)]) == 2
    assert "fewer than two samples in the part to use; there are 0 in all" in capsys.readouterr().err


def test_the_former_command_leads_to_the_new_words(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(["identify", "davis", "run.csv", "--effort", "60e3", "--mass", "50e3"])
    assert end.value.code == 2
    assert "cosim calibrate running_resistance RECORDING" in capsys.readouterr().err
