"""The locomotive's physics: what holds exactly, and what may never happen."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from railway_runs import ALL_DEGRADED, NO_ZONES, outputs, parameters, rolling, sampled, started
from scipy.optimize import brentq

from plant_models import Locomotive
from plant_models.hybrid import TracedSystem
from plant_models.hybrid.integration import effective_flow
from plant_models.railway.adhesion import BURCKHARDT_DEGRADED, BURCKHARDT_NOMINAL

TRAIN, WET = Locomotive(), Locomotive(adhesion="polach")
TRAINS = {"burckhardt": TRAIN, "polach": WET}
MASS, INERTIA, RADIUS, WEIGHT = 90e3, 225.0, 0.575, 90e3 * 9.81
ROTATING = INERTIA / RADIUS**2  # [kg]
NO_AIR = {"davis_b": 0.0, "davis_c": 0.0}
TIMES = np.round(np.arange(0.02, 6.0, 0.02), 12)
PEAK = {0.0: BURCKHARDT_NOMINAL.peak(), 1.0: BURCKHARDT_DEGRADED.peak()}

# -- closed forms ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("speed", [1.0, 13.9, 50.0])
def test_the_wheels_time_constant_is_4_6e_minus_5_seconds_per_speed(speed: float) -> None:
    jacobian = np.asarray(
        TracedSystem(TRAIN).jacobian("flow", "x")(0.0, rolling(speed), [0.0], parameters(TRAIN, **NO_ZONES))
    )
    assert -1.0 / jacobian[2, 2] / speed == pytest.approx(4.6e-5, abs=5e-7)  # independently measured, two digits
    assert -1.0 / jacobian[2, 2] == pytest.approx(
        ROTATING * speed / (WEIGHT * BURCKHARDT_NOMINAL.initial_slope()), rel=1e-12
    )


def test_a_train_under_constant_force_accelerates_at_the_closed_form_rate() -> None:
    effort, dry = 50e3, 900.0

    def rate(slip: float) -> float:  # with rw = (1 + slip) v the wheel takes its share of the effort
        return (effort - dry) / (MASS + ROTATING * (1.0 + slip))

    slip = brentq(lambda s: BURCKHARDT_NOMINAL.coefficient(s) * WEIGHT - dry - MASS * rate(s), 0.0, 0.05, xtol=1e-15)
    runtime = started(TRAIN, x0=[0.0, 5.0, 5.0 * (1.0 + slip) / RADIUS], **NO_AIR, **NO_ZONES)
    runtime.u[0] = effort
    runtime.advance(10.0)
    now = outputs(runtime)
    # The solution is linear in time and the integrator exact on it; the position's rounding adds up over 10 000 steps.
    assert now["speed"] == pytest.approx(5.0 + 10.0 * rate(slip), rel=1e-11)
    assert now["position"] == pytest.approx(50.0 + 50.0 * rate(slip), rel=1e-6)
    assert now["slip"] == pytest.approx(slip, rel=1e-9)
    assert now["acceleration"] == pytest.approx(rate(slip), rel=1e-9)


@given(speed=st.floats(0.05, 0.45), dry=st.floats(5e3, 3e4))
def test_coasting_on_dry_friction_alone_stops_on_time_and_stays(speed: float, dry: float) -> None:
    runtime = started(TRAIN, x0=rolling(speed), davis_a=dry, **NO_AIR, **NO_ZONES)
    due = speed * (MASS + ROTATING) / dry
    runtime.advance(due - 2e-3)
    assert runtime.x[1] > 0.0
    runtime.advance(due + 2e-3)  # one internal step, and up to one more for where the grid lies
    assert runtime.x[1] == 0.0
    stop = runtime.x[0]
    assert stop == pytest.approx(0.5 * speed * due, abs=1e-6)  # the last step is cut: at most dry/M * (1 ms)^2
    runtime.advance(due + 5.0)
    assert (runtime.x[0], runtime.x[1], runtime.x[2]) == (stop, 0.0, 0.0)


@pytest.mark.parametrize("name", TRAINS)
@pytest.mark.parametrize("effort", [60e3, -60e3])
def test_work_is_kinetic_energy_and_losses(name: str, effort: float) -> None:
    runtime = started(
        TRAINS[name], x0=rolling(20.0), **{**NO_ZONES, "zone_from[1]": 2.0, "zone_to[1]": 4.0, "gradient[1]": 0.004}
    )
    runtime.u[0] = effort
    times = np.round(np.arange(0.0, 8.0005, 1e-3), 12)
    rows = []
    for t in times:
        runtime.advance(float(t))
        rows.append(outputs(runtime))
    y = {key: np.array([row[key] for row in rows]) for key in rows[0]}
    kinetic = 0.5 * MASS * y["speed"] ** 2 + 0.5 * ROTATING * y["wheel_speed"] ** 2
    loss = (y["resistance_force"] + y["gradient_force"]) * y["speed"] + y["adhesion_force"] * (
        y["wheel_speed"] - y["speed"]
    )
    balance = np.trapezoid(effort * y["wheel_speed"] - loss, times) - (kinetic[-1] - kinetic[0])
    # Trapezoids of 1 ms resolve the millisecond transients at start and zone edges to some tens of joules.
    assert abs(balance) < 1e-5 * kinetic[0]


# -- outputs --------------------------------------------------------------------------------------------------------

STATE = st.tuples(
    st.sampled_from([-10.0, 0.0, 5.0]),
    st.sampled_from([-3.0, -1e-3, 0.0, 1e-4, 0.3, 20.0]),
    st.sampled_from([-9.0, 0.0, 1.0, 30.0]),
)


@given(
    x=STATE,
    effort=st.sampled_from([-3e5, -5e3, 0.0, 2e3, 3e5]),
    gradient=st.floats(-0.03, 0.03),
    name=st.sampled_from(list(TRAINS)),
)
def test_the_acceleration_output_is_the_derivative_the_integrator_uses(
    x: tuple, effort: float, gradient: float, name: str
) -> None:
    train = TRAINS[name]
    p = parameters(train, **{"gradient[1]": gradient})
    state, u = np.array(x), np.array([effort])
    derivative = effective_flow(train, 1.0, state, u, p, np.sign(state[[1, 2]]))
    values = train.output(1.0, train.unpack_states(state), train.unpack_inputs(u), train.unpack_parameters(p))
    assert values["acceleration"] == pytest.approx(derivative[1], rel=1e-9, abs=1e-12)
    force = values["adhesion_force"] - values["resistance_force"] - values["gradient_force"]
    assert force == pytest.approx(MASS * values["acceleration"], rel=1e-9, abs=1e-6)


def test_the_slip_is_that_of_3_13_above_the_floor_and_guarded_below() -> None:
    runtime = started(TRAIN, x0=[0.0, 10.0, 10.5 / RADIUS])
    assert outputs(runtime)["slip"] == pytest.approx(0.05, rel=1e-12)
    runtime.x[:] = [0.0, 0.1, 0.2 / RADIUS]
    assert outputs(runtime)["slip"] == pytest.approx(0.1 / 0.5, rel=1e-12)


# Below the slip floor the creep curve saturates within 0.05 m/s while the brake moves the wheel by 0.07 m/s in an
# internal step: a linearly implicit step may throw the wheel across the curve once and nudge the train. Over a grid of
# 420 speeds and brakes the worst nudge was 4.0e-4 m/s; a real push of even 1 kN over the 10 ms of a row would be 1.1e-4
# m/s at every row.
CREEP_OVERSHOOT = 5e-4  # [m/s]


# -- laws -----------------------------------------------------------------------------------------------------------


@settings(max_examples=25)
@given(
    name=st.sampled_from(list(TRAINS)), speed=st.floats(0.0, 15.0), brake=st.floats(0.0, 350e3), degraded=st.booleans()
)
def test_a_brake_never_turns_the_wheel_backwards_nor_pushes_the_train(
    name: str, speed: float, brake: float, degraded: bool
) -> None:
    runtime = started(TRAINS[name], x0=rolling(speed), **(ALL_DEGRADED if degraded else NO_ZONES))
    runtime.u[0] = -brake
    rows = sampled(runtime, TIMES)
    assert np.isfinite(rows).all()
    assert (rows[:, 2] >= 0.0).all()
    assert (rows[:, 1] >= 0.0).all()
    assert (np.diff(rows[:, 1]) <= CREEP_OVERSHOOT).all()
    still = np.flatnonzero(rows[:, 1] == 0.0)
    if len(still):
        assert np.ptp(rows[still[0] :, 0]) == 0.0


@settings(max_examples=40)
@given(
    name=st.sampled_from(list(TRAINS)),
    brake=st.floats(0.0, 350e3),
    part=st.floats(-0.999, 0.999),
    degraded=st.booleans(),
)
def test_a_standing_train_stays_exactly_where_brake_and_resistance_can_hold_it(
    name: str, brake: float, part: float, degraded: bool
) -> None:
    limit = PEAK[float(degraded)] * WEIGHT  # Polach holds more than this; the smaller of the two serves both
    gradient = part * (900.0 + min(brake, limit)) / WEIGHT
    runtime = started(TRAINS[name], **{**(ALL_DEGRADED if degraded else NO_ZONES), "gradient[1]": gradient})
    runtime.u[0] = -brake
    runtime.advance(30.0)
    assert list(runtime.x) == [0.0, 0.0, 0.0]
    assert outputs(runtime)["acceleration"] == 0.0


@settings(max_examples=25)
@given(brake=st.floats(0.0, 60e3), more=st.floats(200.0, 2e4), degraded=st.booleans())
def test_a_standing_train_rolls_away_where_they_cannot(brake: float, more: float, degraded: bool) -> None:
    gradient = (900.0 + brake + more) / WEIGHT
    runtime = started(TRAIN, **NO_AIR, **{**(ALL_DEGRADED if degraded else NO_ZONES), "gradient[1]": gradient})
    runtime.u[0] = -brake
    runtime.advance(1.0)
    # Wheel and train roll as one body, but for the creep speed (at most 0.03 of the floor) and the step that lets go.
    assert runtime.x[1] == pytest.approx(-more / (MASS + ROTATING), rel=2e-3, abs=0.03 * 0.5 * ROTATING / MASS)


@settings(max_examples=20)
@given(name=st.sampled_from(list(TRAINS)), effort=st.floats(0.0, 900.0), degraded=st.booleans())
@example(name="burckhardt", effort=899.9, degraded=False)  # the wheel's step shoots past what it settles at
@example(name="polach", effort=900.0, degraded=False)  # rounding decides nothing
def test_traction_that_the_resistance_can_hold_moves_the_wheel_and_not_the_train(
    name: str, effort: float, degraded: bool
) -> None:
    runtime = started(TRAINS[name], **(ALL_DEGRADED if degraded else NO_ZONES))
    runtime.u[0] = effort
    rows = sampled(runtime, TIMES[:50])
    assert (rows[:, :2] == 0.0).all()
    assert outputs(runtime)["adhesion_force"] == pytest.approx(effort, rel=1e-9, abs=1e-9)


@settings(max_examples=25)
@given(name=st.sampled_from(list(TRAINS)), effort=st.floats(0.0, 350e3), degraded=st.booleans())
@example(name="burckhardt", effort=879.0, degraded=False)  # just below what holds the train
@example(name="burckhardt", effort=900.0, degraded=True)  # exactly what holds it
def test_a_wheel_that_spins_from_standstill_stays_finite_and_the_rail_gives_no_more_than_it_has(
    name: str, effort: float, degraded: bool
) -> None:
    runtime = started(TRAINS[name], **(ALL_DEGRADED if degraded else NO_ZONES))
    runtime.u[0] = effort
    limit = (0.56 if name == "polach" else PEAK[float(degraded)]) * WEIGHT
    last = 0.0
    for t in TIMES[:150]:
        runtime.advance(float(t))
        now = outputs(runtime)
        assert np.isfinite(list(now.values())).all()
        assert 0.0 <= now["adhesion_force"] <= limit * (1.0 + 1e-12)
        assert now["speed"] >= last
        last = now["speed"]


@settings(max_examples=20)
@given(
    name=st.sampled_from(list(TRAINS)),
    speed=st.floats(-5.0, 5.0),
    gradient=st.floats(-0.03, 0.03),
    brake=st.floats(0.0, 5e4),
)
def test_the_train_is_equal_in_the_mirror(name: str, speed: float, gradient: float, brake: float) -> None:
    runs = []
    for sign in (1.0, -1.0):
        runtime = started(
            TRAINS[name], x0=sign * np.array(rolling(speed)), **NO_ZONES, **{"gradient[1]": sign * gradient}
        )
        runtime.u[0] = -brake  # coasting or braked: both act against the motion, whichever way it goes
        runs.append(sign * sampled(runtime, TIMES[:100]))
    np.testing.assert_allclose(runs[0], runs[1], rtol=1e-12, atol=1e-12)


def test_a_train_without_brake_rolls_back_through_standstill() -> None:
    runtime = started(TRAIN, x0=rolling(0.5), **NO_ZONES, **NO_AIR, **{"gradient[1]": 0.008})
    rows = sampled(runtime, np.round(np.arange(0.01, 20.0, 0.01), 12))
    pull = WEIGHT * 0.008
    up, down = (pull + 900.0) / (MASS + ROTATING), (pull - 900.0) / (MASS + ROTATING)
    top = 0.5 / up
    assert rows[:, 0].max() == pytest.approx(0.5 * 0.5**2 / up, abs=1e-4)
    # creep: slip times the wheel's share of the mass
    assert rows[-1, 1] == pytest.approx(-down * (19.99 - top), rel=1e-4)


def test_a_locked_wheel_slides_on_the_friction_of_full_slip_and_recovers_when_released() -> None:
    runtime = started(TRAIN, x0=rolling(15.0), **NO_AIR, **ALL_DEGRADED)
    runtime.u[0] = -300e3
    runtime.advance(2.0)
    locked = outputs(runtime)
    assert (locked["wheel_speed"], locked["slip"]) == (0.0, -1.0)
    assert locked["adhesion_force"] == pytest.approx(-BURCKHARDT_DEGRADED.coefficient(1.0) * WEIGHT, rel=1e-12)
    assert locked["acceleration"] == pytest.approx((locked["adhesion_force"] - 900.0) / MASS, rel=1e-12)
    runtime.u[0] = 0.0
    runtime.advance(3.0)
    assert outputs(runtime)["slip"] == pytest.approx(0.0, abs=1e-4)


def test_a_zone_lets_the_wheel_slip_and_its_end_restores_it() -> None:
    runtime = started(TRAIN, x0=rolling(10.0), **{**NO_ZONES, "zone_from[1]": 1.0, "zone_to[1]": 2.0})
    runtime.u[0] = 60e3
    found = []
    for t in (0.9, 1.9, 2.9):
        runtime.advance(t)
        now = outputs(runtime)
        found.append((now["adhesion_degraded"], now["slip"]))
    assert [d for d, _ in found] == [0.0, 1.0, 0.0]
    force = MASS / (MASS + ROTATING) * 60e3  # about; the slip is that of the curve at this force
    for (_, slip), curve in zip(found, (BURCKHARDT_NOMINAL, BURCKHARDT_DEGRADED, BURCKHARDT_NOMINAL), strict=True):
        assert curve.coefficient(slip) * WEIGHT == pytest.approx(force, rel=1e-3)


def test_presets_hold_the_printed_numbers() -> None:
    def value(preset: str, name: str) -> float:
        p = TRAIN.unpack_parameters(TRAIN.start_parameters(preset))
        return float(getattr(p, name))

    assert [value("chapter_3", n) for n in ("mass", "davis_a", "davis_b", "davis_c", "n_axles")] == [
        90e3,
        900.0,
        32.0,
        1.7,
        1.0,
    ]
    assert value("chapter_3_four_axles", "n_axles") == 4.0
    assert [value("table_4_1", n) for n in ("mass", "davis_b", "davis_c")] == [166e3, 32.4, 1.6529]
    peak = BURCKHARDT_NOMINAL.peak()
    assert peak * 166e3 * 9.81 == pytest.approx(636e3, abs=600.0)  # independently measured, three digits
    assert value("table_4_1_motored_axles", "adhesive_share") * 166e3 == pytest.approx(90e3)


def test_four_axles_make_the_wheel_four_times_as_slow() -> None:
    time_constants = []
    for preset in ("chapter_3", "chapter_3_four_axles"):
        jacobian = TracedSystem(TRAIN).jacobian("flow", "x")(0.0, rolling(10.0), [0.0], TRAIN.start_parameters(preset))
        time_constants.append(-1.0 / float(jacobian[2, 2]))
    assert time_constants[1] == pytest.approx(4.0 * time_constants[0], rel=1e-12)
