"""The quasi-LPV observer against the printed equations, integrated by SciPy; jams, balises, certificates, scenario."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from observer_runner import SystemRunner
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from cosim import Scenario
from fmu_observer.certificates.gap_findings import GROWTH
from fmu_observer.design.quasi_lpv_published import PUBLISHED, SECTION_3_3_4
from fmu_observer.observers.train import OdometerReset, QuasiLpvUio
from fmu_observer.observers.train.quasi_lpv_uio import speed_errors

PERIOD = 0.2
OPTIONS = [("repaired", "innovation"), ("printed", "reading")]


def brake(
    observer: Any, seconds: float, jam: tuple[float, float, float] = (99.0, 0.0, 0.0), **values: float
) -> SystemRunner:
    """A train at 40 m/s that brakes with 0.9 m/s2 of which 0.68 are known, without drag; readings are exact."""
    runner = SystemRunner(observer, **{"davis_a": 0.0, "davis_b": 0.0, "davis_c": 0.0, **values})
    runner.set("x", {"estimated_speed": 40.0, "unknown_deceleration": 0.22, "last_disturbance": 0.22})
    runner.set("u", {"effort": -0.68, "odometer": 40.0})
    runner.runtime.start(0.0)
    goes_on(runner, seconds, jam)
    return runner


def goes_on(runner: SystemRunner, until: float, jam: tuple[float, float, float]) -> None:
    onset, length, depth = jam
    for k in range(round(runner.runtime.t / PERIOD) + 1, round(until / PERIOD) + 1):
        t = k * PERIOD
        share = 1.0 - depth if onset - 1e-9 <= t < onset + length - 1e-9 else 1.0
        runner.set("u", {"odometer": (40.0 - 0.9 * t) * share})
        runner.runtime.advance(t)


@pytest.mark.parametrize(("rules", "hold"), OPTIONS)
@pytest.mark.parametrize("preset", ["as_published", "as_published_5_3_1"])
def test_between_samples_it_is_the_printed_equation(rules: Any, hold: Any, preset: str) -> None:
    """(3.44) from one sample to the next, both vertices blended by hand."""
    design = PUBLISHED["section_3_3_4" if preset == "as_published" else "section_5_3_1"]
    runner = SystemRunner(QuasiLpvUio(rules, hold), preset=preset)
    start = np.array([3.0, 30.0, 0.1, 0.02])
    runner.runtime.x[:4] = start
    y, effort, mass = 31.0, 0.4, 1.0
    runner.set("u", {"effort": effort, "odometer": y})
    runner.runtime.start(0.0)
    runner.runtime.advance(0.19)
    h = (design.high - y) / (design.high - design.low)
    A = h * design.vertices[0] + (1.0 - h) * design.vertices[1]
    K = (h * design.gains[0] + (1.0 - h) * design.gains[1])[:, 0]

    def rate(_t: float, x: np.ndarray) -> np.ndarray:
        innovation = y - (x[1] if hold == "reading" else start[1])
        return np.append(x[1], A @ x[1:] + np.array([(effort - design.davis_a) / mass, 0.0, 0.0]) + K * innovation)

    exact = solve_ivp(rate, (0.0, 0.19), start, rtol=1e-11, atol=1e-12).y[:, -1]
    np.testing.assert_allclose(runner.runtime.x[:4], exact, rtol=1e-8)  # Runge-Kutta at 10 ms


def test_a_held_reading_lags_by_half_a_period_and_a_held_innovation_does_not() -> None:
    """In the steady state of a braking with 0.9 m/s2: 0.09 m/s, M times that in the residual."""
    for rules, hold, lag in (("printed", "reading", 0.09), ("repaired", "innovation", 0.0)):
        runner = brake(QuasiLpvUio(rules, hold), 20.0, rule_4=0.0) if rules == "printed" else brake(QuasiLpvUio(), 20.0)
        assert runner.outputs()["speed"] - (40.0 - 18.0) == pytest.approx(lag, abs=0.01)


def test_the_age_of_an_aggregated_reading_is_made_up_for() -> None:
    for age, lag in ((0.0, 0.09), (0.1, 0.0)):
        runner = brake(QuasiLpvUio(), 0.2, reading_age=age)
        for k in range(2, 100):
            runner.set("u", {"odometer": 40.0 - 0.9 * (k * PERIOD - 0.1)})  # the mean of the past period
            runner.runtime.advance(k * PERIOD)
        assert runner.outputs()["speed"] - (40.0 - 0.9 * 99 * PERIOD) == pytest.approx(lag, abs=0.005)


@pytest.mark.parametrize("depth", [0.1, 0.5, 1.0])
def test_a_jam_does_not_move_it(depth: float) -> None:
    runner = brake(QuasiLpvUio(), 10.0, jam := (10.0, 3.0, depth))
    assert runner.outputs()["odometer_fault"] == 1.0  # at the very sample
    goes_on(runner, 13.2, jam)
    assert runner.outputs()["odometer_fault"] == 0.0
    goes_on(runner, 20.0, jam)
    true = 40.0 * 20.0 - 0.45 * 20.0**2
    assert runner.outputs()["position"] == pytest.approx(true, abs=0.05)


def test_a_jam_that_begins_within_a_sample_teaches_nothing() -> None:
    """The reading before is low by less than eps / M already; what it taught the disturbance is taken back."""
    runner = brake(QuasiLpvUio(), 10.0)
    before = runner.outputs()["disturbance"]
    for k, low in ((51, 0.3), (52, 8.0)):
        runner.set("u", {"odometer": 40.0 - 0.9 * k * PERIOD - low})
        runner.runtime.advance(k * PERIOD)
    assert runner.outputs()["odometer_fault"] == 1.0
    assert runner.outputs()["disturbance"] == pytest.approx(before, abs=1e-6)
    runner.runtime.advance(11.4)
    assert runner.outputs()["disturbance"] == pytest.approx(before, abs=1e-6)


def test_a_skid_does_not_move_it_either() -> None:
    runner = SystemRunner(QuasiLpvUio(), davis_a=0.0, davis_b=0.0, davis_c=0.0)
    runner.set("u", {"effort": 0.5})
    runner.runtime.start(0.0)
    reported = []
    for k in range(1, 100):
        t = k * PERIOD
        runner.set("u", {"odometer": 0.5 * t * (1.3 if 10.0 <= t - 1e-9 < 12.0 else 1.0)})
        runner.runtime.advance(t)
        reported.append(runner.outputs()["odometer_fault"])
    assert PERIOD * (1 + np.flatnonzero(reported)[[0, -1]]) == pytest.approx([10.2, 12.2], abs=0.21)
    assert runner.outputs()["speed"] == pytest.approx(0.5 * 99 * PERIOD, abs=0.02)


def test_the_printed_rules_latch_up_where_the_repaired_ones_recover() -> None:
    """Scenario 3.3.4 with its start 0.9 m/s off and no arming delay: specs of the printed rules."""
    ends = {}
    for rules, hold in OPTIONS:
        off = {"rule_4": 0.0} if rules == "printed" else {"settle_samples": 1.0}
        runner = SystemRunner(QuasiLpvUio(rules, hold), arming_delay=0.0, **off)  # type: ignore[arg-type]
        runner.set("x", {"estimated_speed": 44.1})
        runner.set("u", {"effort": -0.68, "odometer": 45.0})
        runner.runtime.start(0.0)
        for k in range(1, 200):
            runner.set("u", {"odometer": 45.0 - 0.9 * k * PERIOD})
            runner.runtime.advance(k * PERIOD)
        ends[rules] = runner.outputs()
    assert ends["printed"]["odometer_fault"] == 1.0
    assert abs(ends["printed"]["speed"] - 9.18) > 50.0
    assert ends["repaired"]["speed"] == pytest.approx(9.18, abs=0.2)


def test_a_wheel_that_never_rolls_again_is_found_out_by_balises() -> None:
    """Stuck 10 % low from 10 s to 28 s; without a balise the model cannot refuse it for so long."""
    for spaced, reported in ((100.0, 1.0), (1e9, 0.0)):
        runner = brake(QuasiLpvUio(), 10.0, jam := (10.0, 1e3, 0.1), least_speed=0.0)
        passed, faults = np.floor((400.0 - 45.0) / spaced), []
        for k in range(51, 140):
            t = k * PERIOD
            goes_on(runner, t, jam)
            place = 40.0 * t - 0.45 * t * t
            if place // spaced > passed:
                passed = place // spaced
                runner.balise(place)
            faults.append(runner.outputs()["odometer_fault"])
        assert min(faults) == faults[-1] == reported
        assert min(faults[:50]) == 1.0


def test_a_balise_ends_the_position_error() -> None:
    runner = brake(QuasiLpvUio(), 5.0)
    runner.balise(200.0)
    out = runner.outputs()
    assert (out["position"], out["innovation"]) == (200.0, pytest.approx(40 * 5 - 0.45 * 25 - 200.0, abs=0.05))


@pytest.mark.parametrize("preset", ["as_published", "as_published_5_3_1"])
@pytest.mark.parametrize("period", [0.05, 0.2, 0.7, 2.0])
def test_the_certificate_is_that_of_the_held_innovation_at_the_period(preset: str, period: float) -> None:
    """Against the transition of a period, as a matrix exponential of its own."""
    certificate = next(QuasiLpvUio().findings(4.0, {"odometer_period": period}, preset=preset))
    observer = QuasiLpvUio()
    drifts, gains = speed_errors(observer.unpack_parameters(observer.start_parameters(preset)))
    radii = []
    for A, K in zip(drifts, gains, strict=True):
        whole = expm(period * np.block([[A, K], [np.zeros((1, 4))]]))
        radii.append(np.abs(np.linalg.eigvals(whole[:3, :3] - whole[:3, 3:] @ [[1.0, 0.0, 0.0]])).max())
    assert certificate.numbers[GROWTH] == pytest.approx(max(radii), abs=1e-9)
    assert certificate.holds == (max(radii) < 1.0) == (period < 1.0)
    assert next(QuasiLpvUio(hold="reading").findings(4.0, {"odometer_period": period}, preset=preset)).holds


def test_gains_of_the_wrong_sign_are_not_certified() -> None:
    wrong = {"gain_low": [-g for g in SECTION_3_3_4.gain_low], "gain_high": [-g for g in SECTION_3_3_4.gain_high]}
    for hold in ("innovation", "reading"):
        certificate = next(QuasiLpvUio(hold=hold).findings(4.0, wrong))  # type: ignore[arg-type]
        assert not certificate.holds
        assert certificate.limit == 0.0


@pytest.mark.parametrize(("options", "said"), [({"rules": "x"}, "unknown rules"), ({"hold": "x"}, "unknown hold")])
def test_unknown_options_are_refused(options: Any, said: str) -> None:
    with pytest.raises(ValueError, match=f"quasi_lpv_uio: {said} 'x'"):
        QuasiLpvUio(**options)


def test_vertices_that_do_not_span_are_refused() -> None:
    with pytest.raises(ValueError, match="schedule_max must be above schedule_min"):
        SystemRunner(QuasiLpvUio(), schedule_max=0.0).runtime.start(0.0)


def test_the_odometer_alone_lags_by_what_the_jam_took() -> None:
    runner = SystemRunner(OdometerReset())
    runner.set("u", {"odometer": 18.0})
    runner.runtime.start(0.0)
    runner.runtime.advance(10.0)
    runner.balise(200.0)
    assert runner.outputs() == {"position": 200.0, "speed": 18.0, "innovation": pytest.approx(-20.0)}


def test_the_shipped_scenario_finds_the_jam_and_keeps_the_position() -> None:
    """Published: position error 4 m better; independent: 8.7 m against 0.40 m at the balise after the jam."""
    outcome = Scenario.load("jam_odometry").run(warn=lambda _text: None).check()
    evaluated, alone = outcome.result.summary["fault_detection"]
    assert (evaluated["faults"], evaluated["missed"], evaluated["false"]) == (1, 0, 0)
    assert evaluated["start_delays"][0] <= 0.2 + 1e-9
    assert evaluated["end_delays"][0] <= 0.4 + 1e-9
    assert max(map(abs, evaluated["position_errors"])) < 0.6
    assert 7.0 < max(map(abs, alone["position_errors"])) < 10.0


@pytest.mark.parametrize("depth", [-0.2, 0.2])
@pytest.mark.parametrize("length", [4.0, 8.0, 15.0])
@pytest.mark.parametrize("acceleration", [-0.6, 0.6])
def test_a_fault_from_the_first_turn_of_the_wheel_on_leaves_it_no_worse_than_the_odometer(
    depth: float, length: float, acceleration: float
) -> None:
    """A wheel that turns too slowly, or too fast, from the start on, driven from rest or braked from 30 m/s.

    The odometer's error is the integral of the fault; readings know each of its two edges to a period.
    """
    begin = 0.0 if acceleration > 0.0 else 30.0
    runner = SystemRunner(QuasiLpvUio(), davis_a=0.0, davis_b=0.0, davis_c=0.0)
    runner.set("x", {"estimated_speed": begin})
    runner.set("u", {"effort": acceleration, "odometer": begin * (1.0 + depth)})
    runner.runtime.start(0.0)
    odometer = 0.0
    for k in range(1, round(40.0 / PERIOD) + 1):
        t = k * PERIOD
        y = max(begin + acceleration * t, 0.0) * (1.0 + depth * (t < length))
        odometer += PERIOD * y
        runner.set("u", {"odometer": y})
        runner.runtime.advance(t)
    way, edges = (
        begin * 40.0 + 0.5 * acceleration * 40.0**2,
        2.0 * PERIOD * abs(depth) * max(begin, acceleration * length),
    )
    assert abs(runner.outputs()["position"] - way) <= abs(odometer - PERIOD * 0.5 * (y - begin) - way) + edges
