"""``cosim tune``: what it takes, prints and writes, how it exits."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from cosim import Scenario
from cosim.cli import main
from cosim.cli.tune_command import _seeds
from cosim.runs.journal import JOURNAL

RUNNING = {"train_speed": 10.0, "wheel_rate": 10.0 / 0.575, "effort": 5e4}


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """A locomotive that is asked to be fast."""
    scenario = Scenario(stop=0.1, step=0.01)
    scenario.add("train", model="locomotive", **{"as": "block3"}, parameters=RUNNING)
    scenario.expect("signal", name="it is fast", signal="train.speed", start=0.05, min=10.1)
    return scenario.save(tmp_path / "fast.toml")


def test_it_searches_writes_and_goes_on(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A light train is faster: with a minus sign the largest is searched."""
    folder = file.parent / "tuned"
    words = ["tune", str(file), "--parameters", "train.mass=60e3:120e3", "--cost=-expectation:fast", "--method", "hand"]
    words += ["--iterations", "4", "--option", "step=0.3", "--out", str(folder)]
    assert main(words) == 0
    said = capsys.readouterr().out
    assert "train.mass" in said
    assert "runs, of the whole scenario: train is tuned" in said
    data = json.loads((folder / "tuning.json").read_text())
    assert data["best"] == {"train.mass": 60e3}
    assert Scenario.load(folder / "tuned.toml").table().components["train"].parameters["mass"] == 60e3
    before = (folder / JOURNAL).read_text()
    assert main([*words, "--resume", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["runs"] == 0
    assert (folder / JOURNAL).read_text() == before


def test_two_workers_find_what_one_does(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Runs in two processes, to the last bit, whichever ends first."""
    words = ["tune", str(file), "--parameters", "train.mass=60e3:120e3", "train.effort=1e4:9e4", "--json"]
    words += ["--cost=-expectation:fast", "--iterations", "2", "--option", "population=4"]
    found = []
    for workers in ("1", "2"):
        assert main([*words, "--workers", workers, "--out", str(file.parent / workers)]) == 0
        found.append(json.loads(capsys.readouterr().out))
    assert found[1] | {"files": {}} == found[0] | {"files": {}}  # which are in folders of their own
    assert len(set(found[0]["searches"][0]["costs"])) > 1


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--parameters", "train.mass"], "expected NAME=LOW:HIGH"),
        (["--parameters", "train.mass=3:1", "--cost", "expectation:1"], "the lower one first"),
        (["--parameters", "train.mas=1:3", "--cost", "expectation:1"], "did you mean 'mass'"),
        (["--parameters", "train.fuss=1:3", "--cost", "expectation:1"], "no 'fuss'; known: "),
        (["--parameters", "trian.mass=1:3", "--cost", "expectation:1"], "did you mean 'train'"),
        (["--parameters", "train.mass=60e3:70e3"], "name it (--observer NAME)"),
        (["--parameters", "train.mass=60e3:70e3", "--cost", "expectation:2"], "known: 1 (it is fast)"),
        (
            ["--parameters", "train.mass=60e3:70e3", "--cost", "expectation:1", "--seeds", "0:2"],
            "give one training seed",
        ),
    ],
)
def test_what_cannot_be_ends_with_two(
    file: Path, words: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["tune", str(file), "--out", str(file.parent / "out"), *words]) == 2
    assert said in capsys.readouterr().err


def test_seeds() -> None:
    assert _seeds("0:4") == [0, 1, 2, 3]
    assert _seeds("1,5,7") == [1, 5, 7]
    assert _seeds("3") == [3]
