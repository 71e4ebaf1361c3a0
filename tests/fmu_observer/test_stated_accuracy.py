"""LAW: an accuracy that comes with a telegram weighs it, in every observer that is told of balises.

The error that a balise causes which is off by 5 m falls with the accuracy that it tells, and one that tells nothing, or
no accuracy, is used as it was before.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from itertools import pairwise

import numpy as np
import pytest
from observer_runner import SystemRunner
from test_innovation_gate import GAP, MAKERS, MOTION, gated_of
from test_kalman_filters import Vehicle

from fmu_observer import OBSERVERS
from fmu_observer.observers.gated_observer import GatedObserver
from fmu_observer.observers.innovation_gate import OFF, place_deviation
from fmu_observer.observers.train import BaliseMovingHorizon, EtcsOdometry, IntervalOdometry
from fmu_observer.observers.train.adaptive_wheel_radius import PRIOR

ROBUST = BaliseMovingHorizon.name
"""A loss that doubts outliers doubts those the more that tell an accuracy which they do not keep."""
INTERVALS = (EtcsOdometry.name, IntervalOdometry.name)
"""An accuracy is a width to them: `test_etcs_odometry`, `test_interval_odometry`."""
LAWFUL = {n: m for n, m in MAKERS.items() if n not in (ROBUST, *INTERVALS)} | {
    f"{ROBUST} with squares": cache(partial(BaliseMovingHorizon, loss="squares"))
}
OFFSET, REPORTED = 5.0, (0.0, 1.0, 5.0, 20.0, 63.0)
every = pytest.mark.parametrize("make", LAWFUL.values(), ids=LAWFUL)


def caused(make: Callable[[], GatedObserver], accuracy: float) -> float:
    """Largest error of the position, until the next one, that a balise makes which is off and tells so much [m]."""
    runner = gated_of(make, OFF)
    runner.runtime.advance(runner.runtime.t + GAP)
    place = MOTION.position(runner.runtime.t)
    before = abs(float(runner.runtime.x[0]) - place)
    runner.set("u", {"balise_position": place + OFFSET, "balise_location_accuracy": accuracy})
    runner.runtime.trigger("balise")
    largest = 0.0
    for _ in range(6):
        largest = max(largest, abs(float(runner.runtime.x[0]) - MOTION.position(runner.runtime.t)) - before)
        runner.runtime.advance(runner.runtime.t + GAP / 6.0)
    return largest


@every
def test_the_error_of_a_balise_falls_with_the_accuracy_that_it_states(make: Callable[[], GatedObserver]) -> None:
    errors = [caused(make, accuracy) for accuracy in REPORTED]
    assert errors[0] > 0.02, errors  # it acts
    assert all(later < earlier for earlier, later in pairwise(errors)), errors
    assert errors[-1] < 0.05 * errors[0], errors


@every
@pytest.mark.parametrize("reported", [-1.0, float("nan"), 0.25])
def test_an_accuracy_that_is_none_or_better_than_the_floor_changes_no_bit(
    make: Callable[[], GatedObserver], reported: float
) -> None:
    ends = []
    for accuracy in (0.0, reported):
        runner = gated_of(make, OFF)
        runner.runtime.advance(runner.runtime.t + GAP)
        runner.set("u", {"balise_position": MOTION.position(runner.runtime.t), "balise_location_accuracy": accuracy})
        runner.runtime.trigger("balise")
        runner.runtime.advance(runner.runtime.t + GAP)
        ends.append(runner.runtime.x[:2].copy())
    np.testing.assert_array_equal(*ends)


FILTERS = ("kalman_filter", "extended_kalman_filter", "unscented_kalman_filter", "moving_horizon_observer")


@pytest.mark.parametrize(
    ("name", "form"), [(n, f) for n in FILTERS for f in ("joseph", "square_root") if f in OBSERVERS[n].forms]
)
def test_filters_weigh_a_balise_by_its_variance(name: str, form: str) -> None:
    """One told with 20 m does to estimate and spread what one of nothing told does where RN is that variance."""
    system = OBSERVERS[name](Vehicle(), outputs=["position", "speed"], arrival=["balise", "periodic"], form=form)
    ends = []
    for accuracy, deviation in ((20.0, 1e-2), (0.0, float(place_deviation(20.0, 1e-2)))):
        runner = SystemRunner(system, gate=OFF)
        runner.set("p", {"measurement_covariance[1]": deviation**2, "measurement_covariance[4]": 1e-4})
        runner.set("u", {"measured_speed": 10.0, "balise_location_accuracy": accuracy})
        runner.runtime.start(0.0)
        for k in range(1, 6):
            runner.runtime.advance(3.0 * k)
            runner.balise(30.0 * k + 5.0)
        ends.append(runner.runtime.update_outputs().copy())
    np.testing.assert_allclose(ends[0], ends[1], rtol=1e-9, atol=1e-9)  # rounding, of 30 additions


def test_a_robust_loss_makes_no_balise_weigh_more() -> None:
    robust, squares = MAKERS[ROBUST], LAWFUL[f"{ROBUST} with squares"]
    for accuracy in REPORTED:
        assert caused(robust, accuracy) <= caused(squares, accuracy)


def test_what_a_stated_accuracy_leaves_is_reported_honestly() -> None:
    """150 wheels with a radius of their own, balises anywhere within the accuracy that each tells."""
    system, rng, v = OBSERVERS["adaptive_wheel_radius"](), np.random.default_rng(3), 20.0
    ratios = []
    for _ in range(150):
        runner = SystemRunner(system, gate=OFF, odometer_deviation=0.0, internal_step=0.1)
        scale = float(rng.normal()) * PRIOR
        runner.set("u", {"odometer": v / (1.0 + scale)})
        runner.runtime.start(0.0)
        for k in range(1, 25):
            runner.runtime.advance(15.0 * k)
            accuracy = (0.0, 20.0, 5.0)[k % 3]
            off = float(rng.uniform(-accuracy, accuracy) if accuracy > 0.0 else 0.5 * rng.normal())
            runner.set("u", {"balise_location_accuracy": accuracy})
            runner.balise(v * 15.0 * k + off)
        reported = runner.outputs()
        wrong = reported["position"] - v * 15.0 * 24, reported["wheel_radius_error"] - (1.0 / (1.0 + scale) - 1.0)
        ratios.append((wrong[0] / reported["position_deviation"], wrong[1] / reported["wheel_radius_error_deviation"]))
    rms = np.sqrt(np.mean(np.square(ratios), axis=0))
    assert np.abs(rms - 1.0).max() < 3.0 / np.sqrt(2.0 * 150.0)  # three deviations of the rms of so many


@pytest.mark.parametrize("name", ["discrete_measurement_observer", "continuous_discrete_observer"])
def test_the_position_bound_holds_with_balises_anywhere_in_their_accuracy(name: str) -> None:
    rng, system = np.random.default_rng(7), OBSERVERS[name]()
    widths = []
    for accuracy in (0.0, 2.0, 12.0, 63.0) * 3:
        runner = SystemRunner(system, gate=OFF)
        runner.set("u", {"odometer": MOTION.speed, "effort": MOTION.effort(0.0), "balise_location_accuracy": accuracy})
        runner.set("x", {"estimated_speed": MOTION.speed, "held_speed": MOTION.speed})
        runner.runtime.start(0.0)
        for k in range(1, 8):
            runner.runtime.advance(4.0 * k)
            runner.balise(MOTION.position(4.0 * k) + float(rng.uniform(-accuracy, accuracy)))
            reported = runner.outputs()
            assert (
                abs(reported["position"] - MOTION.position(4.0 * k)) <= reported["position_bound"] + 1e-6
            )  # of integration
        widths.append(reported["position_bound"])
    assert widths[:4] == sorted(widths[:4])
