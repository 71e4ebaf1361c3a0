"""An FMU that ended a process gets one of its own from then on, known by its content, until somebody says otherwise."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from test_fmus.events import DEEDS, hostile_fmu

from cosim import Scenario
from cosim.runs.run import Run
from cosim.runs.workers import Team
from fmus.isolation import crashes
from plant_models.disk_cache.files import file_digest

pytestmark = [pytest.mark.compiler, pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="Linux")]


@pytest.fixture
def fmu(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("FMU_OBSERVER_CACHE", str(tmp_path / "cache"))
    return hostile_fmu(tmp_path)


def hostile(fmu: Path, deed: str, **master: Any) -> Scenario:
    scenario = Scenario(stop=0.5, step=0.01, master=master)
    return scenario.add("bad", fmu=str(fmu), parameters={"deed": float(DEEDS.index(deed))})


def remembered(fmu: Path) -> str:
    return crashes.noted_crash(file_digest(fmu))


def test_a_study_remembers_what_killed_a_worker_and_its_next_run_is_isolated(fmu: Path, tmp_path: Path) -> None:
    with Team(1) as team:
        ((_, ended),) = team.each([Run(hostile(fmu, "crashes"))])
        assert "ended by the signal SIGSEGV" in ended.failure.reason
        assert "component 'bad' in doStep at t = 0.24 s" in remembered(fmu)
        ((_, ended),) = team.each([Run(hostile(fmu, "crashes"))])
    assert "its process ended with SIGSEGV in fmi2DoStep" in ended.failure.reason
    assert len(ended.row.result.table) == 25
    copy = Path(shutil.copy(fmu, tmp_path / "renamed.fmu"))
    outcome = hostile(copy, "crashes").run(warn=lambda _: None)  # of this very process, which goes on
    assert "SIGSEGV" in str(outcome.failure)
    notes = " ".join(outcome.result.summary["notes"])
    assert "bad gets a process of its own, since its file ended one before: its process ended with SIGSEGV" in notes


def test_the_watch_remembers_and_a_stop_from_outside_is_not_remembered(fmu: Path, tmp_path: Path) -> None:
    path = hostile(fmu, "hangs", call_timeout=0.5).save(tmp_path / "scenario.toml")
    command = [sys.executable, "-m", "cosim.cli", "run", str(path), "--out", "out", "--no-report", "--quiet"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "has not returned for 0.5 s" in remembered(fmu)


def test_an_isolated_one_that_dies_is_remembered_and_one_that_lives_is_not(fmu: Path) -> None:
    assert hostile(fmu, "nothing", isolate="component").run(warn=lambda _: None).failure is None
    assert remembered(fmu) == ""
    hostile(fmu, "exits", isolate="component").run(warn=lambda _: None)
    assert "exit code 0 in fmi2DoStep" in remembered(fmu)
    assert not any("process of its own" in note for note in _notes(fmu, isolate="no"))
    assert any("process of its own" in note for note in _notes(fmu))


def _notes(fmu: Path, **master: Any) -> list[str]:
    notes: list[str] = hostile(fmu, "nothing", **master).run(warn=lambda _: None).result.summary["notes"]
    return notes


def test_what_is_no_digest_is_nowhere(fmu: Path) -> None:
    crashes.note_crash("../outside", "x")
    assert not (fmu.parent / "cache" / "outside").exists()
