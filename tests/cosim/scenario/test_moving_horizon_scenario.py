"""The shipped scenario moving_horizon: what is false pulls least squares and a filter with gates, not the window."""

from __future__ import annotations

import numpy as np

from cosim import Scenario


def test_a_false_balise_and_a_sliding_wheel_do_not_pull_the_window():
    outcome = Scenario.load("moving_horizon").run(warn=lambda _text: None)
    assert outcome.failure is None
    assert all(judged.passed for judged in outcome.expectations)
    judged = outcome.result.time > 6.0
    off = {
        name: np.abs(outcome[f"{name}.position"] - outcome["train.position"])[judged].max()
        for name in ("moving_horizon", "squares", "ekf")
    }
    assert off["moving_horizon"] < 3.0
    assert off["squares"] > 20.0, "25 m, less what the readings hold against it"
    assert off["ekf"] > 20.0, "it takes the skid for an acceleration"
