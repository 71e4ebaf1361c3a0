"""What a step of the effort shows, whatever the units, the directions and the lag of the drive are."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cosim.starter.step_response import (
    FORCES,
    LENGTHS,
    SPEEDS,
    FoundMotion,
    StepResponse,
    find_motion,
    force_unit,
    speed_unit_by_effort,
    wheel_unit,
)

TIME = np.linspace(0.0, 4.0, 401)
MASSES = st.floats(10e3, 7e6)
ROTATING = st.floats(1.0, 1.3)
SIGNS = st.sampled_from([1, -1])


def response(acceleration: float, lag: float, drag: float, **scales: float) -> StepResponse:
    """Of a train whose drive lags and whose resistance grows with the speed; columns ``p``, ``v``, ``a`` by scale."""
    a, v, p = np.empty_like(TIME), np.zeros_like(TIME), np.zeros_like(TIME)
    step = TIME[1]
    for k, t in enumerate(TIME):
        a[k] = acceleration * (1.0 - np.exp(-t / lag)) - drag * v[k]
        if k + 1 < len(TIME):
            v[k + 1] = v[k] + step * a[k]
            p[k + 1] = p[k] + step * 0.5 * (v[k] + v[k + 1])
    known = {"p": p, "v": v, "a": a}
    return StepResponse(TIME, 1.0, {name: scale * known[name[0]] for name, scale in scales.items()})


@given(
    speed=st.sampled_from(sorted(SPEEDS)),
    length=st.sampled_from(sorted(LENGTHS)),
    sign=SIGNS,
    direction=SIGNS,
    lag=st.floats(0.01, 0.8),
    drag=st.floats(0.0, 0.05),
)
def test_position_and_speed_are_found_in_their_units(
    speed: str, length: str, sign: int, direction: int, lag: float, drag: float
) -> None:
    found = response(0.3, lag, drag, a=1.0, p=direction / LENGTHS[length], v=direction * sign / SPEEDS[speed])
    assert find_motion(found, [], []) == FoundMotion("v", speed, "p", length, sign)


@given(lag=st.floats(0.01, 0.8))
def test_an_acceleration_and_its_speed_are_no_speed_and_position(lag: float) -> None:
    assert find_motion(response(0.3, lag, 0.0, v=1.0, a=1.0), [], []) is None


def test_names_decide_between_equal_pairs() -> None:
    found = response(0.3, 0.1, 0.0, p=1.0, v=1.0, p_other=1.0, v_other=1.0)
    for named in (["v_other", "p_other"], ["v", "p"]):
        motion = find_motion(found, [], named)
        assert motion is not None
        assert [motion.speed, motion.position] == named


def test_a_declared_speed_is_in_si() -> None:
    found = response(0.3, 0.1, 0.0, p=1.0, v=1.0)
    assert find_motion(found, ["v", "p"], []) == FoundMotion("v", "m/s", "p", "m", 1)
    assert find_motion(response(0.3, 0.1, 0.0, p=1.0, v=3.6), ["v", "p"], []) is None


@given(mass=MASSES, rotating=ROTATING, unit=st.sampled_from(sorted(FORCES)))
def test_an_effort_is_in_the_unit_of_mass_by_acceleration(mass: float, rotating: float, unit: str) -> None:
    assert force_unit(FORCES[unit] / (mass * rotating), mass) == unit


@given(inertia=MASSES, unit=st.sampled_from(["N", "kN"]))
def test_an_effort_has_one_unit_also_where_nobody_knows_the_mass(inertia: float, unit: str) -> None:
    assert force_unit(FORCES[unit] / inertia, None) == unit


@given(mass=MASSES, rotating=ROTATING, unit=st.sampled_from(["m/s", "km/h"]), force=st.sampled_from([1.0, 1e3]))
def test_a_speed_without_position_has_the_unit_of_effort_by_mass(
    mass: float, rotating: float, unit: str, force: float
) -> None:
    assert speed_unit_by_effort(force / (mass * rotating) / SPEEDS[unit], force, mass) == unit


@pytest.mark.parametrize(
    ("ratio", "expected"),
    [
        (1.0, ("m/s", None)),
        (1.02, ("m/s", None)),
        (3.6, ("km/h", None)),
        (1.0 / 0.46, ("rad/s", 0.46)),
        (30.0 / np.pi / 0.5, ("rpm", 0.5)),
        (0.1, None),
    ],
)
def test_a_wheel_has_a_unit_and_a_radius(ratio: float, expected: tuple[str, float | None] | None) -> None:
    assert wheel_unit(ratio) == expected
