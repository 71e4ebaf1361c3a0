"""The interval of the ETCS odometry by hand: cases of SUBSET-026, 3.6.4, that need no linking, and its law.

The runs are piecewise constant speeds, for which the observer's integrals are exact but for rounding: `EXACT` is a
thousand roundings of the largest place.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from observer_runner import SystemRunner

from fmu_observer.formulas.train_position import allowed_speed_error
from fmu_observer.observers.train import EtcsOdometry

EXACT = 1000.0 * np.spacing(3000.0)  # [m]
SPEED = 20.0  # [m/s]
KMH = 1.0 / 3.6


def started(**parameters: float) -> SystemRunner:
    """At rest at the place 0, no group passed."""
    runner = SystemRunner(EtcsOdometry(), **parameters)
    runner.set("x", {"estimated_position": 0.0})
    runner.runtime.start(0.0)
    return runner


def passes(runner: SystemRunner, position: float, accuracy: float = 0.0) -> None:
    runner.set("u", {"balise_location_accuracy": accuracy})
    runner.balise(position)


def rolls(runner: SystemRunner, way: float, reading: float = SPEED, slip: float = 0.0) -> dict[str, float]:
    """Outputs after so much way by an odometer that reads so, in pieces of a tenth."""
    runner.set("u", {"odometer": reading, "slip_suspected": slip})
    begin = runner.runtime.t
    for k in range(10):
        runner.runtime.advance(begin + (k + 1) * way / abs(reading) / 10.0)
    return runner.outputs()


@pytest.mark.parametrize("accuracy", [5.0, 63.0])
@pytest.mark.parametrize("way", [0.0, 100.0, 874.0])
def test_the_half_width_is_five_metres_five_per_cent_and_the_accuracy(way: float, accuracy: float) -> None:
    """Case 1."""
    runner = started()
    passes(runner, 1000.0, accuracy)
    found = rolls(runner, way) if way else runner.outputs()
    half = 5.0 + 0.05 * way + accuracy
    assert found["position"] == pytest.approx(1000.0 + way, abs=EXACT)
    assert found["max_safe_front_end"] - found["position"] == pytest.approx(half, abs=EXACT)
    assert found["position"] - found["min_safe_front_end"] == pytest.approx(half, abs=EXACT)
    assert found["lrbg_distance"] == pytest.approx(way, abs=EXACT)


@pytest.mark.parametrize(("accuracy", "inside_from"), [(12.0, 0.0), (5.0, 0.0), (1.0, 60.0)])
def test_a_group_that_lies_nine_metres_off(accuracy: float, inside_from: float) -> None:
    """Cases 2 and 3: the error of the map counts beside the amounts, so it is covered where ``5 + .05 s + Q >= 9``."""
    runner = started()
    passes(runner, 1009.0, accuracy)
    for way in (0.0, 59.0, 2.0, 100.0):
        found = rolls(runner, way) if way else runner.outputs()
        true = 1000.0 + found["lrbg_distance"]
        assert (found["min_safe_front_end"] <= true) == (found["lrbg_distance"] >= inside_from)
        assert true <= found["max_safe_front_end"]


@pytest.mark.parametrize("share", [0.03, -0.03])
def test_the_end_on_the_side_of_the_error_comes_nearer(share: float) -> None:
    """Case 4: an odometer that counts 3 % too much leaves 2 % of the way behind the train, 8 % in front of it."""
    runner = started()
    passes(runner, 0.0, 5.0)
    found = rolls(runner, 1000.0 * (1.0 + share), SPEED * (1.0 + share))
    counted = 1000.0 * (1.0 + share)
    behind, ahead = 1000.0 - found["min_safe_front_end"], found["max_safe_front_end"] - 1000.0
    assert behind == pytest.approx(10.0 + 0.05 * counted - 1000.0 * share, abs=EXACT)
    assert ahead == pytest.approx(10.0 + 0.05 * counted + 1000.0 * share, abs=EXACT)
    assert (behind < ahead) == (share > 0.0)


def test_the_national_accuracy_holds_until_the_next_group() -> None:
    """Case 14: what is fixed for a group is not changed; the next one tells its own."""
    runner = started(national_accuracy=10.0)
    passes(runner, 0.0)
    assert runner.outputs()["max_safe_front_end"] == 15.0
    runner.set("u", {"balise_location_accuracy": 3.0})  # without a telegram it says nothing
    assert rolls(runner, 100.0)["max_safe_front_end"] == pytest.approx(100.0 + 15.0 + 5.0, abs=EXACT)
    passes(runner, 100.0, 3.0)
    assert runner.outputs()["max_safe_front_end"] == 108.0


def test_whoever_rolls_back_over_the_reference_knows_less_not_more() -> None:
    """Case 15: the place goes back, the distance travelled does not."""
    runner = started()
    passes(runner, 500.0, 5.0)
    rolls(runner, 100.0)
    found = rolls(runner, 200.0, -SPEED)
    assert found["position"] == pytest.approx(400.0, abs=EXACT)
    assert found["lrbg_distance"] == pytest.approx(300.0, abs=EXACT)
    assert found["max_safe_front_end"] - found["position"] == pytest.approx(10.0 + 0.05 * 300.0, abs=EXACT)


def test_standstill_adds_nothing_and_creeping_what_the_odometer_cannot_read() -> None:
    """Case 16."""
    for least, grown in ((0.0, 0.0), (0.1, 60.0)):
        runner = started(least_speed=least)
        passes(runner, 0.0, 5.0)
        runner.set("u", {"odometer": 0.0})
        runner.runtime.advance(600.0)
        found = runner.outputs()
        assert found["position"] == 0.0
        assert found["max_safe_front_end"] == pytest.approx(10.0 + grown, abs=EXACT)
        assert found["min_safe_front_end"] == pytest.approx(-10.0 - grown, abs=EXACT)


def test_kilometres_that_jump_do_not_matter_between_groups() -> None:
    """Case 19: distances count since a group, whatever its place is called."""
    for called in (0.0, 12_345.0):
        runner = started()
        rolls(runner, 300.0)
        passes(runner, called, 5.0)
        found = rolls(runner, 200.0)
        assert found["position"] - called == pytest.approx(200.0, abs=1000.0 * np.spacing(12_545.0))
        assert found["lrbg_position"] == called


def test_rear_end_and_antenna() -> None:
    runner = started(train_length=200.0, safe_train_length=210.0, antenna_offset=4.0)
    passes(runner, 1000.0, 5.0)
    found = runner.outputs()
    assert (found["position"], found["rear_end"], found["min_safe_rear_end"]) == (1004.0, 804.0, 994.0 - 210.0)


def test_a_train_that_is_longer_than_it_can_be_is_refused() -> None:
    with pytest.raises(ValueError, match="safe_train_length must not be below train_length"):
        started(train_length=200.0, safe_train_length=100.0)


def test_before_the_first_group_the_start_counts() -> None:
    runner = started(start_position_error=30.0)
    assert rolls(runner, 100.0)["max_safe_front_end"] == pytest.approx(100.0 + 30.0 + 5.0 + 5.0, abs=EXACT)
    passes(runner, 100.0, 5.0)
    assert runner.outputs()["max_safe_front_end"] == 110.0


def test_the_allowed_speed_error_is_that_of_the_printed_line() -> None:
    """SUBSET-041: 2 km/h up to 30 km/h, 12 km/h at 500 km/h, a line between."""
    assert allowed_speed_error(-KMH * 30.0) == pytest.approx(2.0 * KMH, rel=1e-12)
    assert allowed_speed_error(0.0) == 2.0 * KMH
    assert allowed_speed_error(KMH * 265.0) == pytest.approx(7.0 * KMH, rel=1e-12)
    assert allowed_speed_error(KMH * 500.0) == pytest.approx(12.0 * KMH, rel=1e-12)


pieces = st.lists(
    st.tuples(
        st.floats(0.1, 30.0),  # duration [s]
        st.floats(-40.0, 40.0),  # speed [m/s]
        st.floats(-1.0, 1.0),  # error of the odometer, of what is granted
        st.booleans(),  # slip is suspected
        st.none() | st.floats(-1.0, 1.0),  # a group at the end, so far off of its accuracy
    ),
    min_size=1,
    max_size=8,
)


@given(pieces, st.floats(0.5, 63.0), st.floats(0.0, 5.0))
def test_the_front_end_is_inside_for_every_odometer_that_keeps_its_amounts(
    journey: list[tuple[float, float, float, bool, float | None]], accuracy: float, suspected: float
) -> None:
    """LAW. The amounts are shares of what is counted, so an odometer keeps them whose error is such a share:
    ``reading - speed = error share reading``.
    """
    runner = started(suspected_speed_error=suspected, over_fixed=0.0, under_fixed=0.0)
    true = 0.0
    for duration, speed, error, slips, group in journey:
        reading = speed + suspected * error if slips else speed / (1.0 - 0.05 * error)
        runner.set("u", {"odometer": reading, "slip_suspected": float(slips)})
        runner.runtime.advance(runner.runtime.t + duration)
        true += speed * duration
        found = runner.outputs()
        assert found["min_safe_front_end"] - EXACT <= true <= found["max_safe_front_end"] + EXACT
        if group is not None:
            passes(runner, true + group * accuracy, accuracy)
            found = runner.outputs()
            assert found["min_safe_front_end"] - EXACT <= true <= found["max_safe_front_end"] + EXACT
