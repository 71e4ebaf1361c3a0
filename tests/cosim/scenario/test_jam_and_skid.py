"""The scenario of a skid on departure and a jam before the stop: ways lost in closed form, expectations met."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cosim import Scenario


@pytest.fixture(scope="module")
def outcome() -> Any:
    return Scenario.load("jam_and_skid").run(warn=lambda _: None)


def test_every_expectation_is_met_and_no_fault_is_left_over(outcome: Any) -> None:
    assert outcome.failure is None
    assert [e["name"] for e in outcome.result.summary["expectations"] if not e["passed"]] == []
    assert not any("wheel" in text or "train" in text.split(":")[0] for text in outcome.warnings)


def test_the_distance_of_the_wheel_lacks_and_gains_what_the_faults_take_and_give(outcome: Any) -> None:
    t, more = outcome["time"], outcome["wheel.wheel_distance"] - outcome["train.position"]
    speed, at = outcome["train.speed"], lambda instant: int(np.searchsorted(t, instant))
    assert more[at(11.9)] == 0.0

    def over(start: float, end: float) -> float:
        rows = slice(at(start - 1e-9), at(end - 1e-9) + 1)
        return float(np.trapezoid(speed[rows], t[rows]))

    # the speed is held over steps of 50 ms: half a step times what it changes by, 1.4 m/s times 0.3 and 0.7 m/s
    assert more[at(15.0)] == pytest.approx(0.3 * over(12.0, 14.0), abs=0.025 * 1.4 * 0.3 + 1e-3)
    assert more[-1] - more[at(60.0)] == pytest.approx(-over(70.0, 71.0), abs=0.025 * 0.7 + 1e-3)


def test_who_evaluates_the_odometer_stands_nearer_to_the_truth_than_who_believes_or_ignores_it(outcome: Any) -> None:
    true = outcome["train.position"][-1]
    error = {
        n: abs(outcome[f"{n}.position"][-1] - true) for n in ("quasi_lpv_uio", "adaptive_gain_cdo", "odometer_reset")
    }
    assert error["quasi_lpv_uio"] < 3.0
    assert min(error["adaptive_gain_cdo"], error["odometer_reset"]) > 6.0


@pytest.mark.parametrize(("loss", "dry_from"), [(0.0, 500.0), (0.7, 400.0)])
def test_a_wheel_locks_where_the_rails_are_wet_and_takes_its_brake_off(loss: float, dry_from: float) -> None:
    s = Scenario(stop=40.0, step=0.05)
    zone = {"zone_from[1]": 200.0, "zone_to[1]": dry_from}
    # set D: 0.78 m/s2 of adhesion at 30 m/s, 0.3 of it in the zone; the brake of 0.6 m/s2 is between the two
    s.add("train", model="longitudinal_train", preset="set_d", parameters={"train_speed": 30.0, "effort": -0.6, **zone})
    s.add("wheel", model="wheel_fault", options={"cause": "adhesion"}, parameters={"effort": -0.6, "jam_loss": loss})
    s.connect("train.wheel_speed -> wheel.speed", "train.adhesion_limit -> wheel.adhesion_limit")
    s.connect("wheel.effort_loss -> train.effort_loss")
    outcome = s.run(warn=lambda _: None)
    position, jammed, depth = outcome["train.position"], outcome["wheel.active"] > 0.0, outcome["wheel.depth"]
    begin, end = np.flatnonzero(jammed)[[0, -1]]
    # the wheel is told of the adhesion at communication points, 1.5 m apart; it rolls again in 0.146 s
    assert 200.0 <= position[begin] <= 200.0 + 2 * 1.5
    if loss:
        assert 400.0 <= position[end] <= 400.0 + 5 * 1.5
        braking = outcome["train.acceleration"][depth == -1.0]
        drag = outcome["train.resistance_force"][depth == -1.0]
        np.testing.assert_allclose(braking, -0.3 * 0.6 - drag, rtol=1e-9)
    else:  # the brake acts as if nothing were: the train stops in the zone, its wheel still locked
        assert position[-1] < dry_from
        np.testing.assert_allclose(outcome["train.acceleration"][0], -0.6 - 0.415, rtol=1e-9)
        assert end == len(jammed) - 1
