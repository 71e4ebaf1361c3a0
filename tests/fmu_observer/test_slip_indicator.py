"""The slip indicator: threshold, filter, standstill and wheel lock."""

import numpy as np
import pytest
from observer_runner import SystemRunner

from fmu_observer.detection import SlipIndicator, indicator_level


def settled(odometer: float, speed: float, **parameters: float) -> dict[str, float]:
    runner = SystemRunner(SlipIndicator(), **parameters)
    runner.set("u", {"odometer": odometer, "speed": speed})
    runner.runtime.start(0.0)
    runner.runtime.advance(4.0)  # twenty filter time constants
    return runner.outputs()


@pytest.mark.parametrize(
    ("odometer", "speed", "level"),
    [
        (10.0, 9.81, 1.0),
        (10.0, 9.79, 2.0),
        (10.0, 10.21, 2.0),
        (10.0, 10.19, 1.0),
        (0.0, 10.0, 2.0),
        (0.0, 0.0, 1.0),
        (0.3, 0.1, 1.0),
    ],
)
def test_level_by_threshold_speed_and_lock(odometer: float, speed: float, level: float) -> None:
    assert settled(odometer, speed)["slip_indicator"] == level


def test_slip_output_is_not_filtered() -> None:
    runner = SystemRunner(SlipIndicator())
    runner.set("u", {"odometer": 10.0, "speed": 8.0})
    runner.runtime.start(0.0)
    assert runner.outputs()["slip"] == pytest.approx(0.2, abs=1e-15)
    assert runner.outputs()["slip_indicator"] == 1.0


def test_the_filter_is_first_order() -> None:
    runner = SystemRunner(SlipIndicator(), slip_filter_time=0.2)
    runner.set("u", {"odometer": 10.0, "speed": 9.0})
    runner.runtime.start(0.0)
    runner.runtime.advance(0.2)
    # closed form; RK4 at a step of 1/200 of the time constant leaves 1e-13
    assert runner.state("filtered_slip") == pytest.approx(0.1 * (1.0 - np.exp(-1.0)), abs=1e-12)


def test_a_chattering_odometer_does_not_chatter_the_indicator() -> None:
    runner = SystemRunner(SlipIndicator())
    runner.runtime.start(0.0)
    levels = []
    for k in range(2000):
        runner.set("u", {"odometer": 10.0 + 0.3 * (-1) ** k, "speed": 10.0})
        runner.runtime.advance((k + 1) * 0.001)
        levels.append(runner.outputs()["slip_indicator"])
    assert set(levels) == {1.0}  # the raw slip is 3 %, its filtered swing 0.01 %


def test_presets_carry_the_two_published_thresholds() -> None:
    system = SlipIndicator()
    assert system.preset_values("simulation")["slip_threshold"] == 0.02
    assert system.preset_values("experiment")["slip_threshold"] == 0.15


def test_level_over_a_batch() -> None:
    levels = indicator_level(
        np.array([0.03, 0.01, -0.03]), np.array([10.0, 10.0, 0.0]), np.array([9.0, 9.0, 0.0]), 0.02, 0.5
    )
    np.testing.assert_array_equal(levels, [2.0, 1.0, 1.0])
