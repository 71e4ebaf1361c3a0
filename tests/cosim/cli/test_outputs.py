"""Laws of all commands: with ``--json`` one JSON value and nothing else, which holds what the text holds; no text wider
than the terminal; and what the help says of them.
"""

from __future__ import annotations

import argparse
import io
import json
import logging
import os
import re
import shlex
import shutil
import sys
import warnings
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from test_fmus.build import linear_fmu

import cosim.cli
import fmus.cli
from cosim import Scenario
from fmus.cli.commands import find_commands
from fmus.cli.output import Output
from fmus.tables.table import Table

# Words behind the name of the program. A name in capitals is a file that `files` makes. OUT is what the line writes:
# a name of its own for each line, since they run in any order.
LINES = {
    "cosim": {
        "baseline make": "baseline make TRAIN OUT.json --quiet",
        "baseline check": "baseline check BASE.json --quiet --verbose --plots OUT",
        "baseline show": "baseline show BASE.json",
        "baseline update": "baseline update BASE.json --quiet",
        "baseline embed": "baseline embed FMUBASE.json LAG.fmu -o OUT.fmu",
        "baseline extract": "baseline extract HOLDS.fmu OUT.json",
        "calibrate": "calibrate running_resistance RESULTS --signals speed=locomotive.speed --set minimum_speed=0.1",
        "campaign": "campaign MANY.toml --quiet --out OUT",
        "campaign dry": "campaign MANY.toml --dry-run",
        "certify": "certify takagi_sugeno_cdo --no-simulation",
        "certify of a scenario": "certify TRAIN",
        "choose": "choose TRAIN --observers takagi_sugeno_cdo,multirate_cdo --seeds 1 --further 1 --out OUT",
        "compare": "compare RESULTS OTHER --verbose --html OUT.html --plots OUT",
        "export of a result": "export RESULTS OUT.npy",
        "export of a scenario": "export TRAIN OUT.ssp",
        "export of a trajectory": "export RESULTS OUT.csv --trajectory --odometer odometer.reading",
        "falsify": "falsify MET.toml --vary locomotive.mass=70e3..80e3 --runs 2 --quiet --out OUT",
        "info of a model": "info locomotive",
        "info of an FMU": "info LAG.fmu",
        "linearise": "linearise takagi_sugeno_cdo",
        "list": "list",
        "open": "open OTHER --no-browser --out OUT.html",
        "new": "new LAG.fmu -o OUT.toml",
        "report": "report RESULTS --out OUT.html",
        "rerun": "rerun RESULTS --quiet --out OUT",
        "run": "run TRAIN --quiet --out OUT --seeds 2",
        "show": "show TRAIN --picture OUT.svg",
        "sweep": "sweep TRAIN --vary locomotive.mass=70e3,80e3 --quiet --out OUT",
        "tune": "tune TRAIN --observer multirate_cdo --parameters theta_2=1:3 --iterations 1 --quiet --out OUT",
        "baseline check of what differs": "baseline check BASE.json --against OTHER",
        "baseline check of two references": "baseline check TWICE.fmu --quiet",
        "calibrate what is not seen": "calibrate running_resistance SHORT.csv --signals speed=locomotive.speed",
        "certify what does not hold": "certify takagi_sugeno_cdo --no-simulation --gap 5 --period 9",
        "compare of one with itself": "compare RESULTS RESULTS",
        "rerun of something else": "rerun RESULTS --quiet --set locomotive.mass=81e3",
        "run of what is not met": "run UNMET.toml --quiet --out OUT --no-report",
        "falsify what breaks": "falsify MET.toml --vary locomotive.train_speed=70..80 --runs 2 --quiet --out OUT",
        "sweep that fails": "sweep TRAIN --vary locomotive.mass=70e3,-1 --quiet --out OUT",
        "sweep by": "sweep TRAIN --vary locomotive.mass=70e3,80e3 --by locomotive.mass --quiet --out OUT",
    },
    "fmus": {
        "build": "build driver -o OUT",
        "check": "check LAG.fmu -o OUT.json",
        "check of what lies": "check BROKEN.fmu",
        "compile": "compile SOURCE.fmu",
        "info": "info LAG.fmu",
        "info of what is damaged": "info BROKEN.fmu",
        "list": "list",
    },
}
PROGRAMS = {"cosim": cosim.cli.PROGRAM, "fmus": fmus.cli.PROGRAM}


