"""Looking runs nothing: a command either runs what users made, or leaves Python files and libraries of FMUs alone; and
code that came with the results of somebody else is not run before somebody said so.
"""

from __future__ import annotations

import hashlib
import io
import json
import subprocess
import zipfile
from pathlib import Path

import pytest
from kept_runs import coast
from ssp_files import connector, package, ssd
from test_fmus.build import library_name

import cosim.cli
import fmus.cli
from cosim import Scenario
from cosim.cli import baseline_command, trust_question
from cosim.errors import UntrustedError
from fmus.cli.commands import find_commands
from fmus.toolchain.compile import find_compiler

MAINS = {"cosim": cosim.cli.main, "fmus": fmus.cli.main}
LOOKING = {
    "cosim certify": ("certify SCENARIO", "certify FOLDER", "certify GAINS", "certify FILTER"),
    "cosim compare": ("compare FOLDER FOLDER", "compare FOLDER FOLDER --html OUT.html"),
    "cosim export": ("export SCENARIO OUT.ssp", "export FOLDER OUT.ssp", "export FOLDER OUT.mat"),
    "cosim info": ("info FMU", "info SCENARIO", "info FOLDER", "info PACKAGE"),
    "cosim list": ("list --for SCENARIO", "list --for FMU", "list --for FOLDER", "list --for FILTER", "list PACKAGE"),
    "cosim open": ("open FOLDER --no-browser", "open FOLDER --no-browser --out OUT.html"),
    "cosim report": ("report FOLDER", "report FOLDER FOLDER --out OUT.html"),
    "cosim show": ("show SCENARIO", "show FOLDER", "show PACKAGE", "show FILTER", "show SCENARIO --picture OUT.svg"),
    "cosim baseline show": ("baseline show BASELINE",),
    "cosim baseline embed": ("baseline embed BASELINE FMU -o OUT.fmu",),
    "cosim baseline extract": ("baseline extract FMU OUT.json",),
    "fmus info": ("info FMU",),
    "fmus list": ("list",),
}
"""Lines of all commands that look, by program and name; words in capitals are files of those below."""
RUNNING = {
    *(
        f"cosim {name}"
        for name in ("baseline", "calibrate", "campaign", "choose", "linearise", "new", "rerun", "run", "sweep")
    ),
    *("cosim falsify", "cosim tune", "fmus build", "fmus check", "fmus compile"),
}
FROM_FOLDERS = (
    "run FOLDER --out OUT --no-report --quiet",
    "rerun FOLDER --quiet",
    "sweep FOLDER --vary driver.gain=1,2 --out OUT --quiet",
    "calibrate FOLDER FOLDER --parameters driver.gain=2 --signals train.speed --noise train.speed=0.01",
)
"""Commands that run what a results folder was made from."""

CODE = """
import os, pathlib
pathlib.Path(os.environ["MARK"]).write_text("python")
class Drive:
    "A driver. {number}"
    inputs = {{"odometer": "m/s"}}
    outputs = {{"effort": "N"}}
    def __init__(self, gain=2.0):
        self.gain = gain
    def step(self, t, inputs, dt):
        return {{"effort": self.gain * (10.0 - inputs.odometer)}}
"""
LIBRARY = """
#include <stdio.h>
#include <stdlib.h>
__attribute__((constructor)) static void leave_mark(void) {
    FILE *file = fopen(getenv("MARK"), "w");
    if (file) { fputs("library", file); fclose(file); }
}
"""


