"""``cosim bound``: table, JSON, exit codes, and mistakes in a line."""

from __future__ import annotations

import json

import pytest

from cosim.cli import main

DMO = "discrete_measurement_observer"


def test_the_table_and_the_largest_gaps(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bound", DMO, "--preset", "as_published_set_d", "--limit", "1.2", "--missing", "3"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("discrete_measurement_observer (as_published_set_d): odometer every 0.2 s")
    assert [line.split()[0] for line in lines[3:7]] == ["0", "1", "2", "3"]
    assert any(line.startswith("Largest gap that keeps 1.2 m/s: as printed 0.3") for line in lines)
    assert any(line.startswith("Largest period that keeps 1.2 m/s: ") for line in lines)


def test_json_and_the_exit_code(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["bound", DMO, "--json", "--missing", "1", "--set", "odometer_period=0.1", "--limit", "0.7"]
    assert main(words) == 0  # 0.64 m/s carried
    data = json.loads(capsys.readouterr().out)
    assert (data["period"], len(data["rows"])) == (0.1, 2)
    assert data["rows"][0]["carried"] < 0.7
    assert set(data["largest_gaps"]) == {"as_printed", "carried", "exact"}
    assert main([*words, "--set", "odometer_period=0.2", "--missing", "0"]) == 1  # 0.88 m/s carried
    capsys.readouterr()
    with pytest.raises(SystemExit) as usage:  # what is printed is no bound
        main([*words, "--by", "published"])
    assert usage.value.code == 2


MISTAKES = [
    (["discrete_measurement_observr"], "did you mean 'discrete_measurement_observer'"),
    (["takagi_sugeno_cdo"], "tells no bound of its error"),
    ([DMO, "--limit", "-1"], "limit must be a positive number, got -1"),
    ([DMO, "--missing", "-1"], "must not be negative, got -1"),
    ([DMO, "--set", "gain=[1,2,3]"], "must decay with bound_decay under gain"),
    ([DMO, "--set", "gain=x"], "needs 3 finite number(s), got 'x'"),
    ([DMO, "--set", "gian=1"], "unknown parameter 'gian' to bound its error"),
    ([DMO, "--set", "odometer_period"], "expected NAME=VALUE"),
    ([DMO, "--set", "odometer_period=-0.2"], "must be at least 0.0001 s"),
    ([DMO, "--preset", "nix"], "unknown preset 'nix'"),
]


@pytest.mark.parametrize(("words", "said"), MISTAKES)
def test_mistakes_are_told_without_a_traceback(words: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bound", *words]) == 2
    assert said in capsys.readouterr().err
