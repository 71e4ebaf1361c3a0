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
from observer_bench import Bench
from test_innovation_gate import GAP, MAKERS, MOTION, bench_of
from test_kalman_filters import Vehicle

from fmu_observer import OBSERVERS
from fmu_observer.observers.gated_observer import GatedObserver
from fmu_observer.observers.innovation_gate import OFF, place_deviation
from fmu_observer.observers.train import BaliseMovingHorizon

ROBUST = BaliseMovingHorizon.name
"""A loss that doubts outliers doubts those the more that tell an accuracy which they do not keep."""
LAWFUL = {n: m for n, m in MAKERS.items() if n != ROBUST} | {
    f"{ROBUST} with squares": cache(partial(BaliseMovingHorizon, loss="squares"))
}
OFFSET, TOLD = 5.0, (0.0, 1.0, 5.0, 20.0, 63.0)
every = pytest.mark.parametrize("make", LAWFUL.values(), ids=LAWFUL)


def caused(make: Callable[[], GatedObserver], accuracy: float) -> float:
    """Largest error of the position, until the next one, that a balise makes which is off and tells so much [m]."""
    bench = bench_of(make, OFF)
    bench.runtime.advance(bench.runtime.t + GAP)
    place = MOTION.position(bench.runtime.t)
    before = abs(float(bench.runtime.x[0]) - place)
    bench.set("u", {"balise_position": place + OFFSET, "balise_location_accuracy": accuracy})
    bench.runtime.trigger("balise")
    largest = 0.0
    for _ in range(6):
        largest = max(largest, abs(float(bench.runtime.x[0]) - MOTION.position(bench.runtime.t)) - before)
        bench.runtime.advance(bench.runtime.t + GAP / 6.0)
    return largest


@every
def test_the_error_of_a_balise_falls_with_the_accuracy_that_it_tells(make: Callable[[], GatedObserver]) -> None:
    errors = [caused(make, accuracy) for accuracy in TOLD]
    assert errors[0] > 0.02, errors  # it acts
    assert all(later < earlier for earlier, later in pairwise(errors)), errors
    assert errors[-1] < 0.05 * errors[0], errors


@every
@pytest.mark.parametrize("told", [-1.0, float("nan"), 0.25])
def test_an_accuracy_that_is_none_or_better_than_the_floor_changes_no_bit(
    make: Callable[[], GatedObserver], told: float
) -> None:
    ends = []
    for accuracy in (0.0, told):
        bench = bench_of(make, OFF)
        bench.runtime.advance(bench.runtime.t + GAP)
        bench.set("u", {"balise_position": MOTION.position(bench.runtime.t), "balise_location_accuracy": accuracy})
        bench.runtime.trigger("balise")
        bench.runtime.advance(bench.runtime.t + GAP)
        ends.append(bench.runtime.x[: make().position_state + 2].copy())
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
        bench = Bench(system, gate=OFF)
        bench.set("p", {"measurement_covariance[1]": deviation**2, "measurement_covariance[4]": 1e-4})
        bench.set("u", {"measured_speed": 10.0, "balise_location_accuracy": accuracy})
        bench.runtime.start(0.0)
        for k in range(1, 6):
            bench.runtime.advance(3.0 * k)
            bench.balise(30.0 * k + 5.0)
        ends.append(bench.runtime.update_outputs().copy())
    np.testing.assert_allclose(ends[0], ends[1], rtol=1e-9, atol=1e-9)  # rounding, of 30 additions


def test_a_robust_loss_makes_no_balise_weigh_more() -> None:
    robust, squares = MAKERS[ROBUST], LAWFUL[f"{ROBUST} with squares"]
    for accuracy in TOLD:
        assert caused(robust, accuracy) <= caused(squares, accuracy)
