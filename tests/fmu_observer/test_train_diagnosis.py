"""The diagnosis of a train: its table of isolation, wheel or sensor, shares of force, sensors that are not fitted."""

from __future__ import annotations

import itertools
import math
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cosim
from cosim.evaluation.fault_detection import fault_detection
from fmu_observer.detection.train_diagnosis import TrainDiagnosis
from fmu_observer.detection.train_diagnosis_signals import SHARES
from fmu_observer.detection.train_efficiency import MotionWindow, brake_share, traction_share
from fmu_observer.detection.train_isolation import BRAKE, FAULTS, MOTION, SENSORS, isolability
from fmu_observer.formulas.diagnosis.isolation_table import IsolationTable
from plant_models.hybrid import Runtime

NONE, SUSPECTED, WHEEL, SENSOR, STUCK, LOSS = range(6)
Signals = dict[str, Callable[[float], float]]


def constant(value: float) -> Callable[[float], float]:
    """A signal that does not change."""
    return lambda _: value


def evaluated(table: IsolationTable, *alarms: str, without: tuple[str, ...] = ()) -> tuple[set[str], set[str], float]:
    """Isolated and suspected faults of a set of alarms, and whether it is unexplained."""
    raised = [float(name in alarms) for name in table.residuals]
    said = table.evaluate(raised, [float(name not in without) for name in table.residuals], [1.0] * len(table.faults))
    names = [{f for f, on in zip(table.faults, reported, strict=True) if on} for reported in said[:2]]
    return names[0], names[1], float(said.unexplained)


@pytest.mark.parametrize("table", [MOTION, BRAKE])
def test_the_residuals_that_a_fault_must_move_isolate_it(table: IsolationTable) -> None:
    for fault in table.faults:
        assert evaluated(table, *table.must[fault]) == ({fault}, set(), 0.0)


def test_alarms_say_what_they_can() -> None:
    assert evaluated(MOTION) == (set(), set(), 0.0)
    assert evaluated(MOTION, "odometers") == (set(), {"odometer_1", "odometer_2"}, 0.0)
    # Satellites are less fine: while they are quiet radar and rail are equals.
    assert evaluated(MOTION, "odometer_1_radar", "odometer_2_radar") == (set(), {"radar", "adhesion"}, 0.0)
    assert evaluated(MOTION, "odometers", "radar_gps") == (set(), set(), 1.0)
    assert evaluated(MOTION, "way_1") == ({"odometer_1"}, set(), 0.0)
    # Satellites may move it; but while none of what they must move is raised the radar explains it as well.
    assert evaluated(MOTION, "radar_gps") == (set(), {"gps"}, 0.0)
    assert evaluated(MOTION, "odometer_1_gps", "odometer_2_gps", "radar_gps") == ({"gps"}, set(), 0.0)
    assert evaluated(BRAKE, "pressure") == (set(), {"pressure_sensor", "cylinder"}, 0.0)


def test_a_table_names_residuals_that_there_are() -> None:
    with pytest.raises(ValueError, match="'f' moves c; the residuals are a, b"):
        IsolationTable(("a", "b"), {"f": ("a", "c")}, {})


def test_fewer_sensors_show_less() -> None:
    assert all(others == () for others in isolability(SENSORS).values())
    few = isolability(("odometer_1", "radar", "balise"))
    assert few["odometer_1"] == ("adhesion",)
    assert few["radar"] == ()  # at the next balise
    assert few["friction"] == ("cylinder",)
    with pytest.raises(ValueError, match="odometer_1 is missing"):
        isolability(("radar",))
    with pytest.raises(ValueError, match="unknown sensors sonar"):
        isolability(("odometer_1", "sonar"))


def reported(stop: float, signals: Signals, balises: dict[int, float] | None = None) -> list[dict[str, float]]:
    """Outputs at each sample; signals are functions of time, balises positions by the number of the sample."""
    system = TrainDiagnosis()
    runtime = Runtime(system)
    inputs = [s.name for s in runtime.system.input_signals]
    runtime.start(0.0)
    rows, passed = [], balises or {}
    for k in range(1, round(stop / 0.1) + 1):
        for name, signal in signals.items():
            runtime.u[inputs.index(name)] = signal(0.1 * (k - 1))
        runtime.advance(0.1 * k)
        if k in passed:
            runtime.u[inputs.index("balise_position")] = passed[k]
            runtime.trigger("balise")
        values = runtime.update_outputs()
        rows.append(dict(zip((s.name for s in system.outputs), map(float, values), strict=True)))
    return rows


