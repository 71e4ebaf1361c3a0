"""`fmus check` steps a model exchange FMU by the solver of runs: what a run meets is found, and honest ones pass."""

from __future__ import annotations

from pathlib import Path

import pytest
from lying_fmus import STATES, build, description
from test_fmus.exchange import exchange_fmu

from fmus.check import CheckReport, Class, Verdict, check_fmu
from fmus.check.run import check_count

pytestmark = pytest.mark.compiler


def checked(folder: Path, model: str, version: int = 2) -> CheckReport:
    return check_fmu(exchange_fmu(folder, model, version), step=0.01)


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("model", ["DECAY", "TRAIN", "STEPS", "OSCILLATES"])
def test_what_a_run_can_step_is_used_as_it_is(tmp_path: Path, model: str, version: int) -> None:
    report = checked(tmp_path, model, version)
    assert [(finding.check, finding.detail) for finding in report.limits] == []
    assert report.verdict is Class.USE
    assert report.finding("stepping").detail.startswith("50 steps of 0.01 s")
    assert report.finding("interface").verdict is Verdict.NOTE
    assert "by the solver that runs use" in report.finding("interface").detail
    assert "Rollback: yes" in " ".join(report.trust)


@pytest.mark.parametrize(
    ("model", "check", "verdict", "words"),
    [
        ("BALL", "long run", Class.LIMITS, "events do not settle at t = 2.55"),
        ("ESCAPES", "long run", Class.LIMITS, "the solver (CVODE) gives up at t = 0.99"),
        ("CHATTERS", "stepping", Class.DISTRUST, "events do not settle at t = 0.25 s"),
    ],
)
def test_what_a_run_meets_is_found_by_its_steps(
    tmp_path: Path, model: str, check: str, verdict: Class, words: str
) -> None:
    report = checked(tmp_path, model)
    assert report.verdict is verdict
    assert words in report.finding(check).detail


@pytest.mark.parametrize(
    ("lie", "check"),
    [
        ("NAN_DERIVATIVE", "stepping"),
        ("STATES_NOT_SET", "model exchange: states"),
        ("RESET_KEEPS", "reset and re-run"),
        ("CRASH_FREED", "terminate and free"),
        ("LEAKS_FILES", "repeated instantiation"),
    ],
)
def test_lies_of_one_without_co_simulation_are_found(tmp_path: Path, lie: str, check: str) -> None:
    report = check_fmu(build(tmp_path, lie, xml=description(None, STATES)))
    assert report.finding(check).verdict.rank >= Verdict.LIMIT.rank
    assert not report.clean


def test_the_count_of_checks_bounds_what_is_begun(tmp_path: Path) -> None:
    begun: list[str] = []
    report = check_fmu(exchange_fmu(tmp_path, "DECAY"), step=0.01, progress=begun.append)
    assert len(begun) <= check_count(report.archive) <= len(begun) + 2
