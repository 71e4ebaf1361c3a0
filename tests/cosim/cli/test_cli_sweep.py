"""``cosim sweep``: what it takes, prints and writes, how it exits."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from cosim import Scenario
from cosim.cli import main
from cosim.cli.sweep_command import parse_values
from cosim.errors import ScenarioError
from cosim.results.results_folder import read_results
from cosim.studies.distributions import uniform


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """A locomotive that passes the balises of a list."""
    scenario = Scenario(stop=0.2, step=0.01)
    scenario.add("train", model="locomotive", **{"as": "block3"}, parameters={"train_speed": 10.0})
    scenario.balises(position="train.position", speed="train.speed", layout="csv", file=str(tmp_path / "track.csv"))
    (tmp_path / "track.csv").write_text("position\n1.0\n")
    return scenario.save(tmp_path / "plain.toml")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("70e3,80e3", [70e3, 80e3]),
        ("0:3", [0, 1, 2]),
        ("-2:3:2", [-2, 0, 2]),
        ("70e3..90e3", uniform(70e3, 90e3)),
        ("-1..1", uniform(-1, 1)),
        ("repaired, as_published", ["repaired", "as_published"]),
        ("[1.0, 2.0], [3.0, 4.0]", [[1.0, 2.0], [3.0, 4.0]]),
        ('"a,b",true', ["a,b", True]),
        ("5", [5]),
    ],
)
def test_values_are_a_list_a_range_or_words(text: str, expected: Any) -> None:
    assert parse_values(text) == expected


def test_a_range_of_nothing_is_refused() -> None:
    with pytest.raises(ScenarioError, match="3:1 holds no numbers"):
        parse_values("3:1")


def test_a_sweep_prints_the_table_and_writes_every_run(
    file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert (
        main(["sweep", str(file), "--vary", "train.mass=70e3,80e3", "--vary", "stop=0.1,0.2", "--out", str(out)]) == 0
    )
    said = capsys.readouterr().out
    assert said.splitlines()[0] == "The same in all runs: outcome done."
    assert said.splitlines()[1].split() == ["run", "train.mass", "stop"]
    assert [line.split() for line in said.splitlines()[3:7]] == [
        ["0", "70000", "0.1"],
        ["1", "70000", "0.2"],
        ["2", "80000", "0.1"],
        ["3", "80000", "0.2"],
    ]
    assert "4 of 4 runs done" in said
    assert [read_results(out / f"run_{n:03d}").time[-1] for n in range(4)] == [0.1, 0.2, 0.1, 0.2]
    assert read_results(out / "run_002").summary["sweep_settings"] == {"train.mass": 80e3, "stop": 0.1}


def test_one_run_that_fails_is_exit_code_1_and_the_others_are_there(
    file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    common = ["sweep", str(file), "--zip", "--vary", f"balises.file={tmp_path}/none.csv,{tmp_path}/track.csv"]
    assert main([*common, "--vary", "train.mass=70e3,80e3", "--json", "--out", str(tmp_path / "out")]) == 1
    data = json.loads(capsys.readouterr().out)
    assert [run["folder"] for run in data["runs"]] == [None, "run_001"]
    assert "none.csv does not exist" in data["runs"][0]["failure"]
    assert [e.position for e in read_results(tmp_path / "out" / "run_001").events] == [1.0]


def test_samples_are_those_of_the_seed(file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    common = [
        "sweep",
        str(file),
        "--vary",
        "train.mass=70e3..90e3",
        "--samples",
        "2",
        "--json",
        "--out",
        str(tmp_path / "out"),
    ]
    assert main([*common, "--seed", "5", "--set", "stop=0.05"]) == 0
    found = [run["settings"]["train.mass"] for run in json.loads(capsys.readouterr().out)["runs"]]
    points = Scenario.load(file).vary({"train.mass": uniform(70e3, 90e3)}, "latin", count=2, seed=5).variations
    assert found == [point["train.mass"] for point in points]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--vary", "train.mas=1.0"], "no variable 'mas'; did you mean 'mass'"),
        (["--vary", "train.mass"], "expected NAME=VALUES"),
        (["--vary", "stop=0.1", "--vary", "stop=0.2"], "stop is given twice"),
        (["--vary", "train.mass=1e4..2e4"], "a range is sampled; say with --samples N"),
        (["--vary", "train.mass=2e4..1e4", "--samples", "2"], "--vary: 2e4..1e4: A range needs two finite ends"),
        (["--vary", "train.mass=0:1000000000"], "1000000000 variations are more than 100000"),
        (["--vary", "train.mass=1:1000", "--vary", "stop=1:1000"], "998001 variations are more than 100000"),
        (["--vary", "train.mass=1e4..2e4", "--samples", "1000000000"], "1000000000 variations are more"),
        (["--vary", "stop=0.1", "--zip", "--samples", "3"], "exclude each other"),
    ],
)
def test_a_mistake_ends_in_words(
    arguments: list[str], message: str, file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["sweep", str(file), *arguments, "--out", str(tmp_path / "out")]) == 2
    assert message in capsys.readouterr().err
