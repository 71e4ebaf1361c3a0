"""LAW: within the stated limits the train is inside its interval; and what becomes of it where a limit is broken."""

from __future__ import annotations

import sys
from importlib import util
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from observer_runner import SystemRunner

from fmu_observer.formulas.intervals import Interval, intersection_or_hull, meet, relaxed_intersection
from fmu_observer.observers.train import IntervalOdometry

STUDY = Path(__file__).parents[2] / "docs" / "studies" / "interval_odometry.py"


def loaded() -> Any:
    spec = util.spec_from_file_location("interval_odometry_study", STUDY)
    assert spec is not None
    assert spec.loader is not None
    module = util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


study = loaded()


@pytest.mark.parametrize("rail", ["dry", "wet"])
@pytest.mark.parametrize("seed", [0, 1, 2, 3])
def test_the_train_is_inside_in_runs_within_the_limits(seed: int, rail: str) -> None:
    found = study.observe(study.drive(seed, rail), 700.0, rail, seed=seed)
    assert (found.outside, found.broken) == (0, 0)
    assert found.rows == 3000
    assert 0.1 < found.half / found.allowed < 0.6  # an interval that says something


def test_a_wider_limit_gives_no_narrower_interval() -> None:
    journey = study.drive(0, "dry", lies=0)
    narrow = study.observe(journey, 700.0, "dry")
    for limit, value in {"wheel_error": 0.02, "odometer_error": 0.2, "gradient_max": 0.01, "creep": 0.03}.items():
        assert study.observe(journey, 700.0, "dry", **{limit: value}).half > narrow.half, limit


@pytest.mark.parametrize(("limit", "value"), [("wheel_error", 0.0), ("odometer_error", 0.0)])
def test_a_limit_that_the_train_does_not_keep_is_seen(limit: str, value: float) -> None:
    """Seed 1 lies at the ends of all limits."""
    found = study.observe(study.drive(1, "dry", lies=0), 700.0, "dry", seed=1, **{limit: value})
    assert found.outside + found.too_fast > 0


def rolling(**parameters: float) -> SystemRunner:
    runner = SystemRunner(IntervalOdometry(), **parameters)
    runner.set("u", {"odometer": 20.0})
    runner.runtime.start(0.0)
    runner.runtime.advance(5.0)
    return runner


def test_a_group_far_away_is_kept_as_a_possibility_and_told() -> None:
    runner = rolling()
    before = runner.outputs()
    runner.balise(5000.0)
    found = runner.outputs()
    assert (found["broken"], found["broken_count"]) == (2.0, 1.0)
    assert found["min_safe_front_end"] == pytest.approx(before["min_safe_front_end"], abs=1e-9)
    assert found["max_safe_front_end"] == pytest.approx(5001.0, abs=1e-9)


def test_an_odometer_that_lies_for_longer_than_it_can_is_told() -> None:
    runner = rolling(longest_lie=3.0)
    runner.set("u", {"odometer": 0.0})
    runner.runtime.advance(7.0)
    assert runner.outputs()["broken"] == 0.0
    assert runner.outputs()["odometer_possible"] == 0.0
    runner.runtime.advance(8.5)
    found = runner.outputs()
    assert (found["broken"], found["broken_count"]) == (1.0, 1.0)
    assert found["min_speed"] < 0.1
    assert found["max_speed"] > 19.0


def test_a_train_stands_for_ten_minutes_and_departs() -> None:
    runner = rolling()
    runner.set("u", {"odometer": 0.0, "effort": -6e5})  # 90 t stop in a moment
    runner.runtime.advance(40.0)
    stopped = runner.outputs()
    runner.runtime.advance(640.0)
    found = runner.outputs()
    assert found == {**stopped, "odometer_possible": 1.0}
    assert found["max_speed"] == found["min_speed"] == 0.0
    runner.set("u", {"effort": 1e5})
    runner.runtime.advance(640.1)  # it departs before the next reading
    possible = (1e5 - 2e3) / 90e3 * 0.1  # less than 2 kN of resistance
    assert runner.outputs()["min_speed"] <= 0.0 < possible < runner.outputs()["max_speed"]
    runner.set("u", {"odometer": 1.0})
    runner.runtime.advance(650.0)
    found = runner.outputs()
    late = 0.5 * 1e5 * 1.03 / (90e3 * 0.97)  # the third best of the readings is .4 s old, the next one .2 s away
    assert found["min_speed"] < 1.0 < found["max_speed"] < 1.05 / 0.99 + late
    assert found["broken"] == stopped["broken"]


ends = st.tuples(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3)).map(lambda e: Interval(min(e), max(e)))


@given(ends, ends)
def test_of_two_intervals_what_is_common_or_everything_between(a: Interval, b: Interval) -> None:
    found = intersection_or_hull(a, b)
    if meet(a, b):
        assert (found.low, found.high) == (max(a.low, b.low), min(a.high, b.high))
    else:
        assert (found.low, found.high) == (min(a.low, b.low), max(a.high, b.high))


@given(st.lists(st.tuples(ends, st.booleans()), min_size=3, max_size=8), st.floats(-1e3, 1e3), st.integers(0, 2))
def test_what_all_but_some_have_in_common_holds_the_truth(members: list[Any], truth: float, wrong: int) -> None:
    """However many do not count: if no more than so many of those that count miss the truth, it is inside."""
    intervals, counts = zip(*members, strict=True)
    lows, highs = (np.array([getattr(i, end) for i in intervals]) for end in ("low", "high"))
    flags = np.array(counts, dtype=float)
    found = relaxed_intersection(Interval(lows, highs), flags, wrong)
    missed = sum(flag and not low <= truth <= high for low, high, flag in zip(lows, highs, flags, strict=True))
    if missed <= wrong:
        assert found.low <= truth <= found.high
    counted = sorted(lows[flags > 0.0], reverse=True)
    if len(counted) > wrong:
        assert found.low == counted[wrong]
