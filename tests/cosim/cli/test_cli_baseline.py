"""``cosim baseline``: make, check, show, update, with exit codes and JSON; embed and extract are tested with the
references.
"""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

import fmus
import plant_models
from cosim.cli import main

pytestmark = pytest.mark.usefixtures("_folder")

SCENARIO = """
stop = 0.2
step = 0.01
[components.loco]
model = "locomotive"
as = "block3"
parameters = {train_speed = MASS}
"""


@pytest.fixture
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write("10.0")


def write(speed: str) -> None:
    Path("run.toml").write_text(SCENARIO.replace("MASS", speed), encoding="utf-8")


def reported(capsys: pytest.CaptureFixture[str]) -> Any:
    return json.loads(capsys.readouterr().out)


def test_a_baseline_from_making_to_accepting(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["baseline", "make", "run.toml", "kept/run.json", "--set", "loco.mass=81e3", "--quiet"]) == 0
    assert "kept/run.json: new, 9 signals, 21 rows." in capsys.readouterr().out
    assert main(["baseline", "check", "kept/run.json", "--quiet"]) == 0
    capsys.readouterr()
    assert main(["baseline", "show", "kept/run.json"]) == 0
    shown = capsys.readouterr().out
    assert "loco: model locomotive" in shown
    assert "mass = 81000.0" in shown
    write("10.1")
    assert main(["baseline", "check", "kept/run.json", "--json"]) == 1
    data = reported(capsys)
    assert data["equal"] is False
    assert {s["name"] for s in data["signals"] if s["status"] == "differs"} >= {"loco.speed", "loco.position"}
    # whatever differs
    assert main(["baseline", "check", "kept/run.json", "--rtol", "1", "--atol", "1e6", "--json"]) == 0
    capsys.readouterr()
    assert main(["baseline", "update", "kept/run.json", "--json"]) == 0
    assert reported(capsys)["change"] == "changed"
    assert main(["baseline", "check", "kept/run.json", "--quiet"]) == 0


def test_a_stated_result_is_checked_without_a_run(capsys: pytest.CaptureFixture[str]) -> None:
    main(["baseline", "make", "run.toml", "run.json", "--quiet"])
    for name, speed in (("same", "10.0"), ("other", "10.2")):
        assert (
            main(["run", "run.toml", "--set", f"loco.train_speed={speed}", "--out", name, "--no-report", "--quiet"])
            == 0
        )
    Path("run.toml").unlink()
    assert main(["baseline", "check", "run.json", "--against", "same"]) == 0
    capsys.readouterr()
    assert main(["baseline", "check", "run.json", "--against", "other", "--plots", "drawn"]) == 1
    assert "loco.speed" in capsys.readouterr().out
    assert list(Path("drawn").rglob("*.png"))
    assert main(["baseline", "make", "same", "from_folder.json"]) == 0
    assert main(["baseline", "check", "from_folder.json", "--against", "same"]) == 0
    assert main(["baseline", "check", "from_folder.json"]) == 2
    assert "--against" in capsys.readouterr().err


@pytest.mark.compiler
def test_a_new_delivery_of_an_fmu(capsys: pytest.CaptureFixture[str]) -> None:
    shutil.copy(fmus.cached_fmu(plant_models.Locomotive(), 3), "vendor.fmu")
    make = ["baseline", "make", "vendor.fmu", "kept/run.json", "--stop", "1", "--step", "0.01", "--quiet"]
    assert main([*make, "--set", "effort=1e5", "--set", "mass=75e3"]) == 0
    run = json.loads(Path("kept/run.json").read_text(encoding="utf-8"))["run"]
    assert (run["inputs"], run["parameters"]) == ({"effort": 1e5}, {"mass": 75e3})
    shutil.move("vendor.fmu", "delivery_2.fmu")
    assert main(["baseline", "check", "kept/run.json"]) == 2
    assert main(["baseline", "check", "kept/run.json", "--against", "delivery_2.fmu"]) == 0
    assert main(["baseline", "embed", "kept/run.json", "delivery_2.fmu", "-o", "with.fmu"]) == 0
    assert main(["baseline", "check", "with.fmu", "--quiet"]) == 0
    assert main(["baseline", "extract", "with.fmu", "out.json"]) == 0
    assert main(["baseline", "check", "out.json", "--json"]) == 0
    assert "unreadable" not in capsys.readouterr().err
    shutil.copy(fmus.cached_fmu(plant_models.PLANTS["odometer"](), 3), "other.fmu")
    assert main(["baseline", "embed", "kept/run.json", "other.fmu", "-o", "wrong.fmu"]) == 2
    assert "'odometer'" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["check", "absent.json"], "There is no baseline absent.json"),
        (["make", "absent.fmu", "a.json", "--stop", "1"], "absent.fmu does not exist"),
        (["make", "absent.toml", "a.json"], "absent.toml does not exist"),
        (["make", "run.toml", "a.json", "--inputs", "in.csv"], "a scenario takes no inputs"),
        (["make", "run.toml", "a.json", "--signals", "loco.sped"], "did you mean 'loco.speed'"),
        (["make", "run.toml", "a.json", "--rtol", "-1"], "expected a number that is zero or positive"),
    ],
)
def test_mistakes_are_reported_in_words(arguments: list[str], says: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["baseline", *arguments]) == 2
    captured = capsys.readouterr()
    assert says in captured.err
    assert "Traceback" not in captured.err
    assert not Path("a.json").exists()


def test_a_baseline_is_not_replaced_by_mistake(capsys: pytest.CaptureFixture[str]) -> None:
    make = ["baseline", "make", "run.toml", "run.json", "--quiet", "--set"]
    assert main([*make, "loco.mass=81e3"]) == 0
    before = Path("run.csv").read_bytes()
    assert main([*make, "loco.mass=90e3"]) == 2
    assert "cosim baseline update" in capsys.readouterr().err
    assert Path("run.csv").read_bytes() == before
    assert main([*make, "loco.mass=90e3", "--force"]) == 0
    assert Path("run.csv").read_bytes() != before
