"""Runs of a calibration that fail: the fit goes on without them, or ends in words."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from test_fmus.events import DEEDS, hostile_fmu

from cosim.calibration.fitting import Calibration, calibrate
from cosim.calibration.fmu_runs import FmuRuns
from cosim.calibration.job_runs import JobRuns
from cosim.calibration.recorded_signals import CalibrationError, RecordedSignals
from cosim.cli import main
from cosim.errors import CosimError
from cosim.runs.executors import InThisProcess
from cosim.runs.job import Job
from cosim.runs.journal import Journal, read_lines

TIME = np.linspace(0.0, 2.0, 21)
TRUE = 0.5


@dataclass(frozen=True, eq=False)
class Decay(Job):
    """``y = exp(-rate t)``, which fails between two rates."""

    settings: Mapping[str, float]
    fails: tuple[float, float]

    @property
    def key(self) -> str:
        return repr(sorted(self.settings.items()))

    def do(self) -> Any:
        low, high = self.fails
        if low < self.settings["rate"] < high:
            raise CosimError("it cannot decay like that.")
        return np.exp(-self.settings["rate"] * TIME)[None]


class DecayRuns(JobRuns):
    """Runs of it, in this process."""

    outputs = ("y",)

    def __init__(self, guess: float, *fails: float) -> None:
        super().__init__("decay", InThisProcess(), None)
        self.start, self.bounds, self._fails = {"rate": guess}, {}, fails

    def unit(self, name: str) -> str:
        return ""

    def job(self, values: Mapping[str, float], recorded: RecordedSignals) -> Decay:
        return Decay(values, self._fails)  # type: ignore[arg-type]


def calibrated(guess: float, *fails: float) -> Calibration:
    noise = 0.01 * np.random.default_rng(1).standard_normal(len(TIME))
    return calibrate(DecayRuns(guess, *fails), RecordedSignals(TIME, {"y": np.exp(-TRUE * TIME) + noise}))


@settings(max_examples=25)
@given(guess=st.floats(0.1, 4.0), limit=st.floats(-1.0, 0.47))
@example(guess=4.0, limit=0.4)
def test_where_runs_fail_does_not_change_what_is_found(guess: float, limit: float) -> None:
    """From a guess far above, the first steps lead below the limit."""
    whole, found = calibrated(max(guess, limit), -1e4, -1e3), calibrated(max(guess, limit), -1e4, limit)
    assert found.values["rate"] == pytest.approx(whole.values["rate"], rel=1e-6)
    assert found.intervals["rate"] == pytest.approx(whole.intervals["rate"], rel=1e-4)


def test_a_slope_of_one_side_serves_where_the_other_fails() -> None:
    found = calibrated(0.9, 0.9, 0.95)
    assert found.values["rate"] == pytest.approx(TRUE, abs=0.02)
    assert f"1 of {found.fit.runs} runs failed and were left out, the first with rate = 0.90009: it cannot" in str(
        found
    )


def test_a_fit_that_cannot_go_on_says_where_it_stands() -> None:
    class Islands(DecayRuns):
        def job(self, values: Mapping[str, float], recorded: RecordedSignals) -> Decay:
            return Decay(values, (-9.0, 9.0) if values["rate"] != 0.9 else (8.0, 9.0))

    with pytest.raises(
        CalibrationError, match=r"ended at rate = 0\.9: runs with rate a little above .* it cannot decay"
    ):
        calibrate(Islands(0.9), RecordedSignals(TIME, {"y": np.exp(-TRUE * TIME)}))


def test_first_guesses_that_fail_are_refused_with_the_reason() -> None:
    with pytest.raises(CalibrationError, match=r"cannot begin with these first guesses.*rate = 0\.5: it cannot decay"):
        calibrated(0.5, 0.4, 0.6)


# -- a sealed FMU that harms its process


@pytest.fixture(scope="module")
def fmu(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return hostile_fmu(tmp_path_factory.mktemp("hostile"))


def points(*deeds: str) -> list[dict[str, float]]:
    return [{"deed": float(DEEDS.index(deed))} for deed in deeds]


@pytest.mark.compiler
@pytest.mark.skipif(not hasattr(os, "fork"), reason="the crash is a signal")
def test_a_run_that_ends_its_process_or_hangs_fails_alone(fmu: Path, tmp_path: Path) -> None:
    recorded = RecordedSignals(np.arange(0.0, 0.55, 0.1), {"y": np.zeros(6)})
    deeds = points("nothing", "crashes", "hangs", "exits-at-once", "nothing")
    for resume in (False, True):
        journal = Journal(tmp_path, resume=resume)
        runs = FmuRuns(fmu, ["deed"], call_timeout=0.3, journal=journal)
        found = runs.run_all(deeds, recorded)
        runs.close()
        assert np.isfinite(found).all(axis=(1, 2)).tolist() == [True, False, False, False, True]
        assert found[0, 0] == pytest.approx(np.arange(0.0, 0.55, 0.1))
        where = "component 'hostile' in doStep at t = 0.2 s"
        assert runs.failures == [
            f"deed = 3: {where}: its process was ended by the signal SIGSEGV",
            f"deed = 4: {where} has not returned for 0.3 s, the limit of a call, which call_timeout sets",
            f"deed = 2: {where}: its process ended with exit code 0",
        ]
        assert len(read_lines(journal.path)) == 5  # a resumed one runs nothing again


@pytest.mark.compiler
@pytest.mark.skipif(not hasattr(os, "fork"), reason="the crash is a signal")
def test_the_command_ends_in_words(fmu: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table = tmp_path / "run.csv"
    np.savetxt(table, np.c_[TIME, TIME], delimiter=",", header="time,y", comments="")
    words = ["calibrate", str(fmu), str(table), "--parameters", "deed=3", "--out", str(tmp_path / "out")]
    assert main(words) == 2
    said = capsys.readouterr().err
    assert "The fit cannot begin with these first guesses" in said
    assert "deed = 3: component 'hostile' in doStep at t = 0.2 s: its process was ended by the signal SIGSEGV" in said
    assert len(read_lines(tmp_path / "out" / "runs.jsonl")) == 1
    assert main([*words[:4], "deed=0", *words[5:]]) == 2
    assert "deed: changes nothing in y" in capsys.readouterr().err
