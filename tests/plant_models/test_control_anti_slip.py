"""The anti-slip device: reference axle, cut and restoring slopes, sand, and its blindness."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from control_runs import Controller
from hypothesis import given
from hypothesis import strategies as st

from plant_models.railway.control import AntiSlipDevice

DEVICE = AntiSlipDevice()
PERIOD, THRESHOLD, SAND_SPEED, SAND_DEVIATION = 0.02, 2.0 / 3.6, 10.0 / 3.6, 10.0 / 3.6
SPEEDS = st.lists(st.floats(0.0, 30.0), min_size=4, max_size=4)


def axles(*speeds: float) -> dict[str, float]:
    return {f"axle_speed[{i + 1}]": v for i, v in enumerate(speeds)}


def device(*speeds: float, effort: float = 100e3, **changes: float) -> Controller:
    return Controller(DEVICE, start={**axles(*speeds), "effort_setpoint": effort}, **changes)


@given(speeds=SPEEDS, effort=st.sampled_from([-80e3, 0.0, 80e3]))
def test_the_reference_is_the_slowest_axle_in_traction_and_the_fastest_in_braking(
    speeds: list[float], effort: float
) -> None:
    out = device(*speeds, effort=effort).at(0.0)
    reference = max(speeds) if effort < 0.0 else min(speeds)
    assert out["reference_speed"] == reference
    assert [out[f"axle_slipping[{i}]"] for i in (1, 2, 3, 4)] == [float(abs(v - reference) > THRESHOLD) for v in speeds]


def test_the_axle_speeds_are_filtered_with_the_first_order_lag() -> None:
    watched = device(10.0, 10.0, 10.0, 10.0)
    watched.at(1.0)
    for k in range(1, 20):
        watched.at(1.0 + k * PERIOD, **axles(10.3, 10.3, 10.3, 10.3))
        expected = 10.3 - 0.3 * np.exp(-k * PERIOD / 0.1)
        assert watched.memory("filtered_speed[1]") == pytest.approx(expected, rel=1e-12)


def restored(elapsed: float, cut: float, break_point: float, fast: float, slow: float) -> float:
    """Share after `elapsed` seconds without slip, in closed form."""
    to_break = max(break_point - cut, 0.0) / fast
    return min(cut + fast * min(elapsed, to_break) + slow * max(elapsed - to_break, 0.0), 1.0)


@given(
    cut=st.floats(0.0, 0.9),
    break_share=st.floats(0.0, 1.0),
    fast=st.floats(0.1, 3.0),
    slow=st.floats(0.01, 0.5),
)
def test_the_effort_is_cut_and_restored_in_two_exact_slopes(
    cut: float, break_share: float, fast: float, slow: float
) -> None:
    changes = {
        "cut_share": cut,
        "break_share": break_share,
        "fast_restoring": fast,
        "slow_restoring": slow,
        "filter_time": 1e-4,
    }
    slipping = device(10.0, 10.0, 10.0, 11.0, **changes)
    out = slipping.at(0.0)
    assert out["effort"] == pytest.approx(cut * 100e3)
    cut = max(cut - 0.5 * 0.3, 0.0)
    assert slipping.at(0.5)["effort_share"] == pytest.approx(cut, abs=1e-12)  # and goes on falling while it slips
    for k in range(1, 60):
        share = slipping.at(0.5 + k * PERIOD, **axles(10.0, 10.0, 10.0, 10.0))["effort_share"]
        assert share == pytest.approx(restored(k * PERIOD, cut, break_share, fast, slow), abs=1e-12)


def test_a_second_slip_cuts_what_was_left_and_moves_the_break_point() -> None:
    slipping = device(10.0, 10.0, 10.0, 11.0, filter_time=1e-4)
    slipping.at(0.0)
    share = slipping.at(1.0, **axles(10.0, 10.0, 10.0, 10.0))["effort_share"]
    assert share == pytest.approx(0.3 + 0.5 * 1.0)
    again = slipping.at(1.02, **axles(10.0, 10.0, 10.0, 11.0))["effort_share"]
    assert again == pytest.approx(0.3 * share)
    assert slipping.memory("break_point") == pytest.approx(0.8 * share)


@pytest.mark.parametrize("speed", [SAND_SPEED - 0.5, SAND_SPEED + 0.5])
@pytest.mark.parametrize(
    "deviation", [THRESHOLD - 0.05, THRESHOLD + 0.05, SAND_DEVIATION - 0.05, SAND_DEVIATION + 0.05]
)
@pytest.mark.parametrize("effort", [100e3, -100e3])
def test_sand_is_requested_at_low_speed_in_slip_or_at_a_large_deviation(
    speed: float, deviation: float, effort: float
) -> None:
    sign = 1.0 if effort > 0.0 else -1.0
    out = device(speed, speed, speed + sign * deviation, speed, effort=effort).at(0.0)
    expected = (speed < SAND_SPEED and deviation > THRESHOLD) or deviation > SAND_DEVIATION
    assert bool(out["sanding_request"]) is expected


@given(speed=st.floats(3.0, 20.0), slip=st.floats(0.0, 10.0))
def test_it_is_blind_when_all_axles_slip_together(speed: float, slip: float) -> None:
    blind = device(*[speed] * 4)
    for k in range(1, 40):
        out = blind.at(k * PERIOD, **axles(*[speed + slip * k / 40.0] * 4))
    assert (out["effort"], out["sanding_request"]) == (100e3, 0.0)
    # The same run of one axle less is seen at once where it is beyond the threshold.
    seen = device(speed, speed + slip, speed + slip, speed + slip).at(0.0)
    assert (seen["effort"] < 100e3) is (slip > THRESHOLD)


@given(speeds=SPEEDS, effort=st.floats(-350e3, 350e3), steps=st.integers(1, 5))
def test_it_only_ever_takes_effort_away(speeds: list[float], effort: float, steps: int) -> None:
    out: dict[str, Any] = device(*speeds, effort=effort).at(steps * PERIOD)
    assert 0.0 <= out["effort_share"] <= 1.0
    assert out["effort"] == pytest.approx(out["effort_share"] * effort)
