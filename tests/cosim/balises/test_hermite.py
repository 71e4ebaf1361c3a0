"""The cubic over a step, its turning points and its bounds, against polynomials and brute force."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cosim.balises.hermite import HermiteStep, _first_time, time_to_reach

speeds = st.floats(-20.0, 20.0)


@given(st.lists(st.floats(-3.0, 3.0), min_size=4, max_size=4), st.floats(0.01, 1.0))
def test_a_cubic_is_reproduced(coefficients: list[float], h: float) -> None:
    """Position, speed and acceleration of any cubic; tolerance: rounding, divided by h^2 for the acceleration."""
    p = np.polynomial.Polynomial(coefficients)
    v, a = p.deriv(), p.deriv(2)
    step = HermiteStep(h, p(0.0), v(0.0), p(h), v(h))
    for s in (0.0, 0.3 * h, h):
        assert step.position(s) == pytest.approx(p(s), abs=1e-13)
        assert step.speed(s) == pytest.approx(v(s), abs=1e-13 / h)
        assert step.acceleration(s) == pytest.approx(a(s), abs=1e-12 / h**2)


@given(speeds, speeds, st.floats(-2.0, 2.0))
def test_segments_cover_the_step_and_do_not_turn(v0: float, v1: float, p1: float) -> None:
    step = HermiteStep(0.1, 0.0, v0, p1, v1)
    parts = step.segments()
    assert [parts[0].start, parts[-1].end] == [0.0, 0.1]
    assert [parts[0].before, parts[-1].after] == [0.0, p1]
    assert len(parts) == (2 if v0 * v1 < 0.0 else 1)
    if len(parts) == 2:
        assert abs(step.speed(parts[0].end)) <= 1e-9 * max(abs(v0), abs(v1), abs(p1) / 0.1)


def test_crossing_is_found_to_the_last_bit() -> None:
    step = HermiteStep(0.1, 0.0, 10.0, 1.1, 12.0)
    s = step.crossing(0.5)
    assert step.position(s) >= 0.5
    assert step.position(np.nextafter(s, 0.0)) <= 0.5
    assert _first_time(lambda x: x >= 0.3, 0.0, 1.0) == 0.3


@given(st.floats(0.2, 20.0), st.floats(-8.0, 8.0), st.floats(-8.0, 8.0), st.floats(0.02, 0.98), st.floats(0.05, 0.95))
def test_bound_holds_for_a_jump_of_the_acceleration(v0: float, a0: float, a1: float, when: float, share: float) -> None:
    """Acceleration a0, then a1: the error of the cubic's crossing time stays below the bound for the spread that there
    was.
    """
    h, switch = 0.1, 0.1 * when
    v_mid = v0 + a0 * switch
    p_mid = v0 * switch + 0.5 * a0 * switch**2

    def truth(s: float) -> float:
        return v0 * s + 0.5 * a0 * s * s if s <= switch else p_mid + v_mid * (s - switch) + 0.5 * a1 * (s - switch) ** 2

    v1 = v_mid + a1 * (h - switch)
    if min(v0, v_mid, v1) <= 0.05:
        return
    step = HermiteStep(h, 0.0, v0, truth(h), v1)
    spread = max(abs(a - step.acceleration(s)) for a, ends in ((a0, (0.0, switch)), (a1, (switch, h))) for s in ends)
    crossing = share * h
    error = abs(step.crossing(truth(crossing)) - crossing)
    assert error <= step.time_bound(spread) + 1e-12


def test_bound_is_the_step_where_the_train_may_stand() -> None:
    assert HermiteStep(0.1, 0.0, 1.0, 0.0, -1.0).time_bound(0.1) == 0.1
    assert HermiteStep(0.1, 0.0, 0.0, 0.1, 2.0).time_bound(0.1) == 0.1
    assert HermiteStep(0.1, 0.0, 10.0, 1.0, 10.0).time_bound(1.6) == pytest.approx(1e-4, rel=5e-3)


@given(st.floats(1e-6, 100.0), st.floats(-30.0, 30.0), st.floats(0.1, 10.0))
def test_least_time_to_reach_is_exact_under_full_acceleration(
    distance: float, speed: float, acceleration: float
) -> None:
    t = time_to_reach(distance, speed, acceleration)
    assert speed * t + 0.5 * acceleration * t * t == pytest.approx(distance, rel=1e-9, abs=1e-12 * (1 + speed * speed))


def test_least_time_to_reach_at_the_ends() -> None:
    assert time_to_reach(np.inf, 3.0, 5.0) == np.inf
    assert time_to_reach(np.inf, -3.0, 5.0) == np.inf
    assert time_to_reach(0.0, 3.0, 5.0) == 0.0
