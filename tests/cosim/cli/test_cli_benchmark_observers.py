"""``cosim benchmark-observers``: table, JSON, files, exit codes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from small_scenarios import small

from cosim.cli import main


@pytest.fixture
def scenario(tmp_path: Path) -> str:
    return str(small().report(evaluate_after=0.1).save(tmp_path / "small.toml"))


def test_table_files_and_a_recording_that_is_played_back(
    scenario: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, run = tmp_path / "out", tmp_path / "run"
    assert (
        main(["benchmark-observers", scenario, "--observers", "observer", "--record", str(run), "--out", str(out)]) == 0
    )
    table = capsys.readouterr().out
    assert "rms v [m/s]" in table
    assert "cost [us/step]" in table
    assert sorted(path.name for path in out.iterdir()) == ["observers.html", "observers.json"]
    arguments = ["--observers", "observer", "--from", str(run), "--json", "--repeat", "2"]
    assert main(["benchmark-observers", scenario, *arguments]) == 0
    data = json.loads(capsys.readouterr().out)
    written = json.loads((out / "observers.json").read_text(encoding="utf-8"))
    assert data["observers"][0]["whole"] == written["observers"][0]["whole"]
    assert len(data["observers"][0]["costs"]) == 2


def test_an_observer_that_cannot_be_coupled_is_exit_code_1(scenario: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["benchmark-observers", scenario, "--observers", "thau", "--quiet"]) == 1
    assert "thau: cannot be coupled: nothing in this scenario gives its inputs torque" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--observers", "obsever"], "unknown observer 'obsever'; did you mean 'observer'"),
        (["--from", "nowhere"], "nowhere"),
        (["--set", "balises.layout=recorded"], "layout 'recorded' needs 'file'"),
    ],
)
def test_mistakes_are_exit_code_2_in_words(
    arguments: list[str], words: str, scenario: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["benchmark-observers", scenario, "--quiet", *arguments]) == 2
    said = capsys.readouterr().err
    assert words in said
    assert "Traceback" not in said


@pytest.mark.parametrize("arguments", [["--repeat", "0"], ["--observers", ","], ["--from", "a", "--record", "b"]])
def test_arguments_that_cannot_be_are_refused(arguments: list[str], scenario: str) -> None:
    with pytest.raises(SystemExit) as stopped:
        main(["benchmark-observers", scenario, *arguments])
    assert stopped.value.code == 2
