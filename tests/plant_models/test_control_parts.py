"""The parts of the controllers: regulator, limits, blending, coupler protection, available adhesion, switch."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plant_models.railway.control import MdpeController
from plant_models.railway.control.effort_limits import (
    air_brake_demand,
    electric_brake_limit,
    electric_part,
    traction_limit,
)
from plant_models.railway.control.mdpe_controller import (
    _built_up_after,
    _coupler_headroom,
    _effort_steps,
    _next_available_effort,
    _stepped_towards,
)
from plant_models.railway.control.mode_switch import Situation, next_level
from plant_models.railway.control.sampled_regulator import pole_placement

FORCES = st.floats(-500e3, 500e3)
P = MdpeController().unpack_parameters(MdpeController().start_parameters())
NO_AIR = MdpeController().unpack_parameters(MdpeController().start_parameters("single_mass"))


@given(bandwidth=st.floats(0.01, 5.0), mass=st.floats(1e3, 1e7), period=st.floats(0.01, 1.0))
def test_both_poles_of_a_mass_under_the_regulator_lie_where_they_were_placed(
    bandwidth: float, mass: float, period: float
) -> None:
    gains = pole_placement(bandwidth, mass, period)
    closed = np.array([[1.0 - period / mass * gains.proportional, -period / mass], [gains.integral, 1.0]])
    rho = np.exp(-bandwidth * period)
    assert np.trace(closed) == pytest.approx(2.0 * rho, rel=1e-12)
    assert np.linalg.det(closed) == pytest.approx(rho * rho, rel=1e-9, abs=1e-12)


@given(force=FORCES, feedforward=FORCES, error=st.floats(-10.0, 10.0), bandwidth=st.floats(0.01, 5.0))
def test_an_inactive_regulator_would_ask_for_the_force_that_is_applied(
    force: float, feedforward: float, error: float, bandwidth: float
) -> None:
    gains = pole_placement(bandwidth, 166e3, 0.1)
    assert gains.force(gains.holding(force, feedforward, error), feedforward, error) == pytest.approx(force, abs=1e-3)


def test_traction_is_limited_by_effort_and_power() -> None:
    assert traction_limit(5.0, 350e3, 4.2e6) == 350e3
    assert traction_limit(-30.0, 350e3, 4.2e6) == pytest.approx(140e3)
    assert traction_limit(12.0, 350e3, 4.2e6) == pytest.approx(350e3)


def test_the_electric_brake_fades_at_low_speed() -> None:
    limits = [electric_brake_limit(v, 150e3, 2.0, 0.5) for v in (20.0, 2.0, 1.25, 0.5, 0.0)]
    assert limits == pytest.approx([150e3, 150e3, 75e3, 0.0, 0.0])
    assert electric_brake_limit(0.0, 150e3, 0.0, -1.0) == 150e3


@given(previous=FORCES, wanted=FORCES, down=st.floats(0.0, 1e5), up=st.floats(0.0, 1e5))
def test_a_step_is_never_larger_than_allowed(previous: float, wanted: float, down: float, up: float) -> None:
    step = _stepped_towards(previous, wanted, down, up) - previous
    assert -down - 1e-6 <= step <= up + 1e-6
    if -down <= wanted - previous <= up:
        assert step == pytest.approx(wanted - previous, abs=1e-6)


@given(force=st.floats(-300e3, 0.0), built_up=st.floats(0.0, 164e3), limit=st.floats(0.0, 150e3))
def test_the_electric_brake_gives_what_air_has_not_built_up(force: float, built_up: float, limit: float) -> None:
    effort = electric_part(force, built_up, limit)
    assert -limit <= effort <= 0.0
    if 0.0 <= -force - built_up <= limit:
        assert effort - built_up == pytest.approx(force, abs=1e-6)


def test_the_air_brake_is_asked_for_its_share() -> None:
    assert air_brake_demand(-82e3, 164e3, 164e3) == 0.5
    assert air_brake_demand(-82e3, 328e3, 164e3) == 0.25
    assert air_brake_demand(-500e3, 164e3, 164e3) == 1.0
    assert air_brake_demand(50e3, 164e3, 164e3) == 0.0
    assert air_brake_demand(-82e3, 0.0, 0.0) == 0.0


def test_air_builds_up_quickly_and_is_released_slowly() -> None:
    assert _built_up_after(0.0, 100.0, 1.5, 1.5, 8.0) == pytest.approx(100.0 * (1.0 - np.exp(-1.0)))
    assert _built_up_after(100.0, 0.0, 8.0, 1.5, 8.0) == pytest.approx(100.0 * np.exp(-1.0))


def test_the_headroom_of_a_coupler_falls_from_its_soft_limit_through_zero_at_the_limit() -> None:
    loads = [-50e3, 0.0, 150e3, 200e3, 250e3, 300e3, 500e3]
    assert [_coupler_headroom(load, 150e3, 250e3) for load in loads] == pytest.approx(
        [1.0, 1.0, 1.0, 0.5, 0.0, -0.5, -1.0]
    )


@given(effort=FORCES, coupler=st.floats(-600e3, 600e3), wanted=st.one_of(st.just(0.0), FORCES))
def test_a_loaded_coupler_is_not_loaded_further(effort: float, coupler: float, wanted: float) -> None:
    down, up = _effort_steps(effort, coupler, 6.8e3, 150e3, 250e3)
    after = _stepped_towards(effort, wanted, down, up)
    assert abs(after - effort) <= 6.8e3 + 1e-6
    if coupler >= 250e3:
        assert after <= max(effort, 0.0)
        if effort < 0.0:
            assert after <= 0.0  # a brake may be released, no more
        elif coupler > 260e3:
            assert after < effort or effort == 0.0
    if coupler <= -250e3:
        assert after >= min(effort, 0.0)
        if effort > 0.0:
            assert after >= 0.0
        elif coupler < -260e3:
            assert after > effort or effort == 0.0
    if abs(coupler) >= 250e3 and wanted == 0.0:
        assert abs(after) == pytest.approx(max(abs(effort) - 6.8e3, 0.0), abs=1e-6)  # back to zero at the full rate


def available(before: float, force: float, sliding: float = 0.0, newly: float = 0.0) -> float:
    return float(_next_available_effort(before, force, sliding, newly, 500.0, margin=0.85, floor=10e3, limit=350e3))


def test_the_available_effort_is_cut_in_slip_and_probed_upwards() -> None:
    assert available(350e3, 60e3, sliding=1.0) == pytest.approx(51e3)
    assert available(350e3, -60e3, sliding=1.0) == pytest.approx(51e3)
    assert available(40e3, 60e3, sliding=1.0) == 40e3  # never upwards in slip
    assert available(350e3, 60e3, newly=1.0) == 60e3
    assert available(350e3, 1e3, sliding=1.0) == 10e3
    assert available(51e3, 60e3) == 51.5e3
    assert available(349.9e3, 60e3) == 350e3


def situation(**changes: float) -> Situation:
    usual: dict[str, Any] = {
        "mode": 1.0,
        "level": 1.0,
        "wanted": 0.0,
        "error": 0.0,
        "acceleration": 0.0,
        "speed": 10.0,
        "coupler_force": 0.0,
        "standing": 0.0,
    }
    return Situation(**(usual | changes))


@pytest.mark.parametrize(
    ("now", "mode"),
    [
        ({"wanted": 50e3, "acceleration": 0.5}, 1.0),
        ({"wanted": -5e3}, 1.0),  # a small negative force: it coasts
        ({"wanted": -5e3, "error": -0.2}, 2.0),
        ({"wanted": -5e3, "error": -0.2, "level": 2.0}, 3.0),  # degraded: brake on all wheels
        ({"wanted": -5e3, "error": -0.2, "coupler_force": -160e3}, 3.0),
        ({"wanted": -5e3, "error": -0.2, "speed": 1.5}, 3.0),
        ({"wanted": -60e3, "acceleration": -0.1}, 2.0),
        ({"wanted": -60e3, "acceleration": -0.4}, 3.0),
        ({"wanted": -60e3, "acceleration": -0.4, "error": -0.6}, 4.0),
        ({"wanted": -170e3, "acceleration": -0.4}, 4.0),
        ({"wanted": -60e3, "error": -0.6}, 4.0),  # far too fast: air as well, without asking what the reference does
        ({"mode": 2.0, "wanted": 5e3}, 2.0),  # within the band nothing changes
        ({"mode": 2.0, "wanted": 5e3, "error": 0.2}, 1.0),
        ({"mode": 2.0, "wanted": 5e3, "acceleration": 0.3}, 1.0),
        ({"mode": 2.0, "wanted": -5e3, "error": 0.2}, 2.0),
        ({"mode": 3.0, "wanted": -5e3}, 3.0),  # air stays until the brake ends
        ({"mode": 3.0, "wanted": -5e3, "error": -0.4}, 3.0),
        ({"mode": 4.0, "wanted": -5e3, "error": -0.4}, 4.0),
        ({"mode": 4.0, "wanted": -5e3, "error": -0.2}, 3.0),
        ({"mode": 4.0, "wanted": -140e3}, 4.0),
        ({"mode": 4.0, "wanted": -130e3}, 3.0),
        ({"standing": 1.0, "speed": 0.0}, 3.0),
        ({"standing": 1.0, "speed": 0.0, "mode": 4.0, "error": -1.0}, 3.0),
    ],
)
def test_the_switch_chooses_the_mode(now: dict[str, float], mode: float) -> None:
    assert situation(**now).next_mode(P) == mode


@given(
    mode=st.sampled_from([1.0, 2.0, 3.0, 4.0]),
    wanted=FORCES,
    error=st.floats(-5.0, 5.0),
    acceleration=st.floats(-1.0, 1.0),
    level=st.sampled_from([1.0, 2.0]),
    coupler=FORCES,
    speed=st.floats(0.0, 50.0),
)
def test_the_switch_settles_at_once_and_never_asks_for_air_that_is_not_there(
    mode: float, wanted: float, error: float, acceleration: float, level: float, coupler: float, speed: float
) -> None:
    s = situation(
        mode=mode,
        wanted=wanted,
        error=error,
        acceleration=acceleration,
        level=level,
        coupler_force=coupler,
        speed=speed,
    )
    chosen = s.next_mode(P)
    assert s._replace(mode=chosen).next_mode(P) == chosen  # the same situation gives the same mode: no chatter
    assert float(s.next_mode(NO_AIR)) in {1.0, 2.0}


def test_degraded_adhesion_counts_at_once_and_nominal_after_the_recovery_time() -> None:
    level, quiet = next_level(1.0, 0.0, 2.0, 0.1, 5.0)
    assert (level, quiet) == (2.0, 0.0)
    levels = []
    for _ in range(60):
        level, quiet = next_level(level, quiet, 1.0, 0.1, 5.0)
        levels.append(float(level))
    assert levels == [2.0] * 49 + [1.0] * 11
    assert next_level(2.0, 4.9, 2.0, 0.1, 5.0) == (2.0, 0.0)  # one report starts the time anew
