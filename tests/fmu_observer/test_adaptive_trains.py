"""Train observers that learn the wheel radius and the Davis coefficients on the way."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from fmu_observer import OBSERVERS
from plant_models.hybrid import HybridSystem, Runtime, scalar_names

SPEED, ERROR = 30.0, 0.01  # [m/s], of the wheel radius


class Ride:
    """An observer on a train of constant true speed, its odometer wrong by a share."""

    def __init__(self, observer: HybridSystem, **parameters: float) -> None:
        self.runtime, self.observer = Runtime(observer), observer
        self.u = scalar_names(observer.input_signals)
        for name, value in parameters.items():
            self.runtime.p[scalar_names(observer.parameter_signals).index(name)] = value
        self.set(odometer=SPEED * (1.0 + ERROR))
        self.runtime.start(0.0)

    def set(self, **inputs: float) -> None:
        for name, value in inputs.items():
            self.runtime.u[self.u.index(name)] = value

    def past(self, instants: Sequence[float], off: Sequence[float] | float = 0.0) -> None:
        for t, wrong in zip(instants, np.broadcast_to(off, len(instants)), strict=True):
            self.runtime.advance(t)
            self.set(balise_position=100.0 + SPEED * t + wrong)
            self.runtime.trigger("balise")

    def reported(self) -> dict[str, Any]:
        names = scalar_names(self.observer.outputs)
        return dict(zip(names, map(float, self.runtime.update_outputs()), strict=True))


@pytest.fixture(scope="module")
def wheel() -> HybridSystem:
    return OBSERVERS["adaptive_wheel_radius"]()


def test_the_wheel_radius_is_found_without_noise(wheel: HybridSystem) -> None:
    ride = Ride(wheel)
    ride.past([3.0, 29.0, 31.0, 35.0, 37.0, 60.0, 80.0])
    ride.runtime.advance(85.0)
    reported = ride.reported()
    assert reported["wheel_radius_error"] == pytest.approx(ERROR, rel=0.01)
    assert reported["position"] == pytest.approx(100.0 + SPEED * 85.0, abs=1.0)
    assert reported["speed"] == pytest.approx(SPEED, rel=1e-4)
    assert reported["wheel_radius_error_deviation"] < 1e-3


def test_the_position_is_that_of_the_first_balise_and_readings_may_be_old(wheel: HybridSystem) -> None:
    ride = Ride(wheel, reading_age=0.2)
    ride.past([3.0])
    reported = ride.reported()
    assert reported["position"] == pytest.approx(100.0 + SPEED * 3.0, abs=1e-9)
    assert reported["position_deviation"] == pytest.approx(0.5)  # that of the balise


def test_its_variance_is_the_sum_of_the_responses_to_each_balise(wheel: HybridSystem) -> None:
    instants = [3.0, 29.0, 31.0, 37.0, 60.0]
    ends = []
    for k in range(-1, len(instants)):
        ride = Ride(wheel, gate=0.0)
        ride.past(instants, 1e-3 * (np.arange(len(instants)) == k))
        ride.runtime.advance(70.0)
        ends.append(ride.reported()["wheel_radius_error"])
    responses = (np.array(ends[1:]) - ends[0]) / 1e-3
    still = Ride(wheel, odometer_deviation=0.0)
    place = [i for i, s in enumerate(scalar_names(wheel.states)) if s.startswith("error_covariance")][3]
    still.runtime.x[place] = 0.0  # of the constant: known at the start
    still.past(instants)
    still.runtime.advance(70.0)
    expected = 0.5 * np.sqrt(np.sum(responses**2))
    # first order in the constant, which is still 1 % off at the start of the response
    assert still.reported()["wheel_radius_error_deviation"] == pytest.approx(expected, rel=0.03)


def test_at_standstill_the_wheel_radius_is_held_and_without_balises_it_becomes_unsure(wheel: HybridSystem) -> None:
    ride = Ride(wheel, forgetting=0.0)
    ride.past([3.0, 20.0])
    ride.runtime.advance(80.0)
    assert ride.reported()["wheel_radius_learnt"] == 1.0
    sure = ride.reported()["position_deviation"]
    ride.runtime.advance(200.0)
    assert ride.reported()["position_deviation"] > 2.0 * sure
    rest = Ride(wheel)
    rest.set(odometer=0.0)
    rest.past([3.0, 20.0], [0.0, -SPEED * 17.0])
    before = rest.reported()
    rest.runtime.advance(400.0)
    assert (before["wheel_radius_learnt"], rest.reported()["wheel_radius_learnt"]) == (0.0, 0.0)
    assert rest.reported()["wheel_radius_error"] == before["wheel_radius_error"]


def test_the_first_balise_after_long_does_not_make_it_stiff(wheel: HybridSystem) -> None:
    ride = Ride(wheel)
    ride.past([3.0, 400.0, 401.0])  # 12 km: without a limit the adaptation would be far too quick for its step
    ride.runtime.advance(450.0)
    assert ride.reported()["wheel_radius_error"] == pytest.approx(ERROR, rel=0.05)


def test_davis_coefficients_are_found_where_speed_varies() -> None:
    mass, davis = 900e3, (5400.0, 200.0, 12.0)
    observer = OBSERVERS["adaptive_davis"]()
    runtime = Runtime(observer)
    parameters = {"mass": mass, "davis_a": 4320.0, "davis_b": 160.0, "davis_c": 9.6}
    for name, value in parameters.items():
        runtime.p[scalar_names(observer.parameter_signals).index(name)] = value
    u, names = scalar_names(observer.input_signals), scalar_names(observer.outputs)
    rng, h, v, x, next_balise = np.random.default_rng(3), 0.2, 20.0, 0.0, 300.0
    runtime.u[u.index("odometer")] = v
    runtime.start(0.0)
    for k in range(2000):
        phase = (h * k) % 240.0
        pulling, coasting = phase < 70.0 and v < 39.0, phase < 150.0
        effort = 250e3 if pulling else 0.0 if coasting else -200e3 if v > 15.0 else 60e3
        runtime.u[u.index("effort")] = effort
        t, acceleration = h * k, (effort - davis[0] - davis[1] * v - davis[2] * v * v) / mass
        after = x + h * v + 0.5 * h * h * acceleration
        if after > next_balise:
            runtime.advance(t + (next_balise - x) / v)
            runtime.u[u.index("balise_position")] = next_balise + 0.5 * rng.normal()
            runtime.trigger("balise")
            next_balise += rng.choice([50.0, 300.0, 800.0])
        v, x = v + h * acceleration, after
        runtime.u[u.index("odometer")] = v + 0.05 * rng.normal()
        runtime.advance(t + h)
    reported = dict(zip(names, map(float, runtime.update_outputs()), strict=True))
    resistance = (davis[0] + davis[1] * v + davis[2] * v * v) / mass
    assert (
        abs(reported["resistance_per_mass"] - resistance)
        < 3.0 * reported["resistance_per_mass_deviation"]
        < 0.2 * resistance
    )
    for name, value in zip("abc", davis, strict=True):
        found, deviation = reported[f"davis_{name}_per_mass"], reported[f"davis_{name}_per_mass_deviation"]
        assert abs(found - value / mass) < 3.0 * deviation, name
        assert reported[f"davis_{name}_per_mass_learnt"] == 1.0
    assert abs(reported["speed"] - v) < 0.05
    assert abs(reported["position"] - x) < 2.0
