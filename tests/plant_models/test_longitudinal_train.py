"""The train as one point: published Davis sets, closed forms, SciPy on the same equations; what it must never do."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from railway_runs import outputs, started
from scipy.integrate import solve_ivp

from fmu_observer.observability import measured_plant, unobservable_modes
from plant_models import PLANTS
from plant_models.railway.adhesion.adhesion_table import STANDING_ADHESION, adhesion_coefficient
from plant_models.railway.vehicle.resistance import DAVIS_SETS, davis_from_vehicle

TRAIN = PLANTS["longitudinal_train"]()
EULER = PLANTS["longitudinal_train_euler"]()
GRAVITY = 9.81


def _end(preset: str, speed: float, inputs: Any, until: float, **changes: float) -> dict[str, float]:
    runtime = started(TRAIN, preset, [0.0, speed], inputs, **changes)
    runtime.advance(until)
    return outputs(runtime)


# -- resistance and adhesion: published and independent numbers -------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "values", "zero"),
    [
        ("set_b", {45.0: -0.331}, 17.3),
        ("set_d", {0.0: 0.46, 17.0: 0.4875, 30.0: 0.415, 45.0: 0.2305, 50.0: 0.145}, 57.2),
        # the independent page has 0.371 at 17 m/s; 0.35 + 0.051 - 0.0289 is 0.3721
        ("set_e", {17.0: 0.372, 30.0: 0.35, 45.0: 0.2825}, None),
        ("set_f", {17.0: 0.277, 30.0: 0.22, 45.0: 0.07, 50.0: 0.0}, 50.0),
    ],
)
def test_the_davis_sets_have_the_values_of_an_independent_computation(
    name: str, values: dict[float, float], zero: float | None
) -> None:
    for speed, expected in values.items():
        # half of the last digit given
        assert DAVIS_SETS[name].resistance(speed) == pytest.approx(expected, abs=6e-4)
        plant = started(TRAIN, name, [0.0, speed])
        assert speed == 0.0 or outputs(plant)["resistance_force"] == pytest.approx(expected, abs=6e-4)
    if zero is not None:
        assert DAVIS_SETS[name].zero_crossing == pytest.approx(zero, abs=0.05)
        assert abs(DAVIS_SETS[name].resistance(DAVIS_SETS[name].zero_crossing or 0.0)) < 1e-12


def test_a_set_without_negative_part_never_pulls() -> None:
    assert DAVIS_SETS["set_a"].zero_crossing is None


def test_every_set_is_a_preset_with_its_range() -> None:
    names = [name for name in DAVIS_SETS if name != "set_b_observer"]
    assert set(names) < set(TRAIN.presets)
    for name in names:
        chosen, preset = DAVIS_SETS[name], TRAIN.presets[name]
        assert (preset["davis_a"], preset["davis_b"], preset["davis_c"]) == (chosen.a, chosen.b, chosen.c)
        assert (preset["fitted_from"], preset["fitted_to"]) == (chosen.fitted_from, chosen.fitted_to)


def test_the_tgv_of_the_rolling_stock_formula() -> None:
    tgv = davis_from_vehicle(418e3, 17e3, 10.0, 10.0, 200.0, gamma=0.9, k1=9e-4, k2=20e-6)
    speed = 300.0 / 3.6
    # independent: 2.885 kN, 12.54 kN and 44.1 kN at 300 km/h; half of the last digit
    assert tgv.a == pytest.approx(2885.0, abs=0.5)
    assert tgv.b * speed == pytest.approx(12540.0, abs=5.0)
    assert tgv.c * speed**2 == pytest.approx(44100.0, abs=50.0)


def test_the_adhesion_table_falls_with_the_speed_as_computed_independently() -> None:
    speeds = np.array([0.0, 50.0, 100.0, 200.0, 300.0]) / 3.6
    np.testing.assert_allclose(
        adhesion_coefficient(speeds, STANDING_ADHESION["sncf_multi_motor_bogie"]),
        [0.33, 0.22, 0.165, 0.11, 0.0825],
        rtol=1e-12,
    )


@pytest.mark.parametrize(("preset", "level"), [("set_c", 1.0), ("set_d", 0.5), ("set_e", 0.3), ("set_f", 0.1)])
def test_the_adhesion_limit_is_weight_times_coefficient_times_level(preset: str, level: float) -> None:
    train = PLANTS["longitudinal_train"](railway="usa_sd75mac")
    runtime = started(train, preset, [0.0, 50.0 / 3.6], mass=80e3, adhesive_share=0.5)
    assert outputs(runtime)["adhesion_limit"] == pytest.approx(0.5 * 80e3 * GRAVITY * level * 0.45 / 1.5, rel=1e-12)


def test_a_zone_lowers_the_adhesion_limit_between_its_edges() -> None:
    places = {"zone_from[1]": 100.0, "zone_to[1]": 200.0, "degraded_level": 0.25}
    limits = [outputs(started(TRAIN, "set_c", [at, 10.0], **places))["adhesion_limit"] for at in (99.0, 100.0, 200.0)]
    assert limits[1] == pytest.approx(0.25 * limits[0], rel=1e-12)
    assert limits[2] == limits[0]


def test_an_unknown_railway_is_refused_with_those_known() -> None:
    with pytest.raises(ValueError, match=r"unknown railway 'moon'; choose one of: sncf_multi_motor_bogie"):
        PLANTS["longitudinal_train"](railway="moon")


# -- motion -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("preset", "speed", "inputs"),
    [("set_a", 20.0, [3.0, 0.0, 0.0]), ("set_c", 30.0, [-0.4, 0.25, 0.1]), ("scenario_3_3_4", 45.0, [-0.5, 0.0, 0.0])],
)
def test_the_motion_is_that_of_scipy_on_the_published_equations(preset: str, speed: float, inputs: list[float]) -> None:
    p = {**TRAIN.preset_values("set_a"), "grade_amplitude": 0.0, "grade_rate": 0.1, **TRAIN.preset_values(preset)}
    effort, loss, extra = inputs

    def rate(t: float, x: np.ndarray) -> list[float]:
        force = (p["traction_coefficient"] if effort > 0 else p["brake_coefficient"]) * effort * (1.0 - loss)
        drag = p["davis_a"] + p["davis_b"] * x[1] + p["davis_c"] * x[1] ** 2
        return [x[1], force + extra - drag - p["grade_amplitude"] * np.sin(p["grade_rate"] * t)]

    expected = solve_ivp(rate, (0.0, 20.0), [0.0, speed], rtol=1e-12, atol=1e-12).y[:, -1]
    found = _end(preset, speed, inputs, 20.0)
    # RK4 at 10 ms on rates of 0.1 1/s leaves less than the tolerance of SciPy's own steps
    np.testing.assert_allclose([found["position"], found["speed"]], expected, rtol=1e-9)


@given(speed=st.floats(1.0, 50.0), brake=st.floats(0.2, 3.0))
@settings(max_examples=8)
def test_a_brake_stops_the_train_where_it_should_and_holds_it(speed: float, brake: float) -> None:
    runtime = started(TRAIN, "set_a", [0.0, speed], [-brake, 0.0, 0.0], davis_b=0.0, davis_c=0.0, brake_coefficient=1.0)
    decay = brake + 0.01
    runtime.advance(speed / decay + 5.0)
    found = outputs(runtime)
    assert (found["speed"], found["acceleration"]) == (0.0, 0.0)
    # the step in which it stops has 2 ms: half of it squared, times the deceleration
    assert found["position"] == pytest.approx(0.5 * speed**2 / decay, rel=1e-9, abs=2e-6 * decay)
    standing = runtime.x.copy()
    runtime.advance(speed / decay + 50.0)
    assert (runtime.x == standing).all()


def test_the_constant_resistance_holds_against_a_weaker_grade_only() -> None:
    weak, strong = 0.9 * 0.46 / GRAVITY, 1.1 * 0.46 / GRAVITY
    assert _end("set_d", 0.0, [0.0] * 3, 10.0, **{"gradient[1]": weak})["speed"] == 0.0
    rolled = _end("set_d", 0.0, [0.0] * 3, 10.0, **{"gradient[1]": strong, "davis_b": 0.0, "davis_c": 0.0})
    assert rolled["speed"] == pytest.approx(-0.1 * 0.46 * 10.0, rel=1e-9)


def test_fault_cases_1_and_2_are_two_inputs() -> None:
    whole = _end("set_c", 20.0, [-1.0, 0.0, 0.0], 1e-9)["acceleration"]
    drag = DAVIS_SETS["set_c"].resistance(20.0)
    assert whole == pytest.approx(-1.0 - drag, rel=1e-9)
    case_1 = _end("set_c", 20.0, [-1.0, 1.0, -0.3], 1e-9)["acceleration"]  # F f = -0.3 in place of the effort
    assert case_1 == pytest.approx(-0.3 - drag, rel=1e-9)
    case_2 = _end("set_c", 20.0, [-1.0, 0.4, 0.4 * -0.2], 1e-9)["acceleration"]  # f = 0.4, xi = -0.2
    assert case_2 == pytest.approx(-0.6 - 0.08 - drag, rel=1e-9)
    beyond = _end("set_c", 20.0, [-1.0, 7.0, 0.0], 1e-9)["acceleration"]  # no more than all can be lost
    assert beyond == pytest.approx(-drag, rel=1e-9)


def test_the_position_cannot_be_seen_from_the_speed() -> None:
    system = measured_plant(TRAIN, {"train_speed": 20.0}, continuous=["speed"], preset="set_d")
    observability = np.vstack([system.C_continuous, system.C_continuous @ system.A])
    assert np.linalg.matrix_rank(observability) == 1
    (mode,) = unobservable_modes(system)
    assert set(mode.taking_part) == {"train_position"}


def test_outside_of_the_fitted_speeds_a_flag_is_raised_but_not_at_rest() -> None:
    flags = {v: outputs(started(TRAIN, "set_d", [0.0, v]))["outside_fitted_range"] for v in (0.0, 4.9, 5.0, 50.0, 50.1)}
    assert flags == {0.0: 0.0, 4.9: 1.0, 5.0: 0.0, 50.0: 0.0, 50.1: 1.0}
    assert outputs(started(TRAIN, "set_d", [0.0, -60.0]))["outside_fitted_range"] == 1.0


def test_a_range_the_wrong_way_round_is_refused() -> None:
    with pytest.raises(ValueError, match=r"fitted_to must not lie below fitted_from .*fitted_from = 60"):
        started(TRAIN, "set_d", fitted_from=60.0)


# -- the discrete form ------------------------------------------------------------------------------------------------


def test_one_update_is_the_printed_formula_with_its_minus_sign() -> None:
    runtime = started(EULER, "set_c", [3.0, 20.0, 0.0], [-0.5, 0.0, 0.0], update_period=0.2)
    assert list(runtime.x) == [3.0, 20.0, 1.0]  # nothing happens at the start
    runtime.advance(0.2)
    w0, w1, w2 = 0.0852, 0.04, -5e-5
    expected = [3.0 + 0.2 * 20.0, (1.0 - 0.2 * (w1 + w2 * 20.0)) * 20.0 - 0.2 * 0.5 - 0.2 * w0]
    np.testing.assert_allclose(runtime.x[:2], expected, rtol=1e-13)


@pytest.mark.parametrize("preset", ["set_a", "scenario_3_3_4"])
def test_the_discrete_form_comes_to_the_continuous_one_with_order_1(preset: str) -> None:
    inputs = [-0.6, 0.0, 0.0]
    exact = started(TRAIN, preset, [0.0, 40.0], inputs)
    exact.advance(8.0)
    errors = []
    for period in (0.2, 0.1, 0.05, 0.025):
        runtime = started(EULER, preset, [0.0, 40.0, 0.0], inputs, update_period=period)
        runtime.advance(8.0)
        errors.append(np.abs(runtime.x[:2] - exact.x))
    ratios = np.array(errors[:-1]) / np.array(errors[1:])
    # halving the period halves the error but for terms of second order, which are 0.5 % of it at 0.2 s
    np.testing.assert_allclose(ratios, 2.0, rtol=0.02)


def test_the_discrete_train_stops_stays_and_shows_equal_outputs() -> None:
    runtime = started(EULER, "set_d", [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0])
    runtime.advance(5.0)
    assert outputs(runtime)["speed"] == 0.0
    assert outputs(runtime)["acceleration"] == 0.0
    now = [started(plant, "set_e", x, [-0.7, 0.1, 0.2]) for plant, x in ((TRAIN, [9, 31.0]), (EULER, [9, 31.0, 0]))]
    assert outputs(now[0]) == outputs(now[1])