def cruise(speed: float = 10.0, **others: Any) -> Signals:
    """All sensors of a train at a constant speed."""
    equal: Signals = dict.fromkeys(("odometer_1", "odometer_2", "radar"), constant(speed))
    return equal | {"gps_position": lambda t: speed * t, "cylinder_pressure": constant(0.0)} | others


def test_an_odometer_that_is_off_without_an_effort_is_a_sensor() -> None:
    rows = reported(12.0, cruise(odometer_1=lambda t: 9.0 if t > 5.0 else 10.0))
    codes = [row["odometer_1_fault"] for row in rows]
    assert set(codes[:50]) == {NONE}
    assert codes[-1] == SENSOR
    assert SUSPECTED in codes
    assert all(row[f"{name}_fault"] == NONE for row in rows[60:] for name in ("odometer_2", "radar", "gps", "adhesion"))
    assert rows[-1]["speed"] == 10.0
    assert 5.0 <= rows[-1]["detection_time"] < 5.6
    assert rows[-1]["confidence"] > 0.3


def test_under_the_brake_such_a_reading_is_a_wheel() -> None:
    low = cruise(odometer_1=lambda t: 9.0 if t > 5.0 else 10.0, effort=lambda t: -40e3 if t < 14.0 else 0.0)
    rows = reported(20.0, low)
    assert {row["odometer_1_fault"] for row in rows[90:140]} == {WHEEL}
    assert rows[-1]["odometer_1_fault"] == SENSOR  # the brake is released, and it goes on
    high = reported(12.0, cruise(odometer_1=lambda t: 11.0 if t > 5.0 else 10.0, effort=constant(-40e3)))
    assert high[-1]["odometer_1_fault"] == SENSOR  # no brake makes a wheel fast


def test_a_sensor_that_stands_still_is_stuck() -> None:
    def speed(t: float) -> float:
        return 10.0 + 0.2 * t

    moving: Signals = dict.fromkeys(("odometer_1", "odometer_2", "radar"), speed)
    moving |= {"gps_position": lambda t: 10.0 * t + 0.1 * t * t, "radar": lambda t: speed(min(t, 5.0))}
    assert reported(16.0, moving)[-1]["radar_fault"] == STUCK


@pytest.mark.parametrize("seed", range(4))
def test_what_is_detected_is_reported_although_it_is_not_isolated(seed: int) -> None:
    """A law: while a residual is above its threshold for as long as it takes to raise an alarm `fault` is 1. Sensors
    are off by random gains and offsets from a random instant on, one to all of them at once; without any it stays 0."""
    rng = np.random.default_rng(seed)
    names = ("odometer_1", "odometer_2", "radar", "gps_position", "cylinder_pressure")
    begins = {name: rng.uniform(4.0, 8.0) for name in names if seed and rng.random() < 0.6}
    gains, offsets = (
        rng.choice([-1.0, 1.0], 5) * rng.uniform(0.0, 0.3, 5),
        {"gps_position": 9.0, "cylinder_pressure": 4e4},
    )

    def off(name: str, gain: float, healthy: Callable[[float], float]) -> Callable[[float], float]:
        return lambda t: healthy(t) * (1.0 + gain) + offsets.get(name, 0.0) if t > begins[name] else healthy(t)

    right = cruise(12.0)
    rows = reported(16.0, right | {n: off(n, g, right[n]) for n, g in zip(names, gains, strict=True) if n in begins})
    lasting = 0
    for row in rows:
        above = any(value > 1.0 for name, value in row.items() if name.startswith("ratio_"))
        lasting = lasting + 1 if above else 0
        assert lasting < 3 or row["fault"] == 1.0
        assert row["fault"] >= min(row["fault_count"] + row["several_faults"], 1.0)
    assert any(row["fault"] for row in rows) == bool(begins)


def faulty(healthy: Callable[[float], float], share: float, offset: float) -> Callable[[float], float]:
    """A signal that is off from 30 s on."""
    return lambda t: healthy(t) * (1.0 + share) + offset if t > 30.0 else healthy(t)


OF_MOTION = ("odometer_1", "odometer_2", "radar", "gps", "balise")
WAYS = [*[(a,) for a in OF_MOTION], *itertools.combinations(OF_MOTION, 2)]


