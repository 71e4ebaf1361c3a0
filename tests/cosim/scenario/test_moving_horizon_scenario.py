"""The shipped scenario moving_horizon: what a false telegram does to a window and to a filter's gate, by its place."""

from __future__ import annotations

import numpy as np

from cosim import Scenario
from cosim.run.outcome import Outcome

WINDOW, SQUARES, FILTER = "moving_horizon", "squares", "ekf"


def _run(*times: float) -> Outcome:
    reported = [{"time": time, "offset": 25.0} for time in times]
    outcome = Scenario.load("moving_horizon").run(
        warn=lambda _text: None, overrides={"balises.false_telegrams": reported}
    )
    assert outcome.failure is None
    return outcome


def _off(outcome: Outcome, name: str, start: float = 6.0, end: float = 90.0) -> float:
    evaluated = (outcome.result.time > start) & (outcome.result.time < end)
    return float(np.abs(outcome[f"{name}.position"] - outcome["train.position"])[evaluated].max())


def test_the_third_balise_is_refused_by_gate_and_window() -> None:
    outcome = _run(40.0)
    assert all(evaluated.passed for evaluated in outcome.expectations)
    assert _off(outcome, WINDOW) < 3.0
    assert _off(outcome, FILTER) < 3.0
    assert _off(outcome, SQUARES) > 15.0, "25 m, less what the readings hold against it"


def test_a_false_balise_before_the_gate_is_open_pulls_the_filter_and_not_the_window() -> None:
    outcome = _run(30.0)
    assert _off(outcome, WINDOW) < 3.0
    assert _off(outcome, FILTER, end=29.9) < 3.0, "the skid from 12 s to 14 s does not pull it"
    assert _off(outcome, FILTER, 30.0, 35.0) > 15.0, "the second telegram, before the gate judges"


def test_a_false_balise_after_that_pulls_neither() -> None:
    outcome = _run(60.0)
    assert _off(outcome, WINDOW) < 3.0
    assert _off(outcome, FILTER) < 3.0
    assert _off(outcome, SQUARES) > 10.0


def test_a_false_balise_that_comes_first_pulls_both_until_two_agree_against_it() -> None:
    outcome = _run(8.0)
    assert _off(outcome, FILTER) > 20.0 > _off(outcome, FILTER, 65.0)
    assert _off(outcome, WINDOW) > 20.0
    assert _off(outcome, WINDOW, 40.0) < 3.0
    assert outcome[f"{WINDOW}.restarts"][-1] == 1.0
