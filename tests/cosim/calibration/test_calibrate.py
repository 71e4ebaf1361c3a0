"""Calibrated FMUs: parameters inside their regions, what cannot be told apart, and the command."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import cosim
import fmus
from cosim.calibration.fitting import calibrate
from cosim.calibration.fmu_runs import FmuRuns
from cosim.calibration.recorded_signals import RecordedSignals
from cosim.calibration.scenario_runs import ScenarioRuns
from cosim.cli import main
from cosim.errors import CosimError
from cosim.runs.journal import Journal, read_lines
from plant_models import PLANTS

TRUE = {"mass": 80e3, "davis_a": 1800.0, "davis_b": 80.0, "davis_c": 7.0}
GUESS = {"mass": 76e3, "davis_a": 1600.0, "davis_b": 90.0, "davis_c": 6.0}
FIXED = {"traction_coefficient": 1.0, "brake_coefficient": 1.0, "internal_step": 0.1, "train_speed": 3.0}
NOISE = 0.05  # [m/s]
TIME = np.arange(0.0, 200.5, 1.0)
EFFORT = np.where(TIME < 80, 60e3, np.where(TIME < 140, 0.0, np.where(TIME < 180, 40e3, -20e3)))


@pytest.fixture(scope="module")
def path() -> Path:
    return fmus.cached_fmu(PLANTS["longitudinal_train"](), fmi_version=3)


@pytest.fixture(scope="module")
def runs(path: Path) -> Iterator[FmuRuns]:
    made = FmuRuns(path, list(TRUE), fixed=FIXED, guesses=GUESS)
    yield made
    made.close()


@pytest.fixture(scope="module")
def speed(runs: FmuRuns) -> np.ndarray:
    return np.asarray(runs.run(TRUE, recorded(np.zeros_like(TIME)))[0])


def recorded(speed: np.ndarray) -> RecordedSignals:
    return RecordedSignals(TIME, {"speed": speed}, {"effort": EFFORT}, {"speed": "m/s"})


@pytest.fixture
def table(tmp_path: Path, speed: np.ndarray) -> Path:
    noisy = speed + NOISE * np.random.default_rng(1).standard_normal(len(TIME))
    path = tmp_path / "run.csv"
    np.savetxt(path, np.c_[TIME, EFFORT, noisy], delimiter=",", header="time,train.effort,train.speed", comments="")
    return path


def test_parameters_lie_in_their_regions(runs: FmuRuns, speed: np.ndarray) -> None:
    joint = singles = 0
    members = 5  # the study of 500 is in docs/studies
    for member in range(members):
        noise = NOISE * np.random.default_rng([2026, member]).standard_normal(len(TIME))
        found = calibrate(runs, recorded(speed + noise))
        assert found.identified
        joint += found.fit.covers(np.array(list(TRUE.values())), 0.95)
        singles += sum(low <= TRUE[name] <= high for name, (low, high) in found.intervals.items())
    assert joint >= members - 2  # of 5 regions that cover in 95 % of cases, 3 or more miss once in 860 tries
    assert singles >= 4 * members - 5


def test_exact_recording_gives_exact_parameters(runs: FmuRuns, speed: np.ndarray) -> None:
    found = calibrate(runs, recorded(speed), noise={"speed": NOISE})
    for name, value in found.values.items():
        assert value == pytest.approx(TRUE[name], rel=1e-6)  # least squares end at 1e-8 of the cost


def test_a_ratio_is_named(path: Path) -> None:
    part = slice(0, 40)  # traction only, and resistance known by mass: effort and mass act as one
    fixed = FIXED | {"davis_a": 0.0, "davis_b": 0.0, "davis_c": 0.0}
    made = FmuRuns(
        path,
        ["mass", "traction_coefficient"],
        fixed={k: v for k, v in fixed.items() if k != "traction_coefficient"},
        guesses={"mass": 76e3, "traction_coefficient": 1.0},
    )
    short = RecordedSignals(TIME[part], {"speed": np.zeros(40)}, {"effort": EFFORT[part]}, {"speed": "m/s"})
    simulated = made.run({"mass": 80e3, "traction_coefficient": 1.0}, short)[0]
    noisy = simulated + NOISE * np.random.default_rng(3).standard_normal(40)
    found = calibrate(made, RecordedSignals(short.time, {"speed": noisy}, short.inputs, short.units))
    made.close()
    assert not found.identified
    assert any("only the ratio of mass and traction_coefficient is identified" in h.text for h in found.hidden)


def coasting() -> cosim.Scenario:
    """A train that only its resistance slows down."""
    known = {"mass": 80e3, "train_speed": 20.0, "traction_coefficient": 1.0}
    values = known | {name: TRUE[name] for name in ("davis_a", "davis_b", "davis_c")}
    return cosim.Scenario(stop=40.0, step=0.5).add("train", model="longitudinal_train", parameters=values)


def recorded_journey() -> RecordedSignals:
    truth = coasting().run()
    noisy = truth["train.speed"] + 0.01 * np.random.default_rng(0).standard_normal(len(truth.result.time))
    return RecordedSignals(truth.result.time, {"train.speed": noisy}, {}, {"train.speed": "m/s"})


def test_scenarios_are_calibrated_too() -> None:
    found = calibrate(ScenarioRuns(coasting(), ["train.davis_a"], {"train.davis_a": 1500.0}), recorded_journey())
    low, high = found.intervals["train.davis_a"]
    assert low < TRUE["davis_a"] < high


def test_workers_and_a_resumed_calibration_find_equal_values(tmp_path: Path) -> None:
    """To the bit; what stands in the journal is not run again."""
    found = []
    for workers, resume in ((1, False), (2, False), (1, True)):
        journal = Journal(tmp_path, resume=resume)
        before = len(read_lines(journal.path)) if resume else 0
        runs = ScenarioRuns(coasting(), ["train.davis_a"], {"train.davis_a": 1500.0}, workers=workers, journal=journal)
        found.append(calibrate(runs, recorded_journey()))
        runs.close()
        assert len(read_lines(journal.path)) > before or resume
        assert not resume or len(read_lines(journal.path)) == before
    assert found[0].to_dict() == found[1].to_dict() == found[2].to_dict()


def test_a_run_that_fails_is_named_with_its_values() -> None:
    runs = ScenarioRuns(coasting(), ["train.mass"])
    with pytest.raises(CosimError, match=r"a run of the calibration failed, with train\.mass = -1: .*mass"):
        runs.run({"train.mass": -1.0}, recorded_journey())


def words(path: Path, table: Path, *more: str) -> list[str]:
    """The effort of this table is held from row to row, which a table does not say by itself."""
    settings = [word for name, value in FIXED.items() for word in ("--set", f"{name}={value}")]
    return ["calibrate", str(path), str(table), "--between", "effort=hold", *settings, *more]


GUESSES = [f"{name}={value}" for name, value in GUESS.items()]


def test_command(path: Path, table: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files = ["--toml", str(tmp_path / "p.toml"), "--plot", str(tmp_path / "fit.png")]
    assert main(words(path, table, "--parameters", *GUESSES, *files)) == 0
    said = capsys.readouterr().out
    assert "95 % interval" in said
    assert re.search(r"^speed +\S+ +m/s ", said, re.MULTILINE), said  # the table says no unit, the FMU does
    values = tomllib.loads((tmp_path / "p.toml").read_text())["parameters"]
    assert values["mass"] == pytest.approx(80e3, rel=0.01)
    assert (tmp_path / "fit.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("more", "reported"),
    [
        (["--parameters", "adhesion_at_rest"], "changes nothing in speed"),
        (["--parameters", "mas"], "did you mean 'mass'"),
        (["--parameters", "speed"], "cannot be set"),
        (["--parameters", "mass", "mass=1"], "each once"),
        (["--parameters", "mass", "--signals", "position"], "was not recorded"),
        (["--parameters", "mass", "--signals", "speed=train.sped"], "did you mean 'train.speed'"),
        (["--parameters", "mass", "--signals", "sped"], "did you mean 'speed'"),
        (["--parameters", "mass", "--from", "1e6"], "fewer than two samples"),
        (["--parameters", "mass", "--noise", "speed=0"], "above 0"),
        (["--parameters", "mass", "--level", "2"], "between 0 and 1"),
    ],
)
def test_mistakes_are_reported(
    path: Path, table: Path, more: list[str], reported: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(words(path, table, *more)) == 2
    said = capsys.readouterr().err
    assert reported in said
    assert said.count(f"{path}:") <= 1
