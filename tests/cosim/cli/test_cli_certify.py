"""``cosim certify``: table, JSON, exit codes, scenarios and files of gains, and mistakes in a line."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from cosim.cli import main

DMO = "discrete_measurement_observer"
TRAIN = "takagi_sugeno_cdo"


def certify(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, dict[str, Any]]:
    """Exit code and data of the command."""
    code = main(["certify", *words, "--json"])
    data: dict[str, Any] = json.loads(capsys.readouterr().out)
    return code, data


def of(data: dict[str, Any], what: str, kind: str) -> list[float]:
    """Values of an observer's findings by the begin of what they are of, and kind."""
    (one,) = data["observers"]
    return [f["value"] for f in one["findings"] if f["what"].startswith(what) and f["kind"] == kind]


def test_the_table_says_what_value_holds_kind_and_source(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "90")
    assert main(["certify", "delayed_state_observer", "--option", "predictors=3", "--no-simulation"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[1].split() == ["finding", "value", "holds", "kind", "source"]
    assert any(line.startswith("delay, 3 predictors") and " as printed " in line for line in lines)
    assert any("(2.59)" in line for line in lines)


def test_a_demanded_gap_decides_the_exit_code(capsys: pytest.CaptureFixture[str]) -> None:
    assert certify(capsys, TRAIN, "--gap", "0.5")[0] == 0
    assert certify(capsys, TRAIN, "--gap", "0.6", "--preset", "as_published")[0] == 1
    code, data = certify(capsys, "differentiator_cdo", "--gap", "0.55", "--period", "0.55")
    assert code == 1
    (unmet,) = data["not_certified"]  # that constant gap is stable
    assert unmet.startswith("differentiator_cdo (as_published): NOT CERTIFIED for mixed balise gaps up to 0.55 s")
    assert certify(capsys, "luenberger", "--gap", "1")[1]["not_certified"] == [
        "luenberger: mixed gaps of 1 s is not certified; it has no finding about that."
    ]


def test_a_demanded_delay_is_held_against_memory_and_predictors(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["delayed_state_observer", "--no-simulation"]
    assert certify(capsys, *words, "--delay", "0.2")[0] == 0
    code, data = certify(capsys, *words, "--delay", "0.3")
    assert (code, len(data["not_certified"])) == (1, 1)
    assert "declared_memory of 0.3 s is not certified; 0.2 s is known" in data["not_certified"][0]
    assert certify(capsys, TRAIN, "--delay", "10")[0] == 0  # replayed
    assert certify(capsys, TRAIN, "--delay", "10.1")[0] == 1


def test_bounds_of_an_error(capsys: pytest.CaptureFixture[str]) -> None:
    words = [DMO, "--missing", "1", "--set", "odometer_period=0.1", "--error", "0.7"]
    code, data = certify(capsys, *words)  # 0.64 m/s carried
    assert code == 0
    assert len(of(data, "speed error", "sufficient")) == 2
    assert of(data, "speed error", "sufficient")[0] < 0.7
    for kind in ("as printed", "sufficient", "exact"):
        assert len(of(data, "gap that keeps 0.7 m/s", kind)) == len(of(data, "period that keeps", kind)) == 1
    assert certify(capsys, *words, "--set", "odometer_period=0.2", "--missing", "0")[0] == 1  # 0.88 m/s carried
    assert certify(capsys, *words, "--set", "odometer_period=0.2", "--by", "exact")[0] == 0
    with pytest.raises(SystemExit) as usage:  # what is printed is no bound
        main(["certify", *words, "--by", "published"])
    assert usage.value.code == 2


def test_gains_in_a_file_are_those_of_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "gains.toml"
    file.write_text(f'observer = "{TRAIN}"\npreset = "as_published"\n[parameters]\ninnovation_decay = 9.9\n')
    typed = certify(capsys, TRAIN, "--preset", "as_published", "--set", "innovation_decay=9.9", "--gap", "0.4")
    assert certify(capsys, str(file), "--gap", "0.4") == typed
    assert certify(capsys, str(file), "--gap", "0.4", "--set", "innovation_decay=3.0")[0] == 1


def test_a_scenario_is_held_against_its_gaps(capsys: pytest.CaptureFixture[str]) -> None:
    code, data = certify(capsys, "balise_holes")
    assert code == 0
    assert {one["observer"] for one in data["observers"]} >= {"held", "ending", "exponential"}
    assert all(one["demanded"][0]["demand"] == pytest.approx(22.47, abs=0.01) for one in data["observers"])
    code, data = certify(capsys, "balise_holes", "--gap", "33")
    assert code == 1
    assert len(data["not_certified"]) == 1
    assert data["not_certified"][0].startswith("decaying_innovation_cdo (balise_holes): NOT CERTIFIED")


MISTAKES = [
    (["discrete_measurement_observr"], "did you mean 'discrete_measurement_observer'"),
    ([TRAIN, "--error", "1"], "has no bound of its error"),
    ([DMO, "--missing", "-1"], "must not be negative, got -1"),
    ([DMO, "--error", "1", "--set", "gain=[1,2,3]"], "must decay with bound_decay under gain"),
    ([DMO, "--set", "gain=x"], "needs 3 finite number(s), got 'x'"),
    ([DMO, "--set", "gian=1"], "unknown parameter 'gian' to certify"),
    ([DMO, "--set", "odometer_period"], "expected NAME=VALUE"),
    ([DMO, "--set", "odometer_period=-0.2"], "must be at least 0.0001 s"),
    ([DMO, "--preset", "nix"], "unknown preset 'nix'"),
    (["nobody"], "There is no observer 'nobody'"),
    (["nothing.toml"], "nothing.toml"),
    (["jam_detector"], "has no findings: no measurement comes to it as an event"),
    (["odometer_reset"], "has no findings: it declares no error equations"),
    (["output_predictor", "--members", "1"], "expected 4 values or more"),
    (["delayed_state_observer", "--option", "predictors=12"], "choose from 1, 0, 2, 3"),
]


@pytest.mark.parametrize(("words", "said"), MISTAKES)
def test_mistakes_are_explained_without_a_traceback(
    words: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["certify", *words]) == 2
    assert said in capsys.readouterr().err


@pytest.mark.parametrize("former", ["bound", "limits"])
def test_former_names_lead_to_the_new_one(former: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as usage:
        main([former, DMO])
    assert usage.value.code == 2
    assert f"'{former}' has become: cosim certify OBSERVER" in capsys.readouterr().err
