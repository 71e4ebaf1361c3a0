"""``cosim export --trajectory``: odometer and balises become a trajectory whose errors are of the size it states."""

import json
from pathlib import Path

import numpy as np
import pytest

from cosim.cli import main
from cosim.cli.trajectory import TRAJECTORY
from cosim.evaluation.reference_trajectory import reference_trajectory, sampled_rows
from cosim.results.load_result import load_result
from fmu_observer.formulas.filtering.covariance_consistency import _is_inside
from fmus.cli.commands import Argument

STD, SCALE, BALISES = 0.05, 0.015, 250.0


def journey(seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Time, true position, true speed, odometer of a train with worn wheels that slips once, stamps of balises."""
    random = np.random.default_rng(seed)
    time = np.arange(0.0, 120.0, 0.1)
    acceleration = np.interp(time, [0, 30, 34, 80, 84, 116], [0.6, 0.6, 0.0, 0.0, -0.6, -0.6])
    speed = 5.0 + np.concatenate([[0.0], np.cumsum(0.05 * (acceleration[1:] + acceleration[:-1]))])
    position = 100.0 + np.concatenate([[0.0], np.cumsum(0.05 * (speed[1:] + speed[:-1]))])
    odometer = (1.0 + SCALE) * speed + random.normal(0.0, STD, len(time))
    odometer[(time > 50.0) & (time < 52.0)] += 3.0
    stamps = np.interp(np.arange(200.0, position[-1], BALISES), position, time)
    return time, position, speed, odometer, stamps


def test_errors_are_of_the_size_it_reports_and_the_wheel_is_found() -> None:
    time, position, speed, odometer, stamps = journey()
    places = np.interp(stamps, time, position) + np.random.default_rng(3).normal(0.0, 0.3, len(stamps))
    found = reference_trajectory(time, odometer, stamps, places, odometer_std=STD, balise_std=0.3)
    errors = found.values[:, :2] - np.stack([np.interp(found.time, time, y) for y in (position, speed)], axis=1)
    assert np.abs(errors[:, 0]).max() < 1.0
    assert np.sqrt(np.square(errors).mean(axis=0)) == pytest.approx([0.0, 0.0], abs=0.25)
    for i in range(2):
        assert _is_inside((errors[:, i] / found.deviations[:, i]) ** 2, 1.0).mean() > 0.8  # of one run, correlated
    assert found.values[:, 3].mean() == pytest.approx(SCALE, abs=2e-3)
    assert found.left_out == pytest.approx(19, abs=2)  # the slip: readings strictly between 50 and 52 s
    assert found.readings == len(time)


def test_the_command_writes_what_a_scenario_plays_back(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    time, position, _, odometer, stamps = journey()
    rows = "".join(f"{t:.1f},{3.6 * v:.6f}\n" for t, v in zip(time, odometer, strict=True))
    Path("log.csv").write_text("time,odometer [km/h]\n" + rows)
    reported = "".join(f"{t:.9f},{p:.9f}\n" for t, p in zip(stamps, np.interp(stamps, time, position), strict=True))
    Path("telegrams.csv").write_text("stamp,position\n" + reported)
    words = ["log.csv", "reference.csv", "--trajectory", "--odometer", "odometer", "--odometer-std", "0.05"]
    words += ["--telegrams", "telegrams.csv"]
    assert main(["export", *words]) == 0
    out = capsys.readouterr().out
    assert "19 left out" in out
    assert "expected 1" in out
    again = load_result("reference.csv")
    assert {s.name: s.unit for s in again.signals}["speed_std"] == "m/s"
    assert np.abs(again["position"] - np.interp(again.time, time, position)).max() < 1.0
    assert main(["export", *words, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["readings"] == len(time)


def test_what_is_missing_is_reported(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "log.csv").write_text("time,odometer [m/s]\n0.0,1.0\n0.1,1.0\n0.2,1.0\n")
    log = str(tmp_path / "log.csv")
    for words, text in (
        ([], "Say --odometer NAME; there are: odometer"),
        (["--odometer", "odo"], "no signal of that name"),
        (["--odometer", "odometer"], "0 balises; a trajectory needs 3 and 1"),
        (["--odometer", "odometer", "--telegrams", str(tmp_path / "no.csv")], "holds no telegrams"),
    ):
        assert main(["export", log, str(tmp_path / "out.csv"), "--trajectory", *words]) == 2
        assert text in capsys.readouterr().err
    (tmp_path / "telegrams.csv").write_text("stamp,position\n0.1,5.0\n")
    words = ["export", log, str(tmp_path / "out.csv"), "--trajectory", "--odometer", "odometer"]
    assert main([*words, "--telegrams", str(tmp_path / "telegrams.csv"), "--odometer-std", "0"]) == 2
    assert "odometer_std = 0; expected a positive number" in capsys.readouterr().err


def test_a_held_odometer_is_read_where_it_changes() -> None:
    time = np.arange(0.0, 1.0, 0.01)
    held = np.floor(time * 10.0 + 1e-9)
    assert sampled_rows(time, held).tolist() == list(range(0, 100, 10))
    assert len(sampled_rows(time, time)) == 100
    assert sampled_rows(np.array([0.0, 1.0, 1.0, 2.0]), np.array([1.0, 2.0, 3.0, np.nan])).tolist() == [0, 2]


@pytest.mark.parametrize(
    "action", [a.names[0] for a in TRAJECTORY.arguments if isinstance(a, Argument) and a.names[0] != "--trajectory"]
)
def test_what_is_of_a_trajectory_is_refused_without_one(action: str, capsys: pytest.CaptureFixture[str]) -> None:
    """It did nothing before, and said nothing of that."""
    assert main(["export", "results/any", "any.csv", action, "3"]) == 2
    assert capsys.readouterr().err == f"cosim: {action}: only with --trajectory, which is not there.\n"
