"""Typical mistakes of those who write scenarios and type commands: one line each, at once, and exit code 2."""

from __future__ import annotations

import errno
import json
import re
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from cosim.cli import main
from cosim.results import results_folder
from cosim.results.load_result import load_result

GOOD = """\
title = "Own train"
stop = 0.5
step = 0.1
connections = [
  "train.wheel_speed -> odometer.wheel_speed",
  "odometer.reading -> observer.odometer",
]

[components.train]
model = "longitudinal_train"
as = "block3"

[components.train.parameters]
effort = 0.1

[components.odometer]
model = "odometer"
as = "block3"

[components.observer]
observer = "odometer_reset"
as = "block3"

[balises]
layout = "spacing"
spacing = 20.0
track_end = 1000.0
position = "train.position"
speed = "train.speed"
"""

MISTAKES = {
    # numbers
    "decimal comma": ("step = 0.1", "step = 0,1", "line 3: step = 0,1 has a decimal comma; write a point: step = 0.1"),
    "comma in a table": (
        "[components.train.parameters]\neffort = 0.1",
        "parameters = {effort = 0,05}",
        "line 13: effort = 0,05 has a decimal comma; write a point: effort = 0.05",
    ),
    "comma in a longer table": (
        "[components.train.parameters]\neffort = 0.1",
        "parameters = {mass = 8e4, effort = -1,5, x = 2}",
        "line 13: effort = -1,5 has a decimal comma; write a point: effort = -1.5",
    ),
    "comma in quotes": (
        "step = 0.1",
        'step = "0,1"',
        "write a point in place of the comma: 0.1",
    ),
    "unit behind": ("step = 0.1", "step = 100 ms", "line 3: step = 100 ms: a number stands without its unit"),
    "unit in quotes": ("step = 0.1", 'step = "100 ms"', "step: expected a number without its unit, in SI units: 0.1"),
    "word for a number": ("step = 0.1", 'step = "small"', 'step: expected a number (got "small")'),
    "no number": ("step = 0.1", "step = nan", "step: expected a finite number"),
    "negative step": ("step = 0.1", "step = -0.1", "step must be positive, got -0.1 s"),
    "step that does not divide": ("step = 0.1", "step = 0.3", "use stop = 0.3 or 0.6"),
    "negative spacing": ("spacing = 20.0", "spacing = -20.0", "balises.spacing: expected more than 0 (got -20.0)"),
    "nothing behind =": ("step = 0.1", "step =", "line 3: step has no value behind ="),
    # truth values and texts
    "capital truth value": ("[balises]", "[master]\nlog_calls = True\n[balises]", "write log_calls = true"),
    "yes": ("[balises]", "[master]\nlog_calls = yes\n[balises]", "yes is no truth value; write log_calls = true"),
    "number for a truth value": (
        "[balises]",
        "[master]\nlog_calls = 7\n[balises]",
        "master.log_calls: expected true or",
    ),
    "no quotation marks": ('"odometer"', "odometer", 'a text stands in quotation marks: model = "odometer"'),
    "word processor": ('"odometer"', "“odometer”", "“ is a quotation mark of a word processor"),
    "windows path": ('model = "longitudinal_train"', 'fmu = "C:\\vendor\\x.fmu"', "'C:\\vendor\\x.fmu'"),
    "path read as escapes": ('model = "longitudinal_train"\nas = "block3"', 'fmu = "C:\\new.fmu"', "control character"),
    # TOML
    "comma missing in a list": ('wheel_speed",', 'wheel_speed"', "line 5: a comma is missing at its end"),
    "semicolon": ("stop = 0.5", "stop = 0.5;", "line 2: a semicolon at its end; write stop = 0.5"),
    "colon": ("stop = 0.5", "stop: 0.5", "line 2: a colon in place of =; write stop = 0.5"),
    "key twice": ("step = 0.1", "step = 0.1\nstep = 0.2", "line 4: step has a value in line 3 already"),
    "component twice": ("[balises]", "[components.train]\n[balises]", "the table [components.train] stands in line 9"),
    # tables and keys
    "wrong table": ("[balises]", "[balise]", "balise: unknown key; did you mean 'balises'?"),
    "wrong table of a component": ("[components.odometer]", "[component.odometer]", "did you mean 'components'?"),
    "key below a table": ('title = "Own train"\nstop = 0.5\n', "", None),
    "key left out": ("step = 0.1\n", "", "step: is missing"),
    "parameter beside the model": ("[components.train.parameters]\neffort", "mass", "in [components.train.parameters]"),
    "two origins": ('model = "odometer"', 'model = "odometer"\nfmu = "x.fmu"', "give exactly one of 'fmu'"),
    "unknown layout": ('"spacing"', '"spacings"', "did you mean 'spacing'?"),
    # names
    "unknown model": ("longitudinal_train", "longitudnal_train", "did you mean 'longitudinal_train'"),
    "plant as an observer": ('"odometer_reset"', '"odometer"', "'odometer' is no observer; write model = 'odometer'"),
    "unknown preset": ('model = "odometer"', 'model = "odometer"\npreset = "10hz"', "did you mean '10_hz'?"),
    "unknown parameter": ("effort = 0.1", "efort = 0.1", "no variable 'efort'; did you mean 'effort'?"),
    "unknown signal": ("train.wheel_speed", "train.wheelspeed", "no variable 'wheelspeed'; did you mean 'wheel_speed'"),
    "unknown component": ("train.wheel_speed", "trian.wheel_speed", "did you mean 'train'?"),
    "missing FMU": ('model = "longitudinal_train"\nas = "block3"', 'fmu = "vendr.fmu"', "vendor.fmu"),
    # connections
    "wrong arrow": ("speed -> odometer", "speed => odometer", "connections, line 1:"),
    "turned around": ("train.wheel_speed -> odometer.wheel_speed", "odometer.wheel_speed -> train.effort", "causality"),
    "two sources": ('"odometer.reading', '"train.speed -> observer.odometer",\n"odometer.reading', "has two sources"),
    "wrong unit": ("odometer.reading ->", "train.position ->", "units 'm' and 'm/s' do not fit"),
    "odometer without source": (
        '  "odometer.reading -> observer.odometer",\n',
        "",
        "Nothing is connected to observer.od",
    ),
}


