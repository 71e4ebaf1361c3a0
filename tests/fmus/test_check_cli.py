"""The command line of the check: exit codes 0, 1, 2, the table, JSON, start values; no traceback for a mistake."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from lying_fmus import build

from fmus.cli import main

Output = pytest.CaptureFixture[str]
pytestmark = pytest.mark.compiler


@pytest.fixture(scope="module")
def honest(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(tmp_path_factory.mktemp("honest"))


def test_the_table_of_an_honest_fmu(honest: Path, capsys: Output) -> None:
    assert main(["check", str(honest)]) == 0
    shown = capsys.readouterr()
    assert shown.out.startswith("liar: FMI 2.0, co-simulation; communication step 0.01 s\n")
    rows = {line.split("  ")[0]: line for line in shown.out.splitlines() if "  pass" in line}
    assert "2e-06" not in rows["time per step"]
    assert "microseconds for a step of 0.01 s" in rows["time per step"]
    assert "Verdict: use as it is (42 pass, " in shown.out
    assert "  - Rollback: yes. " in shown.out
    assert "Traceback" not in shown.err


@pytest.mark.parametrize(
    ("lie", "arguments", "code", "verdict"),
    [
        ("ACCEPTS_ANYTHING", ["--strict"], 0, "use as it is"),
        ("RESET_KEEPS", [], 0, "use with these limits"),
        ("RESET_KEEPS", ["--strict"], 1, "use with these limits"),
        ("NAN_LATER", [], 1, "do not trust"),
    ],
)
def test_the_exit_code_is_what_a_pipeline_needs(
    lie: str, arguments: list[str], code: int, verdict: str, tmp_path: Path, capsys: Output
) -> None:
    target = tmp_path / "report.json"
    assert main(["check", str(build(tmp_path, lie)), "-o", str(target), *arguments]) == code
    assert f"Verdict: {verdict} (" in capsys.readouterr().out
    assert json.loads(target.read_text(encoding="utf-8"))["verdict"] == verdict


def test_limits_are_reported_with_what_to_do(tmp_path: Path, capsys: Output) -> None:
    target = tmp_path / "report.json"
    main(["check", str(build(tmp_path, "RESET_KEEPS")), "-o", str(target)])
    shown = capsys.readouterr().out
    assert re.search("reset and re-run +limit +after a reset the outputs differ", shown)
    assert "\n  - make a new instance for each run (reset and re-run)\n" in shown
    data = json.loads(target.read_text(encoding="utf-8"))
    assert data["limits"] == [{"check": "reset and re-run", "advice": "make a new instance for each run"}]
    assert "Reset: no. Make a new instance for each run." in data["trust"]


def test_json_in_place_of_the_table(honest: Path, capsys: Output) -> None:
    assert main(["check", str(honest), "--json", "--step", "0.02", "--start", "force=3"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert (data["model"], data["fmiVersion"], data["communicationStepSize"]) == ("liar", "2.0", 0.02)
    assert data["starts"] == {"force": 3.0}
    assert data["verdict"] == "use as it is"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--start", "forse=1"], "There is no variable 'forse' to set; did you mean 'force'?"),
        (["--start", "force"], "write it as name=number"),
        (["--start", "force=strong"], "--start force: expected a number, such as 0.1"),
        (["--step", "0"], "must be positive and finite"),
        (["--timeout", "-1"], "must be positive and finite"),
        (["--steps", "0"], "must have a step at least"),
        (["--until", "0"], "must lie after the start"),
        (["-o", "no/such/folder/report.json"], "no/such/folder/report.json cannot be written: No such file"),
    ],
)
def test_mistakes_end_with_two_and_advice(arguments: list[str], words: str, honest: Path, capsys: Output) -> None:
    assert main(["check", str(honest), *arguments]) == 2
    said = capsys.readouterr().err
    assert words in said
    assert "Traceback" not in said


def test_what_is_no_fmu_ends_with_two(tmp_path: Path, capsys: Output) -> None:
    text = tmp_path / "text.fmu"
    text.write_text("hello")
    assert main(["check", str(text)]) == 2
    assert "not a readable FMU" in capsys.readouterr().err
    assert main(["check", str(tmp_path / "none.fmu")]) == 2


@pytest.mark.parametrize("arguments", [["check"], ["check", "x.fmu", "--step", "soon"]])
def test_wrong_usage_ends_with_two(arguments: list[str], capsys: Output) -> None:
    with pytest.raises(SystemExit) as stopped:
        main(arguments)
    assert stopped.value.code == 2
    assert "see 'fmus check --help'" in capsys.readouterr().err