@pytest.mark.parametrize("faults", WAYS, ids="_and_".join)
def test_two_faults_of_motion_are_reported_and_one_is_not_reported_as_several(faults: tuple[str, ...]) -> None:
    """A law: of sensors of the motion two that are at fault while no effort slips a wheel are told: as several, or one
    after the other, both signs of each; nothing else is isolated. One alone is isolated, and never told as several."""
    for signs in itertools.product((-1.0, 1.0), repeat=len(faults)):
        off = dict(zip(faults, signs, strict=True))
        signals = cruise(gps_position=faulty(lambda t: 12.0 * t, 0.0, 9.0 * off.get("gps", 0.0)))
        for name in ("odometer_1", "odometer_2", "radar"):  # a reading that never changes would be stuck
            signals[name] = faulty(lambda t: 12.0 + 0.02 * math.sin(40.0 * t), 0.1 * off.get(name, 0.0), 0.0)
        balises = {100 * i: 120.0 * i + (6.0 * off.get("balise", 0.0) if i == 4 else 0.0) for i in range(1, 6)}
        rows = reported(55.0, signals, balises)
        named = {fault for fault in FAULTS if any(row[f"{fault}_fault"] >= WHEEL for row in rows)}
        several = any(row["several_faults"] for row in rows)
        assert named <= set(faults), off
        assert several or named == set(faults), off
        assert len(faults) > 1 or not several, off


def test_an_isolated_fault_is_not_replaced_by_another_while_it_lasts() -> None:
    """A radar that was isolated, then a balise that is off by just what the radar is: against both wheels, as if the
    rail were slippery. The radar stays told, and that it is not all."""
    signals = cruise(gps_position=lambda t: 12.0 * t)
    for name, share in (("odometer_1", 0.0), ("odometer_2", 0.0), ("radar", 1.0)):
        signals[name] = lambda t, share=share: (
            (12.0 + 0.02 * math.sin(40.0 * t))
            * (1.0 + share * (0.1 if 30.0 < t < 34.0 else 0.045 if t > 30.0 else 0.0))
        )
    way = 120.0 + 12.0 * (4.0 * 0.1 + 6.0 * 0.045)  # [m] of the radar from 30 to 40 s
    rows = reported(50.0, signals, {100 * i: 120.0 * i + (way - 120.0 if i == 4 else 0.0) for i in range(1, 5)})
    after = rows[405:]
    assert {row["radar_fault"] for row in rows[340:]} == {SENSOR}
    assert {row["adhesion_fault"] for row in after} == {NONE}
    assert {row["several_faults"] for row in after} == {1.0}


def test_without_a_third_source_both_are_suspected() -> None:
    two: Signals = {"odometer_1": lambda t: 9.0 if t > 5.0 else 10.0, "odometer_2": constant(10.0)}
    last = reported(12.0, two)[-1]
    assert (last["odometer_1_fault"], last["odometer_2_fault"]) == (SUSPECTED, SUSPECTED)
    assert last["isolation_limited"] == 1.0
    assert reported(1.0, cruise())[-1]["isolation_limited"] == 0.0


def test_a_threshold_of_zero_is_refused() -> None:
    system = TrainDiagnosis()
    p = system.unpack_parameters(system.start_parameters())
    assert all(system.requirements(p).values())
    broken = {text: ok for text, ok in system.requirements(p._replace(threshold_radar=0.0)).items() if not ok}
    assert any("threshold_radar" in text for text in broken)
    with pytest.raises(ValueError, match="force_window"):
        TrainDiagnosis(force_window=2)


@pytest.mark.parametrize("share", [0.4, 0.75, 1.0])
def test_the_share_of_a_constant_force_is_found(share: float) -> None:
    # Without resistance the speed grows by share a per step, so the simulated and the measured end agree exactly.
    system = TrainDiagnosis()
    p = system.unpack_parameters(system.start_parameters())
    p = p._replace(davis_a=0.0, davis_b=0.0, davis_c=0.0, smoothing=0.0)
    steps, none = range(8), [0.0] * 8
    pulls = MotionWindow([5.0 + share * 0.5 * k for k in steps], [0.5] * 8, none, none, none)
    found = traction_share(pulls, 0.8 * np.ones(()), 1.0, 1e5, p)
    assert (float(found.value), float(found.found)) == (pytest.approx(max(share, 0.56), abs=1e-12), 1.0)  # 0.7 of 0.8
    brakes = MotionWindow([15.0 - share * 0.5 * k for k in steps], none, [0.5] * 8, [0.5] * 8, none)
    stops = brake_share(brakes.measured, brakes, 0.8 * np.ones(()), 1.0, 1e5, p)
    assert float(stops.value) == pytest.approx(max(share, 0.56), abs=1e-12)
    coasts = MotionWindow([5.0] * 8, none, none, none, none)
    assert float(traction_share(coasts, 0.8 * np.ones(()), 1.0, 1e5, p).found) == 0.0


