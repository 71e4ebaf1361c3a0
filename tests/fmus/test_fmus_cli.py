"""The command line: exit codes 0, 1, 2, the nearest name on a mistake, and no traceback."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import fmpy
import pytest

import plant_models
from fmu_observer import OBSERVERS
from fmus import RECIPES, UnknownRecipeError, cached_fmu, recipe
from fmus.cli import main
from plant_models import PLANTS

Output = pytest.CaptureFixture[str]


def test_list_shows_every_model(capsys: Output) -> None:
    assert main(["list"]) == 0
    shown = capsys.readouterr().out
    assert all(name in shown for name in RECIPES)
    assert "locomotive" in shown
    rows = shown.splitlines()
    assert sorted(row.split()[0] for row in rows if row[:1].isalpha()) == sorted(RECIPES)
    assert rows[0].startswith("# What rolls")
    assert "gains = None" not in shown  # no word on the command line can set it


def test_a_system_of_ones_own_is_listed_last(capsys: Output, monkeypatch: pytest.MonkeyPatch) -> None:
    own = type("Own", (RECIPES["odometer"],), {"name": "own_odometer"})
    monkeypatch.setitem(plant_models.PLANTS, "own_odometer", own)
    assert main(["list"]) == 0
    assert capsys.readouterr().out.split("# ")[-1].startswith("Registered by this program\nown_odometer")


@pytest.mark.compiler
def test_build_and_info(tmp_path: Path, capsys: Output) -> None:
    assert main(["build", "odometer", "--fmi", "2", "-o", str(tmp_path)]) == 0
    said = capsys.readouterr()
    built = Path(said.out.strip())
    assert built == tmp_path / "odometer.fmu"
    assert f"odometer: FMI 2.0, {built.stat().st_size / 1000:.0f} kB, {fmpy.platform}" in said.err
    assert main(["info", str(built)]) == 0
    shown = capsys.readouterr().out
    assert re.search("FMI version +2.0\ninterfaces +co-simulation", shown)
    assert re.search("wheel_speed +=", shown)


@pytest.mark.compiler
def test_build_several_for_both_versions(tmp_path: Path, capsys: Output) -> None:
    assert main(["build", "odometer", "slip_indicator", "--fmi", "both", "-o", str(tmp_path)]) == 0
    built = [Path(line) for line in capsys.readouterr().out.splitlines()]
    assert built == [tmp_path / f"fmi{v}" / f"{name}.fmu" for v in (2, 3) for name in ("odometer", "slip_indicator")]
    versions = [fmpy.read_model_description(str(path)).fmiVersion for path in built]
    assert versions == ["2.0", "2.0", "3.0", "3.0"]


@pytest.mark.compiler
def test_build_all(tmp_path: Path, capsys: Output, monkeypatch: pytest.MonkeyPatch) -> None:
    for registry, name in ((PLANTS, "odometer"), (OBSERVERS, "slip_indicator")):  # all of them would take long
        monkeypatch.setattr(registry, "_members", {name: registry.members[name]})
    assert main(["build", "--all", "-o", str(tmp_path)]) == 0
    assert (
        {Path(line).stem for line in capsys.readouterr().out.splitlines()}
        == set(RECIPES)
        == {p.stem for p in tmp_path.iterdir()}
    )


@pytest.mark.compiler
def test_build_with_option(tmp_path: Path, capsys: Output) -> None:
    arguments = [
        "build",
        "locomotive",
        "--option",
        "adhesion=polach",
        "--option",
        "zone_count=1",
        "-o",
        str(tmp_path / "wet.fmu"),
    ]
    assert main(arguments) == 0
    assert main(["info", capsys.readouterr().out.strip()]) == 0
    shown = capsys.readouterr().out
    assert "zone_from[1]" in shown
    assert "zone_from[2]" not in shown


@pytest.mark.compiler
def test_build_with_preset(tmp_path: Path, capsys: Output) -> None:
    assert main(["build", "locomotive", "--preset", "chapter_3_four_axles", "-o", str(tmp_path)]) == 0
    assert main(["info", capsys.readouterr().out.strip()]) == 0
    assert re.search("n_axles += 4.0 ", capsys.readouterr().out)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["build", "locomotiv"], "did you mean 'locomotive'?"),
        (["build", "locomotive", "--preset", "nonsense"], "unknown preset 'nonsense'"),
        (["build", "locomotive", "--option", "adhesoin=polach"], "did you mean 'adhesion'?"),
        (["build", "locomotive", "--option", "adhesion=glue"], "one of burckhardt, polach"),
        (["build", "locomotive", "--option", "zone_count=900"], "1 to 64"),
        (["build", "locomotive", "--option", "adhesion"], "write it as name=value"),
        (["info", "no_such.fmu"], "does not exist"),
    ],
)
def test_mistakes_end_with_two_and_advice(arguments: list[str], words: str, capsys: Output) -> None:
    assert main(arguments) == 2
    said = capsys.readouterr().err
    assert words in said
    assert "Traceback" not in said


@pytest.mark.parametrize("arguments", [["bake", "locomotive"], ["build", "locomotive", "--fmi", "1"]])
def test_wrong_usage_ends_with_two(arguments: list[str], capsys: Output) -> None:
    with pytest.raises(SystemExit) as stopped:
        main(arguments)
    assert stopped.value.code == 2
    assert "--help')" in capsys.readouterr().err


@pytest.mark.compiler
def test_info_lists_capabilities_of_each_interface_and_items_by_name(capsys: Output) -> None:
    common = "canHandleVariableCommunicationStepSize, "
    for version, tail in (
        (2, "canGetAndSetFMUstate, canSerializeFMUstate, providesDirectionalDerivative"),
        (3, "canGetAndSetFMUState, canSerializeFMUState, "),
    ):
        assert main(["info", str(cached_fmu(recipe("takagi_sugeno_cdo"), version))]) == 0
        shown = capsys.readouterr().out
        assert re.search(f"capabilities in co-simulation +{common}{tail}", shown)
        assert re.search(r"late_policy += replay .*\(replay, reject, late\)", shown)
    lines = [line for line in shown.splitlines() if line.startswith("capabilities")]
    assert [line[: len("capabilities in model exchange")].strip() for line in lines] == [
        "capabilities in co-simulation",
        "capabilities in model exchange",
    ]
    assert all(line.endswith("providesDirectionalDerivatives") for line in lines)
    assert main(["info", str(cached_fmu(recipe("odometer"), 3))]) == 0
    assert "mightReturnEarlyFromDoStep, providesDirectionalDerivatives" in capsys.readouterr().out


@pytest.mark.compiler
@pytest.mark.skipif(sys.platform == "win32", reason="pipes of POSIX")
@pytest.mark.parametrize("arguments", [["list"], ["info", "FMU"]])
def test_a_reader_that_goes_away_is_no_failure(arguments: list[str]) -> None:
    """What is written into a pipe without a reader; ``head`` ends before the output does."""
    fmu = str(cached_fmu(recipe("odometer")))
    reader, writer = os.pipe()
    os.close(reader)
    command = [sys.executable, "-m", "fmus.cli", *(fmu if word == "FMU" else word for word in arguments)]
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[2])}
    with os.fdopen(writer) as stream:
        done = subprocess.run(command, stdout=stream, stderr=subprocess.PIPE, text=True, check=False, env=environment)
    assert (done.returncode, done.stderr) == (141, "")


def test_info_on_something_else(tmp_path: Path, capsys: Output) -> None:
    file = tmp_path / "text.fmu"
    file.write_text("no FMU")
    assert main(["info", str(file)]) == 2
    assert "cannot be read as an FMU" in capsys.readouterr().err


@pytest.mark.compiler
def test_info_reports_problems_with_one(tmp_path: Path, capsys: Output) -> None:
    with zipfile.ZipFile(cached_fmu(recipe("odometer"))) as archive:
        text = archive.read("modelDescription.xml").decode()
    broken = tmp_path / "broken.fmu"
    with zipfile.ZipFile(broken, "w") as archive:
        archive.writestr("modelDescription.xml", text.replace('name="reading"', 'name="sample_period"', 1))
    assert main(["info", str(broken)]) == 1
    assert "problem: " in capsys.readouterr().out


def test_recipe_by_name() -> None:
    assert recipe("locomotive", adhesion="polach").name == "locomotive"
    with pytest.raises(UnknownRecipeError, match="no option 'mass'"):
        recipe("locomotive", mass=3.0)
    assert len(RECIPES) == len(list(RECIPES)) == len(set(RECIPES))