def marking_fmu(folder: Path) -> Path:
    """An FMU whose library leaves a mark as soon as it is loaded."""
    fmu, source, library = coast(folder), folder / "mark.c", folder / library_name("coast")
    source.write_text(LIBRARY)
    subprocess.run([*find_compiler().command, "-shared", "-fPIC", source, "-o", library], check=True)
    with zipfile.ZipFile(fmu) as archive:
        content = {name: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(fmu, "w") as archive:
        for name, data in content.items():
            archive.writestr(name, library.read_bytes() if name.endswith(library.name) else data)
    return fmu


SCENARIO = """
stop = 0.2
step = 0.1
connections = ["driver.effort -> train.effort", "train.wheel_speed -> driver.odometer"]
[components.train]
model = "locomotive"
as = "block3"
[components.driver]
model = "drive.py:Drive"
parameters = { gain = 3.0 }
"""
FILTER = """
stop = 0.2
step = 0.1
[components.train]
fmu = "coast.fmu"
[components.filter]
fmu = "coast.fmu"
[components.filter.filter]
kind = "ukf"
measurements = { y1 = 0.05 }
sample_period = 0.1
process_noise = { "x[1]" = 0.01 }
start_deviation = { "x[1]" = 1.0 }
"""
GAINS = 'observer = "drive.py:Drive"\n'


@pytest.fixture
def mark(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """What code leaves when it runs."""
    monkeypatch.setenv("MARK", str(tmp_path / "MARK"))
    return tmp_path / "MARK"


@pytest.fixture
def files(tmp_path: Path, mark: Path) -> dict[str, Path]:
    """A scenario, a results folder, a package, a baseline and an FMU with code in them that was never run here."""
    code, results = tmp_path / "drive.py", tmp_path / "results"
    for name, text in (("scenario", SCENARIO), ("filter", FILTER), ("gains", GAINS)):
        (tmp_path / f"{name}.toml").write_text(text)
    code.write_text(CODE.format(number=f"{tmp_path} first"))
    Scenario.load(tmp_path / "scenario.toml").run(warn=lambda _text: None).write(results, report=False)
    assert mark.read_text() == "python"
    made = ["baseline", "make", str(coast(tmp_path)), str(tmp_path / "baseline.json"), "--stop", "0.2", "--step", "0.1"]
    assert cosim.cli.main([*made, "--quiet"]) == 0
    of_others(results, f"{tmp_path} second")
    code.write_text(CODE.format(number=f"{tmp_path} third"))
    mark.unlink()
    fmu = marking_fmu(tmp_path)
    structure = ssd(component())
    packed = package(tmp_path / "package.ssp", {"SystemStructure.ssd": structure, "resources/coast.fmu": fmu})
    found = {path.stem.upper(): path for path in tmp_path.glob("*.toml")}
    return found | {
        "OUT": tmp_path / "out",
        "FMU": fmu,
        "FOLDER": results,
        "PACKAGE": packed,
        "BASELINE": tmp_path / "baseline.json",
    }


def of_others(results: Path, number: str) -> Path:
    """The Python file of results, with another content of which the folder says that it is the right one."""
    manifest = results / "made_from" / "manifest.json"
    data = json.loads(manifest.read_text())
    part = next(p for f in data["files"] for p in f["parts"] if p["copy"].endswith(".py"))
    file: Path = results / "made_from" / part["copy"]
    file.write_text(CODE.format(number=number))
    part["sha256"] = hashlib.sha256(file.read_bytes()).hexdigest()
    manifest.write_text(json.dumps(data))
    return file


def run(program: str, line: str, files: dict[str, Path], *more: str) -> int:
    """The exit code of a line."""
    words = [str(files.get(word, word)) for word in line.split()]
    words = [f"{files['OUT']}{word[3:]}" if word.startswith("OUT.") else word for word in words]
    return MAINS[program]([*words, *more])


def component(annotation: str = "") -> str:
    """A component of an SSP."""
    port = f"<ssd:Connectors>{connector('y1', 'output')}</ssd:Connectors>"
    element = f'<ssd:Component name="train" source="resources/coast.fmu">{port}{annotation}</ssd:Component>'
    return f"<ssd:Elements>{element}</ssd:Elements>"


def test_every_command_looks_or_runs() -> None:
    """A new command says which, and is examined here where it looks."""
    known = {f"{name} {c.name}": c.looks for name in MAINS for c in find_commands(f"{name}.cli")}
    assert {name for name, looks in known.items() if not looks} == RUNNING
    actions = [action for action in baseline_command.ARGUMENTS[0].actions if action.looks]
    looking = {name for name, looks in known.items() if looks} | {f"cosim baseline {a.name}" for a in actions}
    assert looking == set(LOOKING)


@pytest.mark.compiler
@pytest.mark.parametrize(
    ("program", "line"), [(name.split()[0], line) for name, lines in LOOKING.items() for line in lines]
)
def test_a_command_that_looks_runs_nothing(
    program: str, line: str, files: dict[str, Path], mark: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(program, line, files) in (0, 1, 2)
    assert not mark.exists()
    assert "Traceback" not in capsys.readouterr().err


@pytest.mark.compiler
def test_what_is_shown_of_code_that_is_not_run(files: dict[str, Path], capsys: pytest.CaptureFixture[str]) -> None:
    """The law above would hold of commands that refuse everything."""
    assert run("cosim", "show SCENARIO --json", files) == 0
    parts = {part["name"]: part for part in json.loads(capsys.readouterr().out)["parts"]}
    driver = parts["driver"]
    assert (driver["kind"], driver["source"]) == ("code, not run", "drive.py:Drive")
    ports = [(port["name"], port["unit"]) for port in driver["inputs"] + driver["outputs"]]
    assert ports == [("odometer", "m/s"), ("effort", "N")]
    assert run("cosim", "list --for SCENARIO", files) == 0
    assert "effort, odometer" in capsys.readouterr().out


@pytest.mark.compiler
@pytest.mark.parametrize(
    ("program", "line", "left"),
    [
        ("cosim", "run SCENARIO --out OUT --no-report --quiet", "python"),
        ("cosim", "show SCENARIO --trust", "python"),
        ("cosim", "list --for SCENARIO --trust", "python"),
        ("cosim", "info {file}:Drive", "python"),
        ("cosim", "run FILTER --out OUT --no-report --quiet", "library"),
        ("fmus", "check FMU", "library"),
    ],
)
def test_the_marks_are_left_where_code_runs(
    program: str, line: str, left: str, files: dict[str, Path], mark: Path
) -> None:
    """So a mark that is missing means something."""
    run(program, line.format(file=files["SCENARIO"].with_name("drive.py")), files)
    assert mark.read_text() == left


def test_results_of_others_run_when_they_are_trusted(
    tmp_path: Path, mark: Path, files: dict[str, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    for number, line in enumerate(FROM_FOLDERS):
        strange = of_others(files["FOLDER"], f"{tmp_path} {line}")
        (beside := strange.with_name("hidden.cpython-311.so")).write_bytes(f"{tmp_path} {line}".encode())
        command = line.replace("OUT", str(tmp_path / f"out{number}"))
        assert run("cosim", command, files) == 2, line
        said = capsys.readouterr().err
        assert all(text in said for text in (str(strange), str(beside), "--trust")), said
        assert not mark.exists()
        run("cosim", command, files, "--trust")
        mark.unlink()
        strange.touch()
        run("cosim", command.replace(f"out{number}", f"again{number}"), files)
        assert "never run here" not in capsys.readouterr().err
        beside.unlink()
        mark.unlink(missing_ok=True)


@pytest.mark.parametrize("answer", ["y", "n", ""])
def test_the_question_on_a_terminal(
    answer: str, files: dict[str, Path], mark: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(trust_question, "somebody_answers", lambda: True)
    monkeypatch.setattr("sys.stdin", io.StringIO(f"{answer}\n"))
    assert run("cosim", "rerun FOLDER --quiet", files) == (0 if answer == "y" else 2)
    assert mark.exists() == (answer == "y")
    assert "This code was never run here:" in capsys.readouterr().err


def test_scripts_ask_by_an_error_that_names_the_files(files: dict[str, Path], mark: Path) -> None:
    with pytest.raises(UntrustedError, match=r"drive\.py") as refused:
        Scenario.load(files["FOLDER"])
    assert [path.name for path in refused.value.files] == ["drive.py"]
    assert Scenario.load(files["SCENARIO"]).structure().part("driver").kind == "code, not run"
    assert not mark.exists()
    assert Scenario.load(files["SCENARIO"]).structure(trust=True).part("driver").kind == "block"
    assert mark.exists()


def test_a_package_that_names_code_is_run_without_it(files: dict[str, Path], mark: Path, tmp_path: Path) -> None:
    """No package of ours does: the FMU of the component is used, and the run says so."""
    extras = json.dumps({"model": f"{files['SCENARIO'].with_name('drive.py')}:Drive"})
    annotation = (
        '<ssd:Annotations><ssc:Annotation type="fmu-observer.scenario">'
        f'<extras xmlns="urn:fmu-observer:scenario:1">{extras}</extras></ssc:Annotation></ssd:Annotations>'
    )
    structure = ssd(component(annotation))
    members = {"SystemStructure.ssd": structure, "resources/coast.fmu": files["FMU"]}
    loaded = Scenario.load(package(tmp_path / "odd.ssp", members))
    assert loaded.table().components["train"].model is None
    assert any("drive.py:Drive" in text for text in loaded._warnings)
    assert not mark.exists()
