"""Units of an FMU alone that only its owner knows go with its baseline, into another FMU, and out of it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from test_fmus.sealed_trains import GERMAN, declaring

import fmus
from cosim import Scenario
from cosim.baselines import read_baseline
from cosim.baselines.call import Call
from cosim.cli import main
from cosim.errors import CosimError

pytestmark = pytest.mark.compiler

UNITS = {"Fsoll": (-1, "kN"), "vIst": (1, "km/h"), "sIst": (1, "m"), "m_ges": (1, "t")}
STATED = {"Fsoll": {"unit": "kN", "sign": -1}, "vIst": "km/h", "sIst": "m", "m_ges": "t"}
RUN = ["--stop", "10", "--step", "0.5", "--set", "Fsoll=60", "--set", "m_ges=80"]
LINES = ["--unit", "Fsoll=effort,-kN", "--unit", "vIst=km/h", "--unit", "sIst=m", "--unit", "m_ges=t"]


@pytest.fixture(scope="module")
def sealed() -> Path:
    return fmus.cached_fmu(GERMAN, fmi_version=2)


def test_an_fmu_alone_with_stated_units_is_one_that_declares_them(sealed: Path, tmp_path: Path) -> None:
    inputs, times = {"Fsoll": 60.0}, {"stop": 10.0, "step": 0.5}
    stated = Scenario.fmu(sealed, inputs=inputs, units=STATED, **times).run()
    declared = Scenario.fmu(declaring(GERMAN, UNITS, tmp_path / "declares.fmu"), inputs=inputs, **times).run()
    plain = Scenario.fmu(sealed, inputs=inputs, **times).run()
    assert stated.result.table.tobytes() == declared.result.table.tobytes()
    np.testing.assert_allclose(3.6 * stated["fmu.vIst"], plain["fmu.vIst"], rtol=1e-15)
    assert stated.result.info("fmu.vIst").shown.name == "km/h"
    with pytest.raises(CosimError, match="'vIst'"):
        Scenario.fmu(sealed, units={"vist": "km/h"}, **times).run()


def test_a_baseline_keeps_what_was_stated(sealed: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "train.json"
    assert main(["baseline", "make", str(sealed), str(file), *RUN, *LINES]) == 0
    baseline = read_baseline(file)
    plain = {"vIst": {"unit": "km/h"}, "sIst": {"unit": "m"}, "m_ges": {"unit": "t"}}
    assert baseline.header.recipe.units == plain | {"Fsoll": {"unit": "kN", "sign": -1, "meaning": "effort"}}
    speed = next(signal for signal in baseline.header.signals if signal.name == "fmu.vIst")
    assert (speed.unit, speed.shown.name) == ("m/s", "km/h")
    assert main(["baseline", "check", str(file)]) == 0
    capsys.readouterr()
    assert main(["baseline", "check", str(file), "--against", str(_slower(sealed, file, tmp_path))]) == 1
    assert "km/h too low" in capsys.readouterr().out


@pytest.mark.parametrize("command", ["info", "linearise"])
def test_a_look_at_an_fmu_alone_names_what_is_stated(
    command: str, sealed: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    declares = declaring(GERMAN, UNITS, tmp_path / "declares.fmu")
    said = []
    for file, lines in ((sealed, []), (sealed, LINES), (declares, [])):
        assert main([command, str(file), *lines, "--json"]) == 0
        data = json.loads(capsys.readouterr().out)
        units = data["units"] if "units" in data else {v["name"]: v["unit"] for v in data["variables"]}
        said.append([units[name] for name in ("vIst", "sIst")])
    assert said == [[said[0][0]] * 2, ["km/h", "m"], ["km/h", "m"]]
    assert said[0][0] in (None, "1")
    assert main([command, str(sealed), "--unit", "vist=km/h"]) == 2
    assert "'vIst'" in capsys.readouterr().err


def _slower(sealed: Path, file: Path, folder: Path) -> Path:
    """A run of another mass, with units of its own."""
    recipe = read_baseline(file).header.recipe
    Scenario.fmu(
        sealed, stop=10.0, step=0.5, inputs=recipe.inputs, parameters={"m_ges": 90.0}, units=recipe.units
    ).run().write(folder / "slower", report=False)
    return folder / "slower"


def test_a_reference_in_an_fmu_holds_its_numbers_and_what_they_are(sealed: Path, tmp_path: Path) -> None:
    file, copy = tmp_path / "train.json", tmp_path / "with.fmu"
    assert main(["baseline", "make", str(sealed), str(file), *RUN, *LINES]) == 0
    assert main(["baseline", "embed", str(file), str(sealed), "-o", str(copy)]) == 0
    assert main(["baseline", "check", str(copy)]) == 0
    back = tmp_path / "back.json"
    assert main(["baseline", "extract", str(copy), str(back)]) == 0
    one, two = read_baseline(file), read_baseline(back)
    assert two.header.recipe.units == one.header.recipe.units
    np.testing.assert_allclose(two.result["fmu.vIst"], one.result["fmu.vIst"], rtol=1e-15)
    assert main(["baseline", "check", str(back)]) == 0


def test_a_regression_test_states_units(sealed: Path, tmp_path: Path) -> None:
    call = Call.run(sealed, tmp_path, tmp_path / "a.json", stop=10.0, step=0.5, inputs={"Fsoll": 60.0}, units=STATED)
    assert json.loads(call.update().texts["header"])["run"]["units"] == STATED
    assert call.subject.result["fmu.vIst"][-1] == pytest.approx(call.subject.result["fmu.sIst"][-1] * 0.2, rel=0.02)


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        (["--unit", "vIst"], "--unit 'vIst': expected NAME=UNIT"),
        (["--unit", "vist=km/h"], "'vIst'"),
        (["--unit", "vIst=furlong"], "furlong"),
    ],
)
def test_what_cannot_be_meant_is_refused(
    lines: list[str], words: str, sealed: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["baseline", "make", str(sealed), str(tmp_path / "a.json"), *RUN, *lines]) == 2
    assert words in capsys.readouterr().err
    assert main(["baseline", "make", "first_run", str(tmp_path / "a.json"), "--unit", "vIst=km/h"]) == 2
    assert "[components.NAME.units]" in capsys.readouterr().err