def output_of(program: str, words: list[str]) -> Output:
    """What a command reports, and prints nowhere."""
    options = PROGRAMS[program].parser(words).parse_args(words)
    options.command_line = shlex.join([program, *words])
    output: Output = options.execute(options)
    return output


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A folder with a scenario, an FMU, results, and baselines; relative paths are as short as a user types them."""
    folder, before = tmp_path_factory.mktemp("files"), Path.cwd()
    os.chdir(folder)
    scenario = Scenario.load("freight_profile_d").set("stop", 12.0).set("expect", []).set("step", 0.05)
    scenario.save(folder / "TRAIN.toml")
    unmet = {"check": "signal", "signal": "locomotive.speed", "max": 0.001}
    scenario.copy().set("expect", [unmet]).save(folder / "UNMET.toml")
    scenario.copy().set("expect", [unmet | {"max": 40.0}]).save(folder / "MET.toml")
    table = {"runs": 3, "vary": {"seed": {"whole": [0, 99]}}, "keep": {"worst": 0}}
    scenario.with_settings({"campaign": table}).save(folder / "MANY.toml")
    scenario.set("locomotive.mass", 80e3).save(folder / "heavy.toml")
    lag = linear_fmu(folder, "LAG", [[-1.0]], [[1.0]], [[1.0]], [[0.0]], version=2, x0=[1.0])
    with zipfile.ZipFile(shutil.copy(lag, folder / "BROKEN.fmu"), "a") as archive:
        archive.writestr("binaries/linux64/OTHER.so", b"not a library")
    with zipfile.ZipFile(lag) as whole, zipfile.ZipFile(folder / "SOURCE.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", whole.read("modelDescription.xml"))
        archive.writestr("sources/version.c", 'const char *fmi2GetVersion(void) { return "2.0"; }')
    for line in (
        "run TRAIN.toml --no-report --quiet --out RESULTS",
        "run heavy.toml --no-report --quiet --out OTHER",
        "baseline make TRAIN.toml BASE.json --quiet",
        "baseline make LAG.fmu FMUBASE.json --quiet --stop 1 --step 0.1",
        "baseline embed FMUBASE.json LAG.fmu -o HOLDS.fmu",
        "baseline embed FMUBASE.json HOLDS.fmu -o TWICE.fmu --name again",
        "export RESULTS SHORT.csv",
    ):
        assert output_of("cosim", line.split()).code == 0
    yield folder
    os.chdir(before)


CASES = [(program, case) for program, lines in LINES.items() for case in lines]


@pytest.fixture(scope="module")
def outputs() -> dict[tuple[str, str], Output]:
    """What commands reported, each run once."""
    return {}


@pytest.fixture
def output(
    request: pytest.FixtureRequest, outputs: dict[tuple[str, str], Output], capsys: pytest.CaptureFixture[str]
) -> Output:
    key = request.param
    if key not in outputs:
        own = "OUT_" + "_".join(key).replace(" ", "_")
        words = [word.replace("TRAIN", "TRAIN.toml").replace("OUT", own) for word in LINES[key[0]][key[1]].split()]
        if any(word.isupper() or word.partition(".")[0].isupper() for word in words):
            request.getfixturevalue("files")
        outputs[key] = output_of(key[0], words)
        assert capsys.readouterr().out == ""
    return outputs[key]


def strings(data: Any) -> Iterator[str]:
    """All texts in plain data, keys included."""
    if isinstance(data, dict):
        yield from map(str, data)
        data = list(data.values())
    if isinstance(data, list):
        for item in data:
            yield from strings(item)
    elif data is not None:
        yield str(data)


@pytest.mark.compiler
@pytest.mark.parametrize("output", CASES, indirect=True, ids=" ".join)
def test_json_is_one_value_and_holds_what_the_text_holds(output: Output, capsys: pytest.CaptureFixture[str]) -> None:
    output.show("program", as_json=True)
    data = json.loads(capsys.readouterr().out)
    known = " ".join(strings(data))
    for part in output.parts:
        if isinstance(part, Table):
            names = [row[i] for row in part.rows for i in range(part.names) if isinstance(row[i], str)]
            assert [name for name in names if name.strip() not in known] == []
            assert part.key in data or not part
    assert [path for path in output.files.values() if str(path) not in known] == []


@pytest.mark.compiler
@pytest.mark.parametrize("width", [40, 60, 80, 120])
@pytest.mark.parametrize("output", CASES, indirect=True, ids=" ".join)
def test_no_line_is_wider_than_the_terminal(
    output: Output, width: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Only a single word, such as a path, stands out: it can be copied."""
    monkeypatch.setenv("COLUMNS", str(width))
    output.show("program", as_json=False)
    lines = capsys.readouterr().out.splitlines()
    assert [line for line in lines if len(line) > width and " " in line.split(": ", 1)[-1].strip()] == []


