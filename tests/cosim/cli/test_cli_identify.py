"""``cosim identify davis``: from tables and FMUs, what it prints and writes, exit codes, and mistakes in a line."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest

from cosim.cli import main
from fmu_observer.identification.acceleration_run import speeds_and_sensitivities
from fmus.build import build_fmu
from plant_models.railway.vehicle.locomotive import Locomotive

LOA = np.array([[1.2 - 0.46], [5.7e-3], [-2.4e-4], [1.0]])


@pytest.fixture
def table(tmp_path: Path) -> Path:
    time = np.linspace(0.0, 60.0, 601)
    speed = speeds_and_sensitivities(time, LOA)[0, 0] + 0.02 * np.random.default_rng(1).standard_normal(601)
    path = tmp_path / "run.csv"
    rows = np.c_[time, 3.6 * speed, np.full(601, 60e3)]
    np.savetxt(path, rows, delimiter=",", header="time [s],speed [km/h],force [N]", comments="")
    return path


def test_from_a_table_with_a_mass_picture_and_parameters(table: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = table.parent
    words = ["identify", "davis", str(table), "--effort", "force", "--mass", "50e3"]
    assert main([*words, "--plot", str(folder / "r.png"), "--toml", str(folder / "p.toml")]) == 0
    printed = capsys.readouterr().out
    assert "davis_a" in printed
    assert "95 % interval" in printed
    assert (folder / "r.png").read_bytes().startswith(b"\x89PNG")
    found = tomllib.loads((folder / "p.toml").read_text())["parameters"]
    assert found["mass"] == 50e3
    assert found["davis_a"] == pytest.approx(0.46 * 50e3, rel=0.02)


def test_what_is_not_identified_ends_with_one(table: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["identify", "davis", str(table), "--from", "30", "--to", "36", "--json"]) == 1
    data = json.loads(capsys.readouterr().out)
    assert not data["coefficients"]["davis_b"]["identified"]
    assert any("would do" in remark for remark in data["remarks"])


@pytest.mark.compiler
def test_an_fmu_is_driven(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Wheels slip a little under effort, which is not in the model: intervals are wide enough for it."""
    fmu = build_fmu(Locomotive(), tmp_path, fmi_version=2)
    words = ["identify", "davis", str(fmu), "--input", "effort", "--effort", "60e3", "--speed", "speed", "--json"]
    assert main([*words, "--mass", str(90e3 + 225.0 / 0.575**2)]) == 0
    found = json.loads(capsys.readouterr().out)["coefficients"]
    for name, true in {"davis_a": 900.0, "davis_b": 32.0, "davis_c": 1.7}.items():
        assert found[name]["low"] < true < found[name]["high"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--to", "3"], "No sample is above 5 m/s"),
        (["--from", "100"], "no sample between --from and --to"),
        (["--effort", "60e3"], "needs the mass"),
        (["--effort", "forse", "--mass", "1"], "did you mean 'force'"),
        (["--speed", "speet"], "did you mean 'speed'"),
        (["--input", "effort"], "--input belongs to an FMU"),
        (["--plot", "none/r.png"], "cannot be written"),
        (["--plot", "r.nothing"], "cannot be written"),
        (["--toml", "none/p.toml"], "cannot be written"),
    ],
)
def test_mistakes_are_told_in_a_line(
    words: list[str], message: str, table: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["identify", "davis", str(table), *words]) == 2
    assert message in capsys.readouterr().err


def test_a_table_without_a_speed_and_an_fmu_without_an_input(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "a.csv").write_text("time,b,c\n0,1,2\n1,2,3\n")
    assert main(["identify", "davis", str(tmp_path / "a.csv")]) == 2
    assert "Say --speed NAME; there are: b, c" in capsys.readouterr().err
    assert main(["identify", "davis", str(tmp_path / "x.fmu")]) == 2
    assert "say by which input and how hard" in capsys.readouterr().err


def test_a_table_without_rows_is_told_in_words(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "head.csv"
    path.write_text("time [s],speed [m/s]\n")
    assert main(["identify", "davis", str(path)]) == 2
    assert "has no rows" in capsys.readouterr().err
