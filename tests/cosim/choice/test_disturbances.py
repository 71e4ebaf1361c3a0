"""Disturbances: laws over journeys and seeds."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from cosim.choice.disturbances import Disturbance, Journey, OdometerFault, Slope, drawn


def journey(top: float, rate: float, cruise: float) -> Journey:
    """Away, at top speed [m/s], and to a stop, at a rate [m/s2]."""
    rise = top / rate
    time = np.arange(0.0, 2.0 * rise + cruise, 0.1)
    speed = np.interp(time, [0.0, rise, rise + cruise, 2.0 * rise + cruise], [0.0, top, top, 0.0])
    return Journey(time, np.concatenate(([0.0], np.cumsum(0.1 * speed[:-1]))), speed)


JOURNEYS = st.builds(journey, st.floats(5.0, 40.0), st.floats(0.3, 1.0), st.floats(10.0, 200.0))


@given(JOURNEYS, st.integers(0, 10**6))
@example(journey(5.0, 1.0, 10.0), 510511)  # a jam was drawn near a skid on all four
def test_four_seeds_have_both_signs_of_every_error(way: Journey, seed: int) -> None:
    found = [drawn(number, seed, way) for number in (1, 2, 3, 4)]
    for errors in ([d.mass - 1.0 for d in found], [d.resistance - 1.0 for d in found], [d.wheel - 1.0 for d in found]):
        assert min(errors) < 0.0 < max(errors)
    assert {fault.kind for d in found for fault in d.faults} == {-1.0, 1.0}


@given(JOURNEYS, st.integers(0, 10**6), st.integers(1, 9), st.booleans())
def test_wheels_jam_while_the_train_brakes_and_skid_while_it_gathers_speed_one_at_a_time(
    way: Journey, seed: int, number: int, twice: bool
) -> None:
    found = drawn(number, seed, way)
    faults = (found.times(2.0) if twice else found).faults
    for fault in faults:
        row = int(np.searchsorted(way.time, fault.onset))
        change = np.interp(way.time[row] + 0.5, way.time, way.speed) - np.interp(
            way.time[row] - 0.5, way.time, way.speed
        )
        assert change < -0.05 if fault.kind < 0.0 else change > 0.0
        assert way.speed[row] > 0.9
        assert 0.0 < fault.depth <= 1.0
    ends = [fault.onset + fault.length for fault in faults]
    assert all(end < following.onset for end, following in zip(ends, faults[1:], strict=False))


@given(JOURNEYS, st.integers(0, 10**6), st.integers(1, 9))
def test_slopes_follow_one_another_to_the_end(way: Journey, seed: int, number: int) -> None:
    slopes = drawn(number, seed, way).slopes
    assert slopes[0].onset == way.time[0]
    for slope, following in pairwise(slopes):
        assert slope.onset + slope.length == following.onset or abs(slope.onset + slope.length - following.onset) < 1e-9
    assert abs(slopes[-1].onset + slopes[-1].length - way.time[-1]) < 1e-9
    assert all(abs(slope.gradient) <= 8e-3 for slope in slopes)


@given(JOURNEYS, st.integers(0, 10**6), st.integers(1, 9))
def test_the_harder_one_is_the_same_with_everything_twice_as_large(way: Journey, seed: int, number: int) -> None:
    found = drawn(number, seed, way)
    harder = found.times(2.0)
    assert (harder.name, harder.harder, found.harder) == (f"harder seed {number}", True, False)
    for part in ("mass", "wheel"):
        assert getattr(harder, part) - 1.0 == pytest.approx(2.0 * (getattr(found, part) - 1.0))
    assert harder.resistance > 0.0
    assert abs(harder.resistance - 1.0) > 1.7 * abs(found.resistance - 1.0)
    assert (harder.noise, harder.loss) == (2.0 * found.noise, 2.0 * found.loss)
    assert [s.gradient for s in harder.slopes] == [2.0 * s.gradient for s in found.slopes]
    assert [(f.onset, f.length, f.kind) for f in harder.faults] == [
        (f.onset, 2 * f.length, f.kind) for f in found.faults
    ]
    assert [f.depth for f in harder.faults] == [min(2.0 * f.depth, 1.0) for f in found.faults]


@given(JOURNEYS, st.integers(0, 10**6))
def test_the_same_seed_gives_the_same_and_another_number_another(way: Journey, seed: int) -> None:
    assert drawn(1, seed, way) == drawn(1, seed, way)
    assert drawn(1, seed, way).noise != drawn(5, seed, way).noise


def test_what_acted_is_named_by_the_fault_before_it() -> None:
    found = Disturbance(faults=(OdometerFault(10.0, 2.0, 1.0, -1.0), OdometerFault(30.0, 1.0, 0.3, 1.0)))
    assert found.cause(13.0) == "after a wheel that jams at 10 s"
    assert found.cause(31.0) == "after a wheel that skids at 30 s"
    assert found.cause(25.0) == ""


@given(JOURNEYS, st.integers(0, 10**6), st.integers(1, 9))
def test_a_train_that_runs_backwards_is_disturbed_as_one_that_runs_forwards(
    way: Journey, seed: int, number: int
) -> None:
    back = drawn(number, seed, Journey(way.time, -way.position, -way.speed))
    ahead = drawn(number, seed, way)
    assert back.faults == ahead.faults
    assert len(back.slopes) > 0
    assert len({slope.gradient for slope in back.slopes}) <= len({slope.gradient for slope in ahead.slopes}) + 1


def test_what_an_observer_does_not_take_is_no_cause() -> None:
    both = Disturbance(mass=1.2, slopes=(Slope(0.0, 9.0, 0.01),), faults=(OdometerFault(1.0, 1.0, 0.5, 1.0),))
    assert "skids" in both.cause(2.0)
    assert "slope" in both.cause(2.0, odometer=False)
    assert "skids" in both.cause(2.0, effort=False)
    assert both.cause(8.5, effort=False) == ""
