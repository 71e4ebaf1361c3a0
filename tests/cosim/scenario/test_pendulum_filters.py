"""The pendulum on a cart beside both filters: they agree, and their covariances fit."""

import numpy as np
import pytest

from cosim import Scenario

pytestmark = pytest.mark.compiler


def test_both_filters_are_consistent_and_equal_at_one_millisecond() -> None:
    scenario = Scenario.load("pendulum_filters")
    outcome = scenario.run(warn=lambda _text: None)
    assert outcome.failure is None
    assert all(judged.passed for judged in outcome.expectations)
    found = {(c["observer"], c["quantity"]): c for c in outcome.result.summary["consistency"]}
    assert {found[name, "NIS"]["verdict"] for name in ("ekf", "ukf")} == {"consistent"}
    assert not [w for w in outcome.result.summary["warnings"] if "confident" in w]
    states = ("position", "speed", "angle", "rate")
    squares = [
        sum(float(np.mean(np.square(outcome[f"{name}.{s}"] - outcome[f"plant.{s}"]))) for s in states)
        for name in ("ekf", "ukf")
    ]
    assert squares[1] == pytest.approx(squares[0], rel=0.02)  # the claim of the thesis is not seen at this rate