@pytest.mark.parametrize("missing", ["odometer_2", "radar", "cylinder_pressure"])
def test_each_missing_sensor_that_isolation_needs_is_reported(missing: str) -> None:
    signals = cruise()
    del signals[missing]
    assert reported(0.5, signals)[-1]["isolation_limited"] == 1.0
    del (without := cruise())["gps_position"]
    assert reported(0.5, without)[-1]["isolation_limited"] == 0.0  # the table isolates all without satellites


def test_an_alarm_that_outlasts_its_residual_keeps_its_confidence() -> None:
    rows = reported(13.0, cruise(odometer_1=lambda t: 9.0 if 5.0 < t < 9.0 else 10.0))
    names = ("odometers", "odometer_1_radar", "odometer_1_gps")
    gone = [r for r in rows if r["fault_count"] > 0 and max(r[f"ratio_{n}"] for n in names) <= 1.0]
    assert gone
    assert all(0.0 < row["confidence"] < 0.99 for row in gone)
    assert rows[-1]["confidence"] == 0.0


def test_a_share_outside_of_the_grid_is_unknown() -> None:
    system = TrainDiagnosis()
    p = system.unpack_parameters(system.start_parameters())._replace(davis_a=0.0, davis_b=0.0, davis_c=0.0)
    none = [0.0] * 8
    for share, bracketed in ((1.2, 1.0), (1.9, 0.0)):
        stops = MotionWindow([15.0 - share * 0.5 * k for k in range(8)], none, [0.5] * 8, [0.5] * 8, none)
        found = brake_share(stops.demanded, stops, 1.5 * np.ones(()), 1.0, 1e5, p)
        assert (float(found.found), float(found.bracketed)) == (1.0, bracketed)
    assert float(found.value) == pytest.approx(float(p.most_share))
    last = reported(2.0, cruise())[-1]
    assert last["shares_unknown"] == 3.0 == sum(last[f"{s}_unknown"] for s in SHARES)


@pytest.mark.parametrize("case", ["radar_gain", "false_balise", "pressure_low"])
def test_a_case_of_the_scenario_is_isolated_in_time_and_alone(case: str) -> None:
    outcome = cosim.Scenario.load("train_diagnosis").set("case", case).run().check()
    assert len(outcome.expectations) == 5  # quiet before, in time, code from both sides, nothing else
    assert not any("not checked against the balise gaps" in warning for warning in outcome.warnings)
    (reported,) = fault_detection(outcome.result, outcome.spec)
    assert (reported.faults, reported.missed, reported.false) == (1, 0, 0)
    assert outcome.spec.delay_limit is not None
    assert reported.within(outcome.spec.delay_limit)


def test_each_case_of_the_scenario_is_evaluated_by_the_output_of_its_own_fault() -> None:
    tables = tomllib.loads(Path(cosim.__file__).with_name("scenarios").joinpath("train_diagnosis.toml").read_text())
    seen = set()
    for case, values in tables["cases"].items():
        report = tables["report"] | values.get("report", {})
        expect = {e["name"]: e for e in values.get("expect", tables["expect"])}
        if case == "fault_free":
            continue
        in_time = expect["it is suspected in time"]
        assert in_time["signal"] == f"diagnosis.{report['detection']}"
        assert in_time["before"] - in_time["from"] == pytest.approx(report["delay_limit"])
        component = values.get(
            report["true_fault"].partition(".")[0], tables["components"]["first_odometer"]["parameters"]
        )
        assert component["fault_onset"] == in_time["from"] == expect["nothing is told before the fault"]["end"]
        seen.add(report["detection"].removesuffix("_fault"))
    assert seen == set(FAULTS)
