"""The driver: profile, limits, anti-windup and the hold at standstill."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from railway_runs import outputs, started

from plant_models import Driver

DRIVER = Driver()
KMH_50 = 50.0 / 3.6
NO_LAG = {"effort_lag": 0.01}
REST = DRIVER.unpack_states(np.zeros(2))


@given(t=st.floats(0.0, 150.0))
def test_the_reference_is_the_printed_profile(t: float) -> None:
    for preset, times, speeds in (
        ("profile_d", [0.0, 20.0, 65.0, 85.0], [0.0, KMH_50, KMH_50, 0.0]),
        ("profile_b", [0.0, 30.0, 60.0, 90.0], [0.0, 50.0, 50.0, 0.0]),
    ):
        p = DRIVER.unpack_parameters(DRIVER.start_parameters(preset))
        reference = DRIVER.output(t, REST, DRIVER.unpack_inputs(np.zeros(1)), p)["speed_reference"]
        assert reference == pytest.approx(np.interp(t, times, speeds), abs=1e-12)


@pytest.mark.parametrize("count", [4, 14])
def test_a_profile_may_have_more_points_and_keeps_its_presets(count: int) -> None:
    driver = Driver(profile_count=count)
    for preset in driver.presets:
        p = driver.unpack_parameters(driver.start_parameters(preset))
        usual = DRIVER.unpack_parameters(DRIVER.start_parameters(preset))
        assert len(p.profile_time) == len(p.profile_speed) == count
        assert p.power_limit == usual.power_limit
        for t in (0.0, 7.0, 44.0, 71.0, 100.0):
            inputs = driver.unpack_inputs(np.zeros(1))
            reported = [d.output(t, REST, inputs, q)["speed_reference"] for d, q in ((driver, p), (DRIVER, usual))]
            assert reported[0] == reported[1]


@pytest.mark.parametrize("count", [3, 65, 8.5, True])
def test_a_profile_has_four_to_sixty_four_points(count: object) -> None:
    with pytest.raises(ValueError, match="profile_count must be"):
        Driver(profile_count=count)  # type: ignore[arg-type]


def test_the_profiles_cover_the_distances_they_claim() -> None:
    t = np.linspace(0.0, 100.0, 100001)
    for preset, distance in (("profile_d", 65.0 * KMH_50), ("profile_b", 3000.0)):
        p = DRIVER.unpack_parameters(DRIVER.start_parameters(preset))
        reference = [
            float(DRIVER.output(s, REST, DRIVER.unpack_inputs(np.zeros(1)), p)["speed_reference"]) for s in t[::100]
        ]
        assert np.trapezoid(reference, t[::100]) == pytest.approx(distance, rel=1e-9)  # corners lie on the grid


@given(odometer=st.floats(-5.0, 60.0), time=st.floats(0.0, 100.0))
def test_the_effort_stays_within_its_limits(odometer: float, time: float) -> None:
    runtime = started(DRIVER)
    runtime.start(time)
    runtime.u[0] = odometer
    for k in range(1, 30):
        runtime.advance(time + 0.1 * k)
        effort = outputs(runtime)["effort"]
        assert -350e3 <= effort <= min(350e3, 4.2e6 / max(abs(odometer), 1e-9)) * (1.0 + 1e-12)


def test_only_traction_is_limited_by_power() -> None:
    runtime = started(DRIVER, "profile_b", power_limit=4.2e6, **NO_LAG)
    runtime.start(45.0)
    for odometer, effort in ((30.0, 4.2e6 / 30.0), (60.0, -350e3), (10.0, 350e3)):
        runtime.u[0] = odometer
        runtime.advance(runtime.t + 1.0)
        assert outputs(runtime)["effort"] == pytest.approx(effort, rel=1e-9)


def test_the_controller_is_the_printed_pi_between_the_limits() -> None:
    runtime = started(DRIVER, **NO_LAG)
    runtime.start(30.0)
    runtime.u[0] = KMH_50 - 0.02  # 14.4 kN proportional
    runtime.advance(32.0)
    # the lag's 10 ms of ramp
    assert outputs(runtime)["effort"] == pytest.approx(7.2e5 * 0.02 + 4.5e5 * 0.02 * 2.0, rel=1e-2)
    assert runtime.x[0] == pytest.approx(4.5e5 * 0.02 * 2.0, rel=1e-9)


def test_the_effort_follows_the_demand_with_the_lag_of_the_traction_chain() -> None:
    runtime = started(DRIVER, integral_gain=0.0)
    runtime.start(30.0)
    runtime.u[0] = KMH_50 - 0.1
    runtime.advance(30.3)
    # RK4 at a 20th of the lag
    assert outputs(runtime)["effort"] == pytest.approx(72e3 * (1.0 - np.exp(-0.3 / 0.2)), rel=1e-6)


def test_a_minute_in_the_limit_does_not_wind_the_integral_up() -> None:
    runtime = started(DRIVER, **NO_LAG)
    runtime.start(25.0)
    runtime.u[0] = KMH_50 - 5.0  # in the limit by far
    runtime.advance(64.0)
    # The integral settles where what the limit cuts off balances the error: Ki e Tt below the limit's share.
    assert runtime.x[0] == pytest.approx(350e3 - 7.2e5 * 5.0 + 4.5e5 * 5.0 * 0.5, rel=1e-6)
    runtime.u[0] = KMH_50 + 0.5
    runtime.advance(64.2)
    assert outputs(runtime)["effort"] < 0.0  # brakes at once


@given(brake=st.floats(0.0, 500e3))
def test_a_standing_train_is_held_and_let_go_when_the_profile_rises(brake: float) -> None:
    runtime = started(DRIVER, holding_effort=brake, **{"profile_time[1]": 10.0})
    runtime.x[0] = -5e4  # what a stop leaves in the integral
    runtime.start(0.0)
    runtime.advance(8.0)
    assert outputs(runtime)["effort"] == pytest.approx(-min(brake, 350e3), abs=1e-3)
    assert runtime.x[0] == pytest.approx(-5e4 * np.exp(-8.0 / 0.5), abs=0.1)
    runtime.advance(14.0)
    assert outputs(runtime)["effort"] > 0.0


def test_a_moving_train_is_not_held_where_the_profile_is_at_zero() -> None:
    runtime = started(DRIVER, **NO_LAG)
    runtime.start(90.0)
    runtime.u[0] = 0.3
    runtime.advance(90.2)
    assert outputs(runtime)["effort"] < -7.2e5 * 0.3  # proportional and integral part, more than the hold
    runtime.u[0] = 0.05
    runtime.advance(91.0)
    assert outputs(runtime)["effort"] == pytest.approx(-60e3, rel=1e-6)


def test_profile_b_has_the_power_it_needs() -> None:
    p = DRIVER.unpack_parameters(DRIVER.start_parameters("profile_b"))
    acceleration = 50.0 / 30.0
    force = (90e3 + 225.0 / 0.575**2) * acceleration + 900.0 + 32.0 * 50.0 + 1.7 * 50.0**2
    assert force * 50.0 == pytest.approx(7.9e6, abs=0.05e6)
    assert p.power_limit > 1.2 * force * 50.0
