"""Law: whatever command steps a component or asks it something, what its code raises reaches the user in its own words,
with component and time, an exit code that is not 0 and no traceback.
"""

from __future__ import annotations

import shutil
from pathlib import Path

import failing_models
import pytest
from failing_models import WORDS

from cosim import Scenario
from cosim.cli import main
from fmus.cli.commands import find_commands
from fmus.hosted import build_hosted_fmu

FILE = failing_models.__file__
ALONE = "t = 0.2 s"  # the last point before 0.29 s, at which the step that fails begins

# command: words behind it; a name in capitals is one of the files that `files` makes
STEPPING = {
    "run": "run BAD --no-report --out OUT",
    "rerun": "rerun RESULTS --set boiler.from_when=0.29",
    "sweep": "sweep BAD --vary step=0.1,0.05 --out OUT",
    "campaign": "campaign BAD --set campaign.method=zip --set campaign.vary.step=[0.1,0.05] --out OUT",
    "tune": "tune BAD --parameters boiler.gain=0.5:2 --cost rms(boiler.y) --iterations 1 --out OUT",
    "falsify": 'falsify BAD --vary boiler.gain=0.5..2 --set expect=[{{check="warnings"}}] --out OUT',
    "calibrate": "calibrate BAD RESULTS --parameters boiler.gain=1.5",
    "choose": "choose TRAIN --observers {file}:PlainSpeed",
    "baseline make": "baseline make BAD OUT",
    "baseline check": "baseline check BASELINE",
    "baseline update": "baseline update BASELINE",
}
ASKING = {
    "certify": "certify {file}:Evaluated",
    "linearise": "linearise {file}:Traced",
    "show": "show TRACED --trust",
    "export": "export TRACED OUT.ssp --trust",
}
# they step and ask nothing: they read results or what is declared
READING = {"compare", "report", "open", "new", "list", "info"}


@pytest.fixture
def files(tmp_path: Path) -> dict[str, Path]:
    """A scenario that fails and one that does not, with what was made of the latter before it began to fail."""

    def made(name: str, from_when: float, model: str = "Worn") -> Path:
        parameters = {"from_when": from_when} if model == "Worn" else {}
        boiler = {"model": f"{FILE}:{model}", "as": "block3", "parameters": parameters}
        s = Scenario(stop=0.6, step=0.1, title="Boiler", components={"boiler": boiler})
        return s.save(tmp_path / f"{name}.toml")

    files = {name: tmp_path / name.lower() for name in ("OUT", "RESULTS")}
    files |= {"BAD": made("bad", 0.29), "GOOD": made("good", 99.0), "TRACED": made("traced", 0.0, "Traced")}
    train = Scenario.load("freight_profile_d").set("stop", 1.0).set("expect", []).set("report", {})
    files |= {"TRAIN": train.save(tmp_path / "train.toml"), "BASELINE": tmp_path / "now.json", "NOW": made("now", 99.0)}
    assert main(["run", str(files["GOOD"]), "--no-report", "--quiet", "--out", str(files["RESULTS"])]) == 0
    assert main(["baseline", "make", str(files["NOW"]), str(files["BASELINE"]), "--quiet"]) == 0
    shutil.copy(files["BAD"], files["NOW"])
    return files


def reported(line: str, files: dict[str, Path], capsys: pytest.CaptureFixture[str], *more: str) -> str:
    capsys.readouterr()
    words = [str(files[w]) if w in files else w.format(file=FILE) for w in line.split()]
    words = [str(files["OUT"]) + w.removeprefix("OUT") if w.startswith("OUT") else w for w in words]
    assert main([*words, *more]) != 0
    shown = capsys.readouterr()
    assert "Traceback" not in shown.out + shown.err
    return shown.out + shown.err


def test_every_command_is_examined() -> None:
    names = {command.name for command in find_commands("cosim.cli")}
    assert names == READING | {name.split()[0] for name in STEPPING | ASKING}


@pytest.mark.parametrize("json", [False, True])
@pytest.mark.parametrize("what", STEPPING)
def test_what_a_step_raises(what: str, json: bool, files: dict[str, Path], capsys: pytest.CaptureFixture[str]) -> None:
    text = reported(STEPPING[what], files, capsys, *(["--json"] if json else []))
    assert WORDS in text
    assert "t = 0.3 s" in text if what == "choose" else ALONE in text
    assert ("PlainSpeed" if what == "choose" else "boiler") in text
    assert "smaller communication step" not in text


@pytest.mark.parametrize("what", ASKING)
def test_what_is_raised_where_a_model_is_asked(
    what: str, files: dict[str, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    text = reported(ASKING[what], files, capsys)
    assert WORDS in text
    assert "boiler" in text or FILE in text
    assert ("t = 0 s" in text) == (what == "linearise")


@pytest.fixture(scope="module")
def hosted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build_hosted_fmu(f"{FILE}:Worn", tmp_path_factory.mktemp("hosted"))


@pytest.mark.compiler
@pytest.mark.parametrize(
    "words",
    [
        "calibrate running_resistance HOSTED --signals speed=y --drive measured=1 --stop 1 --step 0.1",
        "calibrate HOSTED RESULTS --parameters gain=1.5 --signals y=boiler.y",
        "linearise HOSTED --at 0.5",
        "baseline make HOSTED OUT --stop 1 --step 0.1",
    ],
)
def test_what_an_fmu_says(words: str, hosted: Path, files: dict[str, Path], capsys: pytest.CaptureFixture[str]) -> None:
    text = reported(words, files | {"HOSTED": hosted}, capsys)
    assert WORDS in text
    assert "failing" in text
    assert "t = 0.2" in text
    assert ".. " not in text
    assert "Give other" not in text
