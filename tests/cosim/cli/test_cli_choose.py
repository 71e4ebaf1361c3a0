"""``cosim choose``: the answer, JSON, files, exit codes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from small_scenarios import small

from cosim import Scenario
from cosim.cli import main


@pytest.fixture
def scenario(tmp_path: Path) -> str:
    return str(small().report(evaluate_after=0.1).save(tmp_path / "small.toml"))


FEW = ["--observers", "odometer_reset,balise_odometer_ekf:tuned,luenberger", "--seeds", "1", "--quiet"]


def test_the_answer_comes_first_and_what_is_written_runs(
    scenario: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, run, written = tmp_path / "out", tmp_path / "run", tmp_path / "chosen.toml"
    more = ["--out", str(out), "--record", str(run), "--write", str(written)]
    assert main(["choose", scenario, *FEW, *more]) == 0
    text = capsys.readouterr().out
    assert text.startswith("use ")
    assert "odometer_reset" in text
    assert "luenberger" in text.partition("not tried")[2].partition("observers on")[0]
    assert sorted(path.name for path in out.iterdir()) == ["observers.html", "observers.json"]
    used = json.loads((out / "observers.json").read_text(encoding="utf-8"))["use"]
    assert f"use {used}" in (out / "observers.html").read_text(encoding="utf-8")
    assert text.startswith(f"use {used}")
    outcome = Scenario.load(written).run(warn=lambda _: None)
    assert outcome.failure is None
    assert len(outcome.spec.observers) == 1
    assert main(["choose", scenario, *FEW, "--from", str(run), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert {row["observer"] for row in data["rows"]} >= {"odometer_reset", "balise_odometer_ekf:tuned"}
    assert [entry["name"] for entry in data["runs"]][:3] == ["nominal", "seed 1", "harder seed 1"]


def test_a_choice_needs_a_disturbed_run_and_assumes_nothing_of_a_scenario(
    scenario: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["choose", scenario, "--observers", "odometer_reset", "--seeds", "0"]) == 2
    assert "--seeds 0" in capsys.readouterr().err
    assert main(["choose", scenario, "--assume", "vIst=km/h"]) == 2
    assert "--assume belongs to an FMU" in capsys.readouterr().err


def test_a_file_that_exists_is_kept(scenario: str, capsys: pytest.CaptureFixture[str]) -> None:
    before = Path(scenario).read_bytes()
    assert main(["choose", scenario, *FEW, "--write", scenario]) == 2
    assert "exists already; choose another name, or replace it with --force" in capsys.readouterr().err
    assert Path(scenario).read_bytes() == before
    assert main(["choose", scenario, *FEW, "--write", scenario, "--force"]) == 0
    assert Path(scenario).read_bytes() != before


def test_where_nothing_is_safe_the_verdict_comes_last_with_exit_code_1_and_an_allowance_relaxes_it(
    scenario: str, capsys: pytest.CaptureFixture[str]
) -> None:
    few = ["--observers", "odometer_reset", "--seeds", "1", "--further", "0", "--quiet"]
    assert main(["choose", scenario, *few, "--allowance", "0.0001+0%"]) == 1
    text = capsys.readouterr().out
    assert text.splitlines()[-1].startswith("nothing is safe here, least bad odometer_reset, because of ")
    assert main(["choose", scenario, *few, "--allowance", "100+0%"]) == 0
    assert capsys.readouterr().out.splitlines()[-1].startswith("use odometer_reset")


def test_a_run_again_writes_the_scenario_that_plays_it(
    scenario: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    written = tmp_path / "third.toml"
    asked = ["choose", scenario, "--observers", "odometer_reset", "--replay", "3", "--quiet"]
    assert main([*asked, "--write", str(written)]) == 0
    shown = capsys.readouterr().out
    assert shown.splitlines()[-1].startswith("odometer_reset in seed 3: at most ")
    assert "wheel of the odometer" in shown
    assert (tmp_path / "third_recording" / "summary.json").is_file()
    assert main(["run", str(written), "--quiet"]) == 0
    assert main([*asked, "--json", "--out", str(tmp_path)]) == 2
    assert "cosim run makes one" in capsys.readouterr().err


def test_the_former_name_says_what_is_typed_now(scenario: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["benchmark-observers", scenario])
    assert "cosim choose" in capsys.readouterr().err


def test_where_nothing_comes_through_it_is_an_error_with_the_reasons(
    scenario: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["choose", scenario, "--observers", "thau", "--quiet"]) == 2
    assert "thau: cannot be coupled: nothing in this scenario gives its inputs torque" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--observers", "obsever"], "unknown observer 'obsever'; did you mean 'observer'"),
        (["--from", "nowhere"], "nowhere"),
        (["--set", "balises.layout=recorded"], "layout 'recorded' needs 'file'"),
        (["--allowance", "five"], "allowance 'five': expected metres plus per cent of the distance"),
        (["--seeds", "-1"], "seeds must not be negative, got -1"),
        (["--replay", "3"], "--replay does a run of one observer again: say which with --observers NAME"),
        (["--replay", "last", "--observers", "odometer_reset"], "run 'last': expected the number of a seed"),
    ],
)
def test_mistakes_are_exit_code_2_in_words(
    arguments: list[str], words: str, scenario: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["choose", scenario, "--quiet", *arguments]) == 2
    said = capsys.readouterr().err
    assert words in said
    assert "Traceback" not in said


@pytest.mark.parametrize("arguments", [["--observers", ","], ["--from", "a", "--record", "b"]])
def test_arguments_that_cannot_be_are_refused(arguments: list[str], scenario: str) -> None:
    with pytest.raises(SystemExit) as stopped:
        main(["choose", scenario, *arguments])
    assert stopped.value.code == 2
