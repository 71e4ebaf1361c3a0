"""False telegrams in a run: what is ignored is told, bad input is refused by name, and the study comes out again."""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from cosim import Scenario
from cosim.errors import CosimError
from cosim.run.executed import _doubted

STUDIES = Path(__file__).resolve().parents[3] / "docs" / "studies"
OBSERVER = "takagi_sugeno_cdo"


def scenario(**parameters: float) -> Scenario:
    """A train with S2 as a block, and one false telegram of 100 m among balises 5 m apart."""
    s = Scenario(stop=14.0, step=0.02, certificates="ignore")
    s.add("train", model="locomotive", preset="chapter_3_four_axles")
    s.add("driver", model="driver")
    s.add("observer", observer=OBSERVER, parameters={"n_axles": 4, "davis_b": 32.0, "davis_c": 1.7, **parameters})
    s.connect(
        "driver.effort -> train.effort, observer.effort", "train.wheel_speed -> driver.odometer, observer.odometer"
    )
    false: Any = [{"time": 10.0, "offset": 100.0}]
    s.balises(
        position="train.position",
        speed="train.speed",
        layout="spacing",
        spacing=5.0,
        track_end=500.0,
        false_telegrams=false,
    )
    return s


@pytest.mark.parametrize(("gate", "outcome"), [(2.0, "ignored"), (1.0, "doubted"), (0.0, "accepted")])
def test_a_false_telegram_is_recognised_by_its_outcome(gate: float, outcome: str) -> None:
    run, clean = (
        s.run(warn=lambda _text: None)
        for s in (scenario(gate=gate), scenario(gate=gate).set("balises.false_telegrams", []))
    )
    (false,) = [e for e in run.result.events if e.kind == "false"]
    assert false.outcomes == {"observer": outcome}
    assert {e.outcomes["observer"] for e in run.result.events if e.kind == "true"} == {"accepted"}
    at_once = float(run["observer.speed"][run["time"] <= 10.2][-1] - clean["observer.speed"][clean["time"] <= 10.2][-1])
    assert (abs(at_once) < 1e-9) == (outcome == "ignored")
    said = [text for text in run.warnings if "doubted" in text]
    assert said == ([] if gate == 0.0 else [said[0]])
    became = {"doubted": "used"}.get(outcome, outcome)
    assert all(text.startswith(f"observer doubted 1 telegram: 1 {became} (stamped 10 s); see") for text in said)
    (counts,) = [c["events"] for c in run.result.summary["components"] if c["name"] == "observer"]
    assert counts["doubted"] == (outcome == "doubted")
    assert counts["ignored"] == (outcome == "ignored")


def test_what_was_doubted_is_reported_once_with_what_became_of_it() -> None:
    outcomes = ["doubted", "accepted", "ignored", "doubted", "doubted", "doubted"]
    telegrams: Any = [SimpleNamespace(stamp=float(i), outcomes={"obs": o}) for i, o in enumerate(outcomes)]
    assert list(_doubted("obs", telegrams)) == [
        "obs doubted 5 telegrams: 4 used (stamped 0 s, 3 s, 4 s, 5 s), 1 ignored (stamped 2 s); see "
        "docs/theses/telegram_gate.md."
    ]
    assert list(_doubted("other", telegrams)) == []


@pytest.mark.parametrize(
    ("name", "value"), [("gate_floor", 0.0), ("gate_floor", -1.0), ("gate_drift", -0.1), ("gate_floor", np.inf)]
)
def test_a_gate_that_cannot_be_is_refused_by_name(name: str, value: float) -> None:
    with pytest.raises(CosimError, match=rf"observer.*{name}"):
        scenario(**{name: value}).run(warn=lambda _text: None)


def study_of(name: str) -> Any:
    """A study of the pages, which leaves no trace among the modules."""
    sys.path.insert(0, str(STUDIES))
    try:
        return import_module(name)
    finally:
        sys.path.remove(str(STUDIES))
        for known in (name, "telegram_gate"):
            sys.modules.pop(known, None)


def test_a_part_of_the_study_comes_out_again() -> None:
    study = study_of("telegram_gate")
    telegrams = study.follow(OBSERVER, study.record("wet", stop=120.0), 100.0, 0.5, "wrong")
    assert len(telegrams) > 30
    assert study.ignored_true(telegrams) == 0.0
    assert np.interp((1.0, 100.0), study.OFFSETS, study.accepted_false(telegrams)).tolist() == [1.0, 0.0]


def test_a_journey_that_no_threshold_saw_comes_out_again() -> None:
    """Of the second table: nothing true is ignored, though slopes are not told and the model is wrong."""
    study = study_of("telegram_gate_journeys")
    journey = study.draw_journey(5)
    laid = study.lay(journey, 300.0)
    for name in ("odometer_reset", "quasi_lpv_uio"):
        telegrams = study.follow(name, journey, 300.0, "wrong", laid)
        assert len(telegrams) > 15
        assert study.ignored_true(telegrams) == 0.0
        assert float(np.interp(100.0, study.OFFSETS, study.accepted_false(telegrams))) < 0.05
