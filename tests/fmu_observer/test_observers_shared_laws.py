"""Laws that every train observer obeys, whatever its method."""

import subprocess
import sys
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from observer_runner import TRAIN_OBSERVERS, SteadyMotion, SystemRunner, random_gaps, started

from fmu_observer import OBSERVERS
from fmu_observer.detection import SlipIndicator
from fmu_observer.observers.train import TrainObserver

MOTION = SteadyMotion(speed=15.0, acceleration=0.1, slip_speed=0.4)

every_observer = pytest.mark.parametrize("make", TRAIN_OBSERVERS.values(), ids=TRAIN_OBSERVERS)
Make = Callable[[], TrainObserver]


@every_observer
def test_the_shared_signals_are_declared(make: Make) -> None:
    observer = make()
    assert [(s.name, s.unit) for s in observer.inputs] == [("effort", "N"), ("odometer", "m/s")]
    assert [s.name for s in observer.triggered_events] == ["balise"]
    assert [s.name for s in observer.triggered_events[0].payload] == ["balise_position", "balise_location_accuracy"]
    units = {s.name: s.unit for s in observer.outputs}
    assert units == {
        "position": "m",
        "speed": "m/s",
        "slip": "1",
        "adhesion_force": "N",
        "slip_indicator": "1",
        "innovation": "m",
        "rolls_back": "1",
    }
    shared = {"mass", "wheel_inertia", "n_axles", "wheel_radius", "davis_a", "davis_b", "davis_c", "slip_floor"}
    assert shared <= {s.name for s in observer.parameters}
    assert all(s.description for s in (*observer.parameters, *observer.states, *observer.inputs, *observer.outputs))


@every_observer
def test_it_starts_from_the_wrong_start_of_the_thesis(make: Make) -> None:
    runner = SystemRunner(make())  # before the start: an odometer sample at time zero already corrects
    assert (runner.outputs()["position"], runner.outputs()["speed"]) == (0.0, 1.0)


@every_observer
def test_redo_after_restore_is_bit_identical(make: Make) -> None:
    runner = started(make(), MOTION)
    runner.follow(MOTION, random_gaps(1, 0.5, 5), feed=0.01)
    snapshot = runner.runtime.snapshot()
    runner.follow(MOTION, random_gaps(2, 0.5, 5), feed=0.01)
    first = runner.runtime.x.copy()
    runner.follow(MOTION, [0.3], feed=0.01)
    runner.runtime.restore(snapshot)
    runner.follow(MOTION, random_gaps(2, 0.5, 5), feed=0.01)
    np.testing.assert_array_equal(runner.runtime.x, first)


@every_observer
@settings(max_examples=15, deadline=None)
@given(cuts=st.lists(st.integers(1, 399), max_size=6, unique=True))
def test_splitting_a_step_on_the_grid_changes_nothing(make: Make, cuts: list[int]) -> None:
    whole, split = started(make(), MOTION), started(make(), MOTION)
    for runner in (whole, split):
        runner.follow(MOTION, [0.137])  # a stamp off the grid stays part of both histories
    base = whole.runtime.t
    for k in sorted(cuts):
        split.runtime.advance(round(base + 0.001 * k, 3))
    for runner in (whole, split):
        runner.runtime.advance(0.537)
    np.testing.assert_array_equal(split.runtime.x, whole.runtime.x)


@every_observer
def test_the_traced_kernel_and_plain_numpy_agree(make: Make) -> None:
    traced, python = started(make(), MOTION), started(make(), MOTION, python=True)
    for runner in (traced, python):
        runner.follow(MOTION, random_gaps(3, 0.5, 3), feed=0.05)
    # The same operations in another order: rounding only, which the differentiator's sign may amplify by its chatter
    # (1e-9).
    np.testing.assert_allclose(traced.runtime.x, python.runtime.x, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(traced.runtime.update_outputs(), python.runtime.update_outputs(), rtol=1e-9, atol=1e-6)


@every_observer
@pytest.mark.parametrize(
    ("effort", "odometer"),
    [(0.0, 0.0), (-60e3, 0.0), (-350e3, 0.0), (350e3, 60.0)],
    ids=["rest", "held", "lock", "spin"],
)
def test_outputs_stay_finite_without_any_balise(make: Make, effort: float, odometer: float) -> None:
    runner = SystemRunner(make())
    runner.runtime.x[1] = 15.0  # the speed, or the odometer speed, is the second state of every observer
    runner.set("u", {"effort": effort, "odometer": odometer})
    runner.runtime.start(0.0)
    runner.runtime.advance(30.0)
    assert np.all(np.isfinite(list(runner.outputs().values())))


@every_observer
def test_a_braked_train_is_held_at_rest_and_not_pushed_back(make: Make) -> None:
    runner = started(make(), SteadyMotion(speed=0.0))
    runner.set("u", {"effort": -60e3, "odometer": 0.0})
    for _ in range(40):
        runner.runtime.advance(runner.runtime.t + 0.4)
        runner.balise(0.0)
    runner.runtime.advance(runner.runtime.t + 60.0)  # a minute without balises
    assert abs(runner.outputs()["speed"]) < 1e-3  # [m/s], against 40 m/s backwards if the brake pushed
    assert abs(runner.outputs()["position"]) < 0.01


@every_observer
def test_wheel_lock_raises_the_indicator(make: Make) -> None:
    runner = started(make(), SteadyMotion(speed=15.0))
    runner.follow(SteadyMotion(speed=15.0), random_gaps(4, 0.5, 40))
    assert runner.outputs()["slip_indicator"] == 1.0
    runner.set("u", {"odometer": 0.0})
    runner.runtime.advance(runner.runtime.t + 0.3)
    assert runner.outputs()["slip_indicator"] == 2.0


@every_observer
def test_a_batch_flows_like_its_members(make: Make) -> None:
    observer = make()
    generator = np.random.default_rng(5)
    x = generator.normal(size=(observer.state_count, 3))
    u = generator.normal(10.0, 1.0, size=(len(observer.start_inputs()), 3))
    p = np.tile(observer.start_parameters()[:, None], 3)
    flows, jumps = observer.state_derivative(0.0, x, u, p), observer.jump_vector("balise", 0.0, x, u, p)
    for k in range(3):
        np.testing.assert_allclose(flows[:, k], observer.state_derivative(0.0, x[:, k], u[:, k], p[:, k]), rtol=1e-12)
        np.testing.assert_allclose(
            jumps[:, k], observer.jump_vector("balise", 0.0, x[:, k], u[:, k], p[:, k]), rtol=1e-12
        )


def test_the_registry_names_every_observer() -> None:
    assert {"differentiator_cdo", "takagi_sugeno_cdo", "multirate_cdo", "discrete_uio", "slip_indicator"} <= set(
        OBSERVERS
    )
    assert all(system.name == name for name, system in OBSERVERS.items())
    assert [n for n, members in OBSERVERS.members.items() if len(members) > 1] == [], "two systems of one name"
    assert OBSERVERS["slip_indicator"] is SlipIndicator


def test_casadi_is_loaded_with_the_first_block() -> None:
    code = """import sys, fmu_observer
cls = fmu_observer.OBSERVERS["differentiator_cdo"]
assert "casadi" not in sys.modules
from fmu_observer.block import make_block
make_block(cls()).instantiate()
assert "casadi" in sys.modules"""
    subprocess.run([sys.executable, "-c", code], check=True)