@pytest.fixture
def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    with zipfile.ZipFile(tmp_path / "vendor.fmu", "w") as made:
        made.writestr("modelDescription.xml", "<a/>")
    return tmp_path


def response(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    """The one line that a mistake is answered with."""
    capsys.readouterr()
    try:
        code = main(words)
    except SystemExit as ended:
        code = int(str(ended.code))
    shown = capsys.readouterr()
    assert (code, shown.out) == (2, ""), shown
    lines = shown.err.splitlines()
    assert len(lines) == 1, lines
    assert "Traceback" not in lines[0]
    return lines[0]


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_in_a_scenario_is_one_line(mistake: str, in_folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before, after, expected = MISTAKES[mistake]
    assert before in GOOD
    text = GOOD.replace(before, after, 1)
    if expected is None:
        text, expected = f"{text}stop = 0.5\n", "balises.stop: unknown key; stop is a key of the whole scenario"
    (in_folder / "own.toml").write_text(text, encoding="utf-8")
    line = response(capsys, "run", "own.toml", "--no-report", "--quiet")
    assert line.startswith("cosim: ")
    assert "own.toml" in line
    assert expected in line


@pytest.mark.parametrize(
    "change", [str, lambda t: t.replace("\n", "\r\n"), lambda t: "\ufeff" + t, lambda t: t.replace(" = ", "\t=\t")]
)
def test_what_editors_leave_is_no_mistake(change: Callable[[str], str], in_folder: Path) -> None:
    (in_folder / "own.toml").write_text(change(GOOD), encoding="utf-8", newline="")
    assert main(["run", "own.toml", "--no-report", "--quiet"]) == 0


COMMANDS = {
    "run own.tml": "Scenario file own.tml does not exist; did you mean 'own.toml'?",
    "run wn.toml": "Scenario file wn.toml does not exist; did you mean 'own.toml'?",
    "run own": "No scenario 'own'; did you mean 'own_fmu', 'own.toml'?",
    "run freight_profil_d": "No scenario 'freight_profil_d'; did you mean 'freight_profile_d'",
    "run vendor.fmu": "vendor.fmu is an FMU and no scenario; 'cosim new vendor.fmu' writes one to start from.",
    "run folder": "folder is no results folder",
    "run empty.toml": "empty.toml holds no scenario; expected stop = 60.0, step = 0.01, and a table [components.NAME]",
    "run data.json": "it is JSON; a scenario is TOML",
    "run script.py": "script.py is no scenario, whose file ends in .toml or .ssp.",
    "run own.toml --workers two": "argument --workers: expected a whole number (got 'two')",
    "show own.ssp": "own.ssp does not exist; that folder has no .ssp.",
    "run own.toml --out own.toml": "Results cannot be written to",
    "run own.toml --out /proc/none": "Results cannot be written to /proc/none",
    "run own.toml --set step=0,01": "step: expected a number; write a point in place of the comma: 0.01",
    "run own.toml --set train.mass=90,5": "mass: expected a number; write a point in place of the comma: 90.5",
    "run own.toml --set train.mass=90t": "train.mass: expected a number without its unit, in kg: 90000 (got '90t')",
    "run own.toml --set train.mass=90,5t": "train.mass: expected a number without its unit, in kg: 90500 (got '90,5t')",
    "run own.toml --set train.mass=90km": "train.mass: expected a number without a unit, in kg (got '90km')",
    "run own.toml --set train.efort=1": "no variable 'efort'; did you mean 'effort'?",
    "run own.toml --set trian.effort=1": "no component 'trian'; did you mean 'train'?",
    "run own.toml --set train.effort": "expected NAME=VALUE",
    "run own.toml --sed 3": "no option --sed; did you mean --seed?",
    "show own.tml": "did you mean 'own.toml'?",
    "info vendr.fmu": "FMU vendr.fmu does not exist; did you mean 'vendor.fmu'?",
    "info own.toml": "own.toml is a scenario",
    "new vendr.fmu": "FMU vendr.fmu does not exist; did you mean 'vendor.fmu'?",
    "new own.fmu": "FMU own.fmu does not exist; in that folder there is: vendor.fmu.",
    "compare own.toml own.toml": "own.toml is a scenario, which 'cosim run' runs; expected a results folder",
    "report vendor.fmu": "vendor.fmu is an FMU; expected a results folder or a table.",
    "rerun own.toml": "own.toml is a file; expected a results folder",
    "certify odometer_rest": "did you mean 'odometer_reset'?",
    "list locomotve": "did you mean 'locomotive'?",
    "own.toml": "did you mean 'cosim run own.toml'?",
    "run own.toml --stop 3": "no option --stop; did you mean --set stop=VALUE?",
    "run own.toml --set observer=odometer_reset": "'observer' is a component; set one of its keys or parameters",
    "new own.toml": "own.toml is a scenario; expected an .fmu file.",
    "info folder": "folder is a folder; expected an .fmu file.",
    "certify vendor.fmu": "vendor.fmu is an FMU; expected the name of an observer, or file.py:Class.",
    "certify locomotive": "locomotive is a plant; expected the name of an observer, or file.py:Class.",
    "linearise own.toml": "own.toml is a scenario; expected an .fmu file, or a plant or observer by name.",
    "baseline make own.json own.toml": "own.json: expected what is run, an FMU or a scenario, and behind it FILE.json.",
    "baseline check own.toml": "own.toml is a scenario; expected the .json of a baseline.",
    "baseline check other.json": "There is no baseline other.json. That folder holds others; known: data.json.",
    "sweep own.toml --vary step=0.1 --workers 0": "argument --workers: must be at least 1 (got 0)",
    "sweep own.toml --vary step=0.1 --samples 0": "argument --samples: must be at least 1 (got 0)",
}


@pytest.mark.parametrize("line", COMMANDS)
def test_a_mistake_in_a_command_is_one_line(line: str, in_folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (in_folder / "own.toml").write_text(GOOD, encoding="utf-8")
    (in_folder / "empty.toml").write_text("\n", encoding="utf-8")
    (in_folder / "data.json").write_text(json.dumps({"stop": 1.0}), encoding="utf-8")
    (in_folder / "script.py").write_text("print(1)\n", encoding="utf-8")
    (in_folder / "folder").mkdir()
    assert COMMANDS[line] in response(capsys, *line.split())


def test_a_full_disk_is_one_line_and_what_was_computed_is_shown(
    in_folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device", "table.csv")

    (in_folder / "own.toml").write_text(GOOD, encoding="utf-8")
    monkeypatch.setattr("cosim.results.results_folder._write_all", full)
    assert main(["run", "own.toml", "--quiet", "--no-report"]) == 2
    shown = capsys.readouterr()
    assert "0.5 s simulated" in shown.out
    assert "No space left on device" in shown.err.splitlines()[-1]


def test_what_a_full_disk_does_not_take_stands_in_a_temporary_folder(
    in_folder: Path,
    tmp_path_factory: pytest.TempPathFactory,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    write = results_folder._write_all

    def full(result: Any, folder: Path, formats: Any) -> Any:
        if folder.is_relative_to(in_folder):
            raise OSError(errno.ENOSPC, "No space left on device", "table.csv")
        return write(result, folder, formats)

    (in_folder / "own.toml").write_text(GOOD, encoding="utf-8")
    monkeypatch.setattr(results_folder, "_write_all", full)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path_factory.mktemp("elsewhere")))
    assert main(["run", "own.toml", "--quiet", "--no-report"]) == 2
    words = capsys.readouterr().err.splitlines()[-1]
    place = re.search(r"What was computed stands in (\S+) instead\.", words)
    assert place is not None
    assert load_result(place[1]).time[-1] == 0.5