@pytest.mark.compiler
@pytest.mark.parametrize(("output", "case"), [(case, case) for case in CASES], indirect=["output"], ids=str)
def test_a_verdict_comes_last_in_one_line(
    output: Output, case: tuple[str, str], capsys: pytest.CaptureFixture[str]
) -> None:
    """Of every command that ends with 1 where it is bad, as its help says."""
    words = LINES[case[0]][case[1]].split()
    parser: Any = PROGRAMS[case[0]].parser(words)
    help_of = " ".join(parser._used(words).format_help().split())
    can_fail = re.search(r"Exit codes: 0 .*, 1 ", help_of)
    assert output.verdict or not can_fail
    assert output.code == 0 or (output.code == 1 and can_fail)
    assert "\n" not in output.verdict
    assert output.show("program", as_json=False) == output.code
    printed = capsys.readouterr()
    assert printed.err == ""
    if output.verdict:
        assert printed.out.splitlines()[-2:] in (["", output.verdict], [output.verdict])


@pytest.mark.filterwarnings("default")
@pytest.mark.parametrize("case", CASES, ids=" ".join)
def test_every_command_prints_warnings_a_line_each_and_whole_where_asked(
    case: tuple[str, str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """What a command does is replaced by one that warns."""
    program, name = PROGRAMS[case[0]], case[1]

    def warns(_options: argparse.Namespace) -> Output:
        logging.getLogger("cosim").warning("It stands at %g s. It says nothing.", 0.5)
        warnings.warn("a number is\nnot finite; it is left out", stacklevel=1)
        return Output(verdict="Well.")

    changed: Any = lambda parser, **said: parser._defaults.update(said, execute=warns)  # noqa: E731
    monkeypatch.setattr(argparse.ArgumentParser, "set_defaults", changed)
    words = LINES[case[0]][name].replace("--verbose", "").split()
    assert program.run(words) == 0
    brief = capsys.readouterr()
    assert brief.out == "Well.\n"
    first, second, end = brief.err.splitlines()
    assert (first, second) == ("warning: It stands at 0.5 s ...", "warning: a number is not finite ...")
    assert end == "(--verbose shows warnings whole)"
    assert program.run([*words, "--verbose"]) == 0
    assert "It stands at 0.5 s. It says nothing." in capsys.readouterr().err


@pytest.mark.parametrize("program", LINES)
def test_a_terminal_that_knows_ascii_alone_shows_the_rest(program: str, monkeypatch: pytest.MonkeyPatch) -> None:
    shown = io.TextIOWrapper(io.BytesIO(), "ascii")
    monkeypatch.setattr(sys, "stdout", shown)
    monkeypatch.setattr(
        argparse.ArgumentParser, "set_defaults", lambda parser, **said: parser._defaults.update(said, execute=dash)
    )
    assert PROGRAMS[program].run(["list"]) == 0
    shown.seek(0)
    assert shown.read() == "From 1 ? 2.\n"


def dash(_options: argparse.Namespace) -> Output:
    """What a command with a character beyond ASCII returns."""
    return Output(verdict="From 1 – 2.")


@pytest.mark.parametrize("program", LINES)
def test_every_command_is_among_them(program: str) -> None:
    names = {command.name for command in find_commands(f"{program}.cli")}
    assert {line.split()[0] for line in LINES[program].values()} == names


@pytest.mark.parametrize("program", LINES)
def test_the_help_lists_every_command_in_its_group(program: str) -> None:
    text = PROGRAMS[program].parser(["--help"]).format_help()
    commands = find_commands(f"{program}.cli")
    assert {command.group for command in commands} == set(PROGRAMS[program].groups)
    for command in commands:
        below = text[text.index(f"\n{command.group}\n") :]
        assert f"\n  {command.name} " in below
        assert command.help.split()[0] in below


@pytest.mark.parametrize("program", LINES)
def test_the_help_lists_commands_of_a_group_in_order_of_use(program: str) -> None:
    text = PROGRAMS[program].parser(["--help"]).format_help()
    for group in PROGRAMS[program].groups:
        members = [command for command in find_commands(f"{program}.cli") if command.group == group]
        ordered = sorted(members, key=lambda command: command.place)
        assert [command.place for command in ordered] == list(range(1, len(members) + 1))
        below = text[text.index(f"\n{group}\n") :]
        positions = [below.index(f"\n  {command.name} ") for command in ordered]
        assert positions == sorted(positions)


@pytest.mark.parametrize("program", LINES)
def test_an_old_spelling_is_replaced_by_the_new_one(program: str, capsys: pytest.CaptureFixture[str]) -> None:
    for command in find_commands(f"{program}.cli"):
        for old, now in command.former.items():
            with pytest.raises(SystemExit) as stopped:
                PROGRAMS[program].parser([old, "anything"])
            assert stopped.value.code == 2
            assert f"'{old}' has become: {now}" in capsys.readouterr().err
            assert now.startswith(f"{program} {command.name}")
