"""The constant-brake planner: against Lambert's function, integration of the train, and its own words."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.special import lambertw

from plant_models.railway.control.stopping_controller import _hardest_brake
from plant_models.railway.control.stopping_planner import (
    BrakePlan,
    NoBrakingSolutionError,
    constant_brake,
    plan_stop,
    reference_motion,
    tracking_poles,
)


def test_the_example_of_the_thesis() -> None:
    plan = plan_stop(30.0, 100.0, drag_rate=0.1, brake_coefficient=0.1)
    assert plan.effort == pytest.approx(-26.2230, abs=5e-5)
    assert plan.duration == pytest.approx(7.6269, abs=5e-5)
    assert plan.position(plan.duration) == pytest.approx(100.0, abs=1e-12)
    assert plan.speed(plan.duration) == pytest.approx(0.0, abs=1e-13)


def test_all_of_c_by_lamberts_function() -> None:
    """``s = -W_{-1}(-c e^-c)/c - 1``. SciPy's function loses half its digits at the branch point, where c is near 1,
    and the argument 1 - c loses them where c is small.
    """
    c = np.concatenate([np.geomspace(1e-6, 0.5, 400), 1.0 - np.geomspace(0.5, 1e-9, 400)])
    s = np.expm1(constant_brake(1.0, 1.0 - c, 1.0).duration)
    with np.errstate(invalid="ignore"):
        reference = -lambertw(-c * np.exp(-c), -1).real / c - 1.0
    clear = c < 0.9
    assert np.allclose(s[clear], reference[clear], rtol=1e-9)
    # what the solution is worth where Lambert's function is not: the equation itself, ln(1 + s) = c s, to rounding
    near = c >= 0.9
    gap = 1.0 - c[near]
    series = 2.0 * gap * (1.0 + gap * (4.0 / 3.0 + gap * (13.0 / 9.0 + gap * 40.0 / 27.0)))  # its Taylor polynomial
    small = gap < 1e-3
    assert np.allclose(s[near][small], series[small], rtol=1e-11)
    assert np.all(np.abs(np.log1p(s[near]) - c[near] * s[near]) <= 4e-16 * s[near] + 1e-300)


def test_the_bracket_holds() -> None:
    c = np.concatenate([np.geomspace(1e-6, 0.5, 200), 1.0 - np.geomspace(0.5, 1e-6, 200)])
    s = np.expm1(constant_brake(1.0, 1.0 - c, 1.0).duration)
    assert np.all(s * (1.0 + 1e-9) >= 2.0 * (1.0 - c) / c)
    assert np.all(s * (1.0 - 1e-9) <= 1.0 / c**2 - 1.0)


@given(
    speed=st.floats(1.0, 90.0),
    share=st.floats(1e-6, 0.999),
    drag_rate=st.floats(1e-6, 0.5),
    final=st.floats(0.0, 0.95),
)
def test_the_plan_ends_at_the_mark(speed: float, share: float, drag_rate: float, final: float) -> None:
    """Whatever the case: the closed form of the motion is at the mark, with the final speed, when the plan ends."""
    final_speed = final * speed
    distance = share * (speed - final_speed) / drag_rate
    plan = plan_stop(speed, distance, drag_rate=drag_rate, final_speed=final_speed)
    assert plan.effort < 0.0
    # the motion is a difference of numbers of the size of the way without brake, v_0 t_f
    assert plan.position(plan.duration) == pytest.approx(distance, abs=2e-11 * speed * plan.duration)
    assert plan.speed(plan.duration) == pytest.approx(final_speed, abs=1e-10 * speed)


@pytest.mark.parametrize(("drag_rate", "final_speed"), [(0.1, 0.0), (0.02, 5.0), (0.0, 0.0), (1e-9, 3.0)])
def test_integration_of_the_train_stops_at_the_mark(drag_rate: float, final_speed: float) -> None:
    plan = plan_stop(30.0, 100.0, drag_rate=drag_rate, brake_coefficient=0.4, mass=2.0, final_speed=final_speed)
    motion = solve_ivp(
        lambda _, z: [-drag_rate * z[0] + 0.4 * plan.effort / 2.0, z[0]],
        (0.0, plan.duration),
        [30.0, 0.0],
        rtol=1e-12,
        atol=1e-12,
        dense_output=True,
    )
    assert motion.y[:, -1] == pytest.approx([final_speed, 100.0], abs=1e-9)
    times = np.linspace(0.0, plan.duration, 40)
    assert np.allclose(plan.speed(times), motion.sol(times)[0], atol=1e-9)
    assert np.allclose(plan.position(times), motion.sol(times)[1], atol=1e-8)


def test_without_drag_it_is_the_school_formula() -> None:
    assert plan_stop(30.0, 100.0).effort == pytest.approx(-4.5, rel=1e-15)
    assert plan_stop(30.0, 100.0, final_speed=5.0).effort == pytest.approx(-4.375, rel=1e-15)


def test_the_hardest_brake_is_the_plan_of_its_own_stop() -> None:
    plan = plan_stop(30.0, 100.0, drag_rate=0.1, final_speed=4.0)
    assert _hardest_brake(30.0, plan.deceleration, 0.1, 4.0).duration == pytest.approx(plan.duration, rel=1e-13)
    assert _hardest_brake(30.0, 3.0, 0.0).duration == pytest.approx(10.0, rel=1e-15)


def test_the_reference_stays_where_it_stops() -> None:
    plan = BrakePlan(2.0, 5.0, 1.0)
    speeds, positions = reference_motion(np.array([-1.0, 0.0, 5.0, 7.0]), 10.0, 3.0, plan, 0.0)
    assert speeds == pytest.approx([10.0, 10.0, 0.0, 0.0])
    assert positions == pytest.approx([3.0, 3.0, 28.0, 28.0])
    speed, position = reference_motion(7.0, 14.0, 3.0, plan, 0.0)  # 4 m/s are left, and go on
    assert (speed, position) == pytest.approx((4.0, 3.0 + 45.0 + 8.0))


def test_the_sign_of_the_feedback() -> None:
    assert tracking_poles(1.4, 0.5, 0.1) == pytest.approx([-1.0, -0.5])
    assert tracking_poles(1.4, 0.5, 0.1, 1.0) == pytest.approx([-0.3105, 1.6105], abs=5e-5)


@pytest.mark.parametrize(
    ("given_", "said"),
    [
        ({"speed": 3.0, "distance": 100.0, "drag_rate": 0.1}, "drag alone stops the train after 30 m, 70 m short"),
        ({"speed": 10.0, "distance": 100.0, "drag_rate": 0.1}, "0 m short of the mark (c = 1 - drag_rate distance"),
        (
            {"speed": 9.0, "distance": 80.0, "drag_rate": 0.1, "final_speed": 2.0},
            "down to 2 m/s after 70 m, 10 m short",
        ),
        ({"speed": 3.0, "distance": -2.0}, "the mark is 2 m behind the train"),
        ({"speed": 3.0, "distance": 2.0, "final_speed": 3.0}, "nothing to brake"),
    ],
)
def test_no_braking_solution_in_words(given_: dict[str, float], said: str) -> None:
    with pytest.raises(NoBrakingSolutionError) as raised:
        plan_stop(**given_)  # type: ignore[arg-type]
    assert said in str(raised.value)
    traced = constant_brake(
        given_["speed"], given_["distance"], given_.get("drag_rate", 0.0), given_.get("final_speed", 0.0)
    )
    assert (float(traced.possible), float(traced.deceleration)) == (0.0, 0.0)


@pytest.mark.parametrize("wrong", [{"speed": np.nan}, {"drag_rate": -0.1}, {"mass": 0.0}, {"final_speed": -1.0}])
def test_illegal_numbers_are_named(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=f"{next(iter(wrong))} = .*expected finite numbers"):
        plan_stop(**({"speed": 30.0, "distance": 100.0} | wrong))  # type: ignore[arg-type]
