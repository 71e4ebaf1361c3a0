"""Running resistance, tables, zones and gradient against closed forms and the thesis' coefficients."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plant_models import Locomotive
from plant_models.railway.track.track import Track, _piecewise_constant, piecewise_linear
from plant_models.railway.vehicle.resistance import davis_from_vehicle, gradient_resistance, moving_resistance

BB27000 = {"mass": 90e3, "axle_mass": 22.5e3, "cross_section": 2.857 * 4.31, "perimeter": 2.857, "length": 19.5}


def test_the_davis_coefficients_of_the_locomotive_come_from_its_dimensions() -> None:
    found = davis_from_vehicle(**BB27000)
    # Bouchama 2024, Table 4.1: 900, 32.4, 1.6529 (independently measured to 900.00, 32.400, 1.65287).
    assert found.a == pytest.approx(900.00, abs=5e-3)
    assert found.b == pytest.approx(32.400, abs=5e-4)
    assert found.c == pytest.approx(1.65287, abs=5e-6)


def test_an_empty_wagon_gets_the_printed_constant_and_viscous_part() -> None:
    found = davis_from_vehicle(19e3, 19e3 / 4, 1.0, 1.0, 1.0, gamma=np.sqrt(0.475))
    assert (found.a, found.b) == (pytest.approx(190.0, rel=1e-12), pytest.approx(6.84, rel=1e-12))


def test_a_vehicle_without_mass_is_refused() -> None:
    with pytest.raises(ValueError, match="axle_mass must be positive, got 0"):
        davis_from_vehicle(**{**BB27000, "axle_mass": 0.0})


@given(speed=st.floats(-100.0, 100.0))
def test_the_moving_resistance_is_odd_and_against_the_motion(speed: float) -> None:
    force = moving_resistance(speed, 32.0, 1.7)
    assert force == -moving_resistance(-speed, 32.0, 1.7)
    assert force * speed >= 0.0
    assert abs(force) == pytest.approx(32.0 * abs(speed) + 1.7 * speed**2, rel=1e-14)


def test_eight_per_mille_pull_as_published() -> None:
    total = gradient_resistance(90e3 + 4 * 19e3, 9.81, 0.008)
    assert total == pytest.approx(13.03e3, abs=5.0)  # independently measured, four digits


def _points(draw: st.DrawFn, n: int = 6) -> tuple[np.ndarray, np.ndarray]:
    gaps = draw(st.lists(st.floats(0.1, 50.0), min_size=n, max_size=n))
    values = draw(st.lists(st.floats(-5.0, 5.0), min_size=n, max_size=n))
    return np.cumsum(gaps), np.array(values)


POINTS = st.composite(_points)()


@given(points=POINTS, at=st.floats(-20.0, 350.0))
def test_a_broken_line_is_numpys_interpolation(points: tuple[np.ndarray, np.ndarray], at: float) -> None:
    # slope up to 100, x to 300
    assert piecewise_linear(at, *points) == pytest.approx(np.interp(at, *points), abs=1e-11)


def test_padded_points_and_jumps_of_a_broken_line() -> None:
    x, y = np.array([0.0, 2.0, 2.0, 5.0, 5.0, 5.0]), np.array([1.0, 1.0, 3.0, 4.0, 4.0, 4.0])
    assert [float(piecewise_linear(at, x, y)) for at in (-1.0, 1.9, 2.1, 5.0, 90.0)] == pytest.approx(
        [1.0, 1.0, 3.0 + 0.1 / 3, 4.0, 4.0]
    )


@given(points=POINTS, at=st.floats(-20.0, 350.0))
def test_a_staircase_holds_the_last_point(points: tuple[np.ndarray, np.ndarray], at: float) -> None:
    x, y = points
    assert _piecewise_constant(at, x, y) == y[max(np.searchsorted(x, at, side="right") - 1, 0)]


def test_a_track_lies_along_time_or_position() -> None:
    for zones, expected in (("time", [1.0, 1.0]), ("position", [0.0, 1.0])):
        train = Locomotive(zones=zones, zone_count=1)  # type: ignore[arg-type]
        p = train.start_parameters()
        names = [n for s in train.parameter_signals for n in s.scalar_names]
        p[names.index("zone_from[1]")], p[names.index("zone_to[1]")] = 10.0, 20.0
        x = np.array([[5.0, 15.0], [3.0, 3.0], [5.0, 5.0]])
        reported = train.unpack_inputs(np.zeros((1, 2))), train.unpack_parameters(p)
        assert list(train.output(12.0, train.unpack_states(x), *reported)["adhesion_degraded"]) == expected


@pytest.mark.parametrize(("shape", "middle"), [("constant", 0.002), ("linear", 0.005)])
def test_the_gradient_between_two_points(shape: str, middle: float) -> None:
    track = Track(gradient_shape=shape, gradient_count=2)  # type: ignore[arg-type]

    class Values:
        gradient_position = np.array([100.0, 300.0])
        gradient = np.array([0.002, 0.008])

    assert [float(track.gradient(s, Values)) for s in (0.0, 200.0, 300.0, 900.0)] == pytest.approx(
        [0.002, middle, 0.008, 0.008]
    )


def test_setting_the_first_gradient_alone_tilts_the_whole_track() -> None:
    for shape in ("constant", "linear"):
        train = Locomotive(gradient_shape=shape)  # type: ignore[arg-type]
        p = train.start_parameters()
        p[[n for s in train.parameter_signals for n in s.scalar_names].index("gradient[1]")] = 0.008
        for position in (-100.0, 0.0, 5e4):
            x = train.unpack_states(np.array([position, 0.0, 0.0]))
            output = train.output(0.0, x, train.unpack_inputs(np.zeros(1)), train.unpack_parameters(p))
            # The linear shape runs out towards the unused point a million kilometres away.
            assert output["gradient_force"] == pytest.approx(90e3 * 9.81 * 0.008, rel=1e-4)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"adhesion": "coulomb"}, "unknown adhesion 'coulomb'; choose one of: burckhardt, polach"),
        ({"zones": "space"}, "unknown zones 'space'"),
        ({"gradient_shape": "cubic"}, "unknown gradient_shape 'cubic'"),
        ({"zone_count": 0}, "zone_count must be at least 1, got 0"),
    ],
)
def test_unknown_options_are_refused_by_name(options: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Locomotive(**options)
