"""The mission: the journey covers its distance, by time and by place."""

from __future__ import annotations

import numpy as np
import pytest
from control_runs import Controller
from hypothesis import given, settings
from hypothesis import strategies as st

from plant_models.railway.control import Mission
from plant_models.railway.control.mission import _Trapezoid

JOURNEYS = st.builds(
    _Trapezoid, st.floats(1.0, 40.0), st.floats(0.05, 1.5), st.floats(0.05, 1.5), st.floats(5.0, 5000.0)
)


@given(journey=JOURNEYS)
def test_the_journey_covers_its_distance_at_no_more_than_its_top_speed(journey: _Trapezoid) -> None:
    corners = np.cumsum([0.0, *journey.durations])
    speeds = [float(journey.speed(t)) for t in corners]
    covered = np.trapezoid(speeds, corners)  # exact: the speed is a broken line through its corners
    assert covered == pytest.approx(journey.distance, rel=1e-9)
    assert float(journey.position(corners[-1])) == pytest.approx(journey.distance, rel=1e-9)
    assert speeds[1] == pytest.approx(min(journey.top_speed, speeds[1]))
    assert speeds[1] <= journey.top_speed * (1.0 + 1e-12)
    assert (speeds[0], speeds[3]) == (0.0, pytest.approx(0.0, abs=1e-6))


@given(journey=JOURNEYS, share=st.floats(0.0, 1.0))
def test_position_is_the_integral_of_speed(journey: _Trapezoid, share: float) -> None:
    end = sum(journey.durations)
    grid = np.unique(
        [*np.linspace(0.0, share * end, 2001), *[c for c in np.cumsum(journey.durations) if c < share * end]]
    )
    integral = np.trapezoid([float(journey.speed(t)) for t in grid], grid)
    assert float(journey.position(share * end)) == pytest.approx(integral, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize(
    ("preset", "kmh", "acceleration"),
    [("sc1", 35.0, 0.35), ("sc2", 35.0, 0.5), ("sc3", 35.0, 0.5), ("sc4", 50.0, 0.35)],
)
def test_the_presets_are_the_published_missions(preset: str, kmh: float, acceleration: float) -> None:
    mission = Controller(Mission(), preset)
    top, up = kmh / 3.6, kmh / 3.6 / acceleration
    start = mission.at(1.0)
    assert (start["speed_reference"], start["acceleration_reference"], start["phase"]) == (
        pytest.approx(acceleration),
        acceleration,
        1.0,
    )
    hold = mission.at(up + 1.0)
    assert (hold["speed_reference"], hold["acceleration_reference"], hold["phase"]) == (pytest.approx(top), 0.0, 2.0)
    end = 850.0 / top + 0.5 * top / acceleration + 0.5 * top / 0.4
    brake = mission.at(end - 2.0)
    assert (brake["speed_reference"], brake["acceleration_reference"], brake["phase"]) == (
        pytest.approx(0.8),
        -0.4,
        3.0,
    )
    stop = mission.at(end + 1.0)
    assert (stop["speed_reference"], stop["acceleration_reference"], stop["phase"]) == (0.0, 0.0, 4.0)
    assert stop["position_reference"] == pytest.approx(850.0)


def test_nothing_moves_before_the_departure() -> None:
    for braking in ("time", "position"):
        mission = Controller(Mission(braking=braking), departure_time=5.0)  # type: ignore[arg-type]
        waiting = mission.at(4.9)
        assert set(waiting.values()) == {0.0}
        assert mission.at(6.0)["speed_reference"] == pytest.approx(0.35)


@settings(max_examples=10)
@given(lag=st.floats(0.0, 40.0), start=st.floats(-500.0, 500.0))
def test_by_place_a_train_that_fell_behind_still_stops_at_the_point(lag: float, start: float) -> None:
    mission = Controller(Mission(braking="position"), "sc2", {"position": start}, start_position=start)
    position, step = start, 0.1
    for k in range(1, 2001):
        t = k * step
        speed = mission.at(t, position=position)["speed_reference"]
        position += step * speed * (0.5 if t < lag else 1.0)  # a train that loses half of its way for a while
    assert speed == 0.0
    # The last step is taken at the speed of the curve just outside the tolerance, 0.2 m/s.
    assert 850.0 - 0.05 <= position - start <= 850.0 + 0.02


def test_by_place_the_reference_is_the_braking_curve() -> None:
    mission = Controller(Mission(braking="position"), "sc2", {"position": 0.0})
    for remaining in (100.0, 50.0, 10.0, 1.0):
        out = mission.at(60.0, position=850.0 - remaining)
        assert out["speed_reference"] == pytest.approx(min(35.0 / 3.6, np.sqrt(0.8 * remaining)))
        assert out["acceleration_reference"] == (-0.4 if 0.8 * remaining < (35.0 / 3.6) ** 2 else 0.0)


def test_an_unknown_way_of_braking_is_refused_in_words() -> None:
    with pytest.raises(ValueError, match=r"unknown braking 'place'; choose one of: time, position"):
        Mission(braking="place")  # type: ignore[arg-type]
