"""The indirect brake of the train: the wave in the pipe, the cylinders, and what brakes may and may never do."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from railway_runs import outputs, started
from train_runs import DELAY, NO_DRAG, column, recorded, running

from plant_models.railway.vehicle.train import Train

TRAIN, SHORT = Train(), Train(wagons=2)
BAR = 1e5
STEP_AT = 0.2  # [s], an instant of reading


def _stepped(train: Train, until: float, demand: float = 1.0, **changes: float):
    """A running train whose brake demand steps at `STEP_AT`."""
    runtime = running(train, 15.0, **changes)
    runtime.advance(STEP_AT)  # a communication step ends here, and the reading at its end knows nothing of the next one
    runtime.u[1] = demand
    runtime.advance(until)
    return runtime


@pytest.mark.parametrize("delay_samples", [1, 5])
def test_the_wave_reaches_vehicle_i_exactly_i_minus_one_delays_after_the_first(delay_samples: int) -> None:
    train = Train(wagons=3, delay_samples=delay_samples)
    runtime = _stepped(train, STEP_AT)
    for i in range(4):
        due = STEP_AT + i * 0.01 * delay_samples
        if i > 0:
            runtime.advance(due - 1e-6)
            assert outputs(runtime)[f"pipe_pressure[{i + 1}]"] == 5.0 * BAR
            assert outputs(runtime)[f"cylinder_pressure[{i + 1}]"] == 0.0
        runtime.advance(due)
        assert outputs(runtime)[f"pipe_pressure[{i + 1}]"] == pytest.approx(3.5 * BAR, rel=1e-14)
        runtime.advance(due + 1e-6)
        assert outputs(runtime)[f"cylinder_pressure[{i + 1}]"] > 0.0


@pytest.mark.parametrize("demand", [0.4, 1.0])
def test_cylinders_fill_and_vent_as_lags_of_first_order(demand: float) -> None:
    runtime = _stepped(TRAIN, 3.0, demand)
    elapsed = 3.0 - STEP_AT - DELAY * np.arange(5)
    full = [3.5 * BAR * demand * (1.0 - np.exp(-t / 1.3)) for t in elapsed]
    assert runtime.x[14:19] == pytest.approx(full, rel=1e-6)  # the step is of second order: (1 ms / 1.3 s)^2
    runtime.u[1] = 0.0
    runtime.advance(10.0)
    venting = 10.0 - 3.0 - DELAY * np.arange(5)
    filled = [3.5 * BAR * demand * (1.0 - np.exp(-(3.0 - STEP_AT) / 1.3))] * 5
    assert runtime.x[14:19] == pytest.approx(filled * np.exp(-venting / 8.0), rel=1e-6)


@given(demand=st.floats(-3.0, 3.0))
@settings(max_examples=5)
def test_the_pipe_keeps_its_printed_limits(demand: float) -> None:
    rows = recorded(_stepped(SHORT, 0.3, demand), np.array([0.5, 5.0]))
    pipe, cylinder = (rows[:, column(SHORT, name) :][:, :3] for name in ("pipe_pressure[1]", "cylinder_pressure[1]"))
    assert (pipe >= 3.5 * BAR).all()
    assert (pipe <= 5.0 * BAR).all()
    assert (cylinder >= 0.0).all()
    assert (cylinder <= 3.5 * BAR).all()


def test_full_service_slows_the_train_down_by_braked_mass_over_mass() -> None:
    runtime = _stepped(TRAIN, 12.0, **NO_DRAG)  # 9 time constants: full but for 1e-4
    now, rotating = outputs(runtime), 4 * 225.0 / 0.575**2
    assert now["wagon_brake_force"] == pytest.approx(4 * 21e3, rel=2e-4)
    # The rail carries the locomotive's brake less what the wheels' own inertia takes; slip makes them turn 1 % slower.
    assert -now["adhesion_force"] == pytest.approx(80e3 + rotating * now["acceleration"], rel=5e-4)
    # the couplers still ring a little
    assert -now["acceleration"] == pytest.approx(164e3 / (166e3 + rotating), rel=5e-3)


def test_the_brake_stops_the_train_on_a_hill_and_holds_it() -> None:
    runtime = running(TRAIN, 4.0, brake=1.0, **{"gradient[1]": -0.008})
    runtime.advance(20.0)
    assert (runtime.x[5:14] == 0.0).all()
    held = runtime.x.copy()
    runtime.advance(60.0)
    assert (runtime.x[:14] == held[:14]).all()
    now = outputs(runtime)
    assert now["gradient_force"] == pytest.approx(-13.03e3, abs=5.0)  # 166 t, 8 per mille: independently measured
    assert now["acceleration"] == 0.0
    # What holds each vehicle is what pulls at it: rail, brakes and the constant Davis terms carry the weight between
    # them.
    total = now["adhesion_force"] - now["resistance_force"] - now["gradient_force"] - now["wagon_brake_force"]
    assert total == pytest.approx(0.0, abs=1e-6)
    runtime.u[1] = 0.0
    runtime.advance(120.0)
    assert runtime.x[5] > 1.0  # released, it rolls down


def test_the_wagons_brakes_alone_hold_the_train() -> None:
    runtime = running(TRAIN, 2.0, brake=1.0, braked_mass=0.0, **{"gradient[1]": 0.008})
    runtime.advance(30.0)
    stopped = runtime.x[:14].copy()
    assert (stopped[5:10] == 0.0).all()
    runtime.advance(50.0)
    assert (runtime.x[:10] == stopped[:10]).all()


@settings(max_examples=10)
@given(demand=st.floats(0.0, 1.0), gradient=st.floats(-0.02, 0.02), tension=st.floats(-0.003, 0.003))
def test_brakes_never_push_a_train_at_rest(demand: float, gradient: float, tension: float) -> None:
    """What a brake does at rest, a train without brakes must do at least as much."""
    braked = running(SHORT, 0.0, brake=demand, **{"gradient[1]": gradient})
    free = running(SHORT, 0.0, **{"gradient[1]": gradient})
    for runtime in (braked, free):
        runtime.x[1:3] = tension
        energy = [_mechanical(runtime.x, gradient)]
        for t in np.round(np.arange(0.1, 4.05, 0.1), 9):
            runtime.advance(float(t))
            energy.append(_mechanical(runtime.x, gradient))
        assert (np.diff(energy) <= 1e-9 * 1e5).all()  # [J] of a train that could be given 1e5 by its gradient


def _mechanical(x: np.ndarray, gradient: float) -> float:
    """Kinetic, elastic and potential energy of the train with two wagons [J]."""
    masses = np.array([90e3, 19e3, 19e3])
    positions = x[0] - np.concatenate([[0.0], np.cumsum(x[1:3])])
    kinetic = 0.5 * masses @ x[3:6] ** 2 + 0.5 * 225.0 * (x[6:10] ** 2).sum()
    return float(kinetic + 0.5 * 2.5e6 * (x[1:3] ** 2).sum() + masses @ positions * 9.81 * gradient)


def _demanded(t: float) -> float:
    """A demand on the grid of readings."""
    return 0.2 * (int(t / 0.02 + 1e-6) % 6)


@pytest.mark.parametrize("step", [0.01, 0.02])
def test_a_demand_on_the_grid_of_readings_reaches_every_vehicle_at_its_time_and_no_period_late(step: float) -> None:
    """The cylinders against their lag of first order under the demand of `(i - 1) tau` ago, in exact pieces."""
    runtime = running(SHORT, 15.0)
    for k in range(round(0.4 / step)):
        runtime.u[1] = _demanded(k * step)
        runtime.advance((k + 1) * step)
    for i in range(3):
        pressure = 0.0
        for k in range(40):
            asked = 3.5 * BAR * _demanded(k * 0.01 - DELAY * i) if k * 0.01 - DELAY * i > -1e-9 else 0.0
            time = 1.3 if asked > pressure else 8.0
            pressure = asked + (pressure - asked) * np.exp(-0.01 / time)
        found = outputs(runtime)[f"cylinder_pressure[{i + 1}]"]
        assert found == pytest.approx(pressure, rel=1e-4)  # a pressure that passes what is asked changes its time


def test_a_change_between_readings_reaches_the_vehicles_behind_as_the_mean_of_its_period() -> None:
    runtime = running(Train(wagons=1), 15.0)
    runtime.advance(0.1025)
    runtime.u[1] = 0.8
    runtime.advance(0.11)
    runtime.advance(0.15)
    assert outputs(runtime)["pipe_pressure[1]"] == pytest.approx(5.0 * BAR - 0.8 * 1.5 * BAR)
    assert outputs(runtime)["pipe_pressure[2]"] == pytest.approx(5.0 * BAR - 0.6 * 1.5 * BAR)


def test_the_effort_at_the_rims_holds_the_indirect_brake_of_the_locomotive() -> None:
    runtime = _stepped(TRAIN, 3.0, 0.5)
    runtime.u[0] = -20e3
    now = outputs(runtime)
    air = 80e3 * (now["cylinder_pressure[1]"] - 0.3 * BAR) / (3.2 * BAR)
    assert air > 20e3
    assert now["rim_effort"] == pytest.approx(-20e3 - air)
    runtime.u[0] = 0.0
    runtime.advance(3.5)
    now, rotating = outputs(runtime), 4 * 225.0 / 0.575**2
    # The rail carries it, less what slows the wheels down.
    assert now["adhesion_force"] == pytest.approx(now["rim_effort"] - rotating * now["acceleration"], rel=2e-3)
    each = started(Train(wagons=1, effort_per_axle=True), u0=[1e3, 2e3, 3e3, -4e3, 0.0])
    assert outputs(each)["rim_effort"] == 2e3
