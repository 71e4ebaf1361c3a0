"""What a step says against the standard or the description: counted, reported by the run and by the check, by both
steppers.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from test_fmus.events import awkward_fmu

import cosim
from fmus.check import Verdict, check_fmu

pytestmark = pytest.mark.compiler

UNDECLARED = "an early return without mightReturnEarlyFromDoStep 20 times, first at t = 0 s"
WORDS: dict[str, tuple[dict[str, Any], str]] = {
    "overshoots": ({}, "a time beyond the end of the step, without an early return 7 times, first at t = 0.3 s"),
    "short": (
        {"declares_early": False},
        "an early return without mightReturnEarlyFromDoStep 20 times, first at t = 0 s",
    ),
    "cries": ({}, "an event without hasEventMode once at t = 0.2 s"),
}


@pytest.mark.parametrize("stepper", ["python", "compiled"])
@pytest.mark.parametrize("behaviour", WORDS)
def test_a_run_says_what_its_steps_must_not_say(tmp_path: Path, behaviour: Any, stepper: str) -> None:
    """And goes where it was asked to go."""
    more, words = WORDS[behaviour]
    fmu = awkward_fmu(tmp_path, behaviour, at=0.25, **more)
    scenario = cosim.Scenario(stop=1.0, step=0.1)
    scenario.set("master.stepper", stepper)
    scenario.add("awkward", fmu=str(fmu))
    result = scenario.run().result
    assert result.table["awkward.y"] == pytest.approx(result.time)
    warning = f"awkward said in doStep what it must not, and the run went on: {words}."
    assert [text for text in result.summary["warnings"] if "must not" in text] == [warning]


@pytest.mark.parametrize("behaviour", WORDS)
def test_the_check_knows_it_too(tmp_path: Path, behaviour: Any) -> None:
    more, words = WORDS[behaviour]
    finding = check_fmu(awkward_fmu(tmp_path, behaviour, at=0.25, **more), step=0.1).finding("word of steps")
    assert finding.verdict is Verdict.LIMIT
    assert words.partition(" 20 ")[0].partition(" 7 ")[0].partition(" once")[0] in finding.detail


def test_an_early_return_that_is_declared_is_no_contradiction(tmp_path: Path) -> None:
    fmu = awkward_fmu(tmp_path, "short")
    assert check_fmu(fmu, step=0.1).finding("word of steps").verdict is Verdict.PASS
