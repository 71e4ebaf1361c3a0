"""A distance that is counted between two communication points: told before the run, and only where it is wrong."""

from __future__ import annotations

import numpy as np
import pytest

import cosim

WORDS = "no whole number of steps"


def odometer(step: float, count: str = "wheel_distance", inputs: str = "hold") -> tuple[list[str], float]:
    """Warnings of a run at a steady speed of 30 m/s, and the largest error of a reading [m/s]."""
    scenario = cosim.Scenario(stop=6.0, step=step)
    scenario.set("master.inputs", inputs)
    free = dict.fromkeys(("davis_a", "davis_b", "davis_c"), 0.0)
    scenario.add("train", model="longitudinal_train", parameters={"train_speed": 30.0, **free})
    scenario.add("wheel", model="wheel_fault", options={"cause": "stated", "fault_count": 1})
    scenario.add("odometer", model="pulse_odometer", options={"count_from": count}, parameters={"teeth": 1e5})
    scenario.connect("train.wheel_speed -> wheel.speed", "wheel.wheel_speed -> odometer.wheel_speed")
    scenario.set("wheel.fault_onset", [1e3])
    if count == "wheel_distance":
        scenario.connect("wheel.wheel_distance -> odometer.wheel_distance")
    warnings: list[str] = []
    run = scenario.run(warn=warnings.append)
    wrong = np.abs(run["odometer.reading"] - run["train.speed"])[run.result.time > 1.0].max()
    return [text for text in warnings if WORDS in text], float(wrong)


@pytest.mark.parametrize("step", [0.03, 0.08, 0.15, 0.3])
def test_a_period_that_ends_between_points_is_reported(step: float) -> None:
    reported, wrong = odometer(step)
    assert len(reported) == 1
    assert "odometer: reading counts wheel_distance every 0.2 s (aggregation_period)" in reported[0]
    assert wrong > 1.0  # of 30 m/s: what the text is about


@pytest.mark.parametrize(("step", "count"), [(0.05, "wheel_distance"), (0.2, "wheel_distance"), (0.03, "wheel_speed")])
def test_nothing_is_reported_where_the_reading_is_right(step: float, count: str) -> None:
    reported, wrong = odometer(step, count)
    assert not reported
    assert wrong < 0.1
