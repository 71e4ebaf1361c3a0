"""The command ``cosim show``."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from cosim.cli import main

SCENARIO = """
title = "Two blocks"
stop = 1.0
step = 0.1
connections = ["driver.effort -> train.effort", "train.wheel_speed -> driver.odometer"]
[components.train]
model = "locomotive"
as = "block3"
[components.driver]
model = "driver"
as = "block3"
"""


@pytest.fixture
def file(tmp_path: Path) -> str:
    path = tmp_path / "two.toml"
    path.write_text(SCENARIO)
    return str(path)


def test_text(file: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["show", file]) == 0
    text = capsys.readouterr().out
    assert text.startswith("two: Two blocks\n0 s to 1 s in 10 steps of 0.1 s; 2 components, 2 connections")
    assert "driver.effort      -> train.effort     fresh, of the end of the step" in text
    assert "\x1b" not in text


def test_json_and_settings(file: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["show", file, "--json", "--set", "step=0.05", "--set", "master.algorithm=jacobi"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert (data["step"], data["algorithm"], data["order"]) == (0.05, "jacobi", ["driver", "train"])
    assert all(link["held"] for link in data["links"])


def test_picture(file: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["show", file, "--json", "--picture", str(tmp_path / "two.svg")]) == 0
    assert (tmp_path / "two.svg").read_text().lstrip().startswith("<?xml")
    assert json.loads(capsys.readouterr().out)["files"]["picture"].endswith("two.svg")


def test_mistakes_of_the_user_are_explained_without_a_traceback(
    file: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cases = {
        "does not exist": [str(tmp_path / "none.toml")],
        "ends in .png": [file, "--picture", str(tmp_path / "x.doc")],
        "does not divide": [file, "--set", "step=0.3"],
        "freight_profile_d": ["freight_profile_x"],
    }
    for word, arguments in cases.items():
        assert main(["show", *arguments]) == 2
        reported = capsys.readouterr().err
        assert word in reported
        assert "Traceback" not in reported
