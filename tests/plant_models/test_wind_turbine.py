"""The wind turbine of the benchmark: numbers of the specification, equations against SciPy, controller against a plain
loop.
"""

from __future__ import annotations

import tomllib
from importlib.resources import files
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

import cosim
from plant_models.exhibits.wind_turbine import Wind, WindTurbine, WindTurbineController
from plant_models.exhibits.wind_turbine.drive_train import DriveTrain
from plant_models.exhibits.wind_turbine.rotor import Rotor, _power_coefficient, optimal_torque_gain
from plant_models.hybrid import HybridSystem, Runtime, scalar_names

EIGENVALUES = (  # of the specification, with as many digits as it has
    ({}, -0.00724, -0.0550 + 28.163j),
    ({"efficiency": 0.25}, -0.0238, -0.0466 + 15.520j),
    ({"printed": 1.0}, 2.6e-5, 8.1e-5 + 28.16j),
)


def _eigenvalues(drive: DriveTrain) -> np.ndarray:
    return np.linalg.eigvals(np.array(drive.matrix()))


@pytest.mark.parametrize(("changed", "slow", "swinging"), EIGENVALUES)
def test_eigenvalues_of_the_drive_train(changed: dict[str, float], slow: float, swinging: complex) -> None:
    values = _eigenvalues(DriveTrain(**changed))
    assert min(abs(values - slow)) < 1e-2 * abs(slow)
    assert min(abs(values - swinging)) < 5e-3  # half of the last digit that is given of the imaginary part
    assert min(abs(values.real - swinging.real)) < 1e-2 * abs(swinging.real)


def test_hurwitz_determinants_say_what_eigenvalues_say() -> None:
    rng = np.random.default_rng(1)
    seen = set()
    for printed in (0.0, 1.0):
        for _ in range(30):
            drawn = rng.uniform(0.2, 3.0, 8)
            drive = DriveTrain(*drawn[:2], 2.0, *drawn[2:6], 0.9, printed)
            _, a, b, c = np.poly(np.array(drive.matrix()))
            assert drive.hurwitz() == pytest.approx((a, a * b - c, c), rel=1e-9)
            stable = all(value > 0.0 for value in drive.hurwitz())
            assert stable == (_eigenvalues(drive).real.max() < 0.0)
            seen.add(stable)
    assert seen == {True, False}


def test_gain_of_the_best_torque() -> None:
    assert optimal_torque_gain(Rotor(), 0.97, 95.0) == pytest.approx(1.21708, abs=5e-6)


def test_the_stand_in_has_the_largest_coefficient_of_the_benchmark() -> None:
    ratios = np.linspace(0.1, 20.0, 2000)
    values = _power_coefficient(ratios, 0.0 * ratios, 0.4554)
    assert values.max() == pytest.approx(0.4554, rel=2e-3)  # 0.48 is Heier's maximum to two digits
    assert ratios[values.argmax()] == pytest.approx(8.1, abs=0.1)
    assert (np.diff([_power_coefficient(8.0, pitch, 0.4554) for pitch in (0.0, 2.0, 5.0, 10.0, 20.0)]) < 0.0).all()


def test_the_rotor_takes_the_share_of_the_power_that_its_coefficient_says() -> None:
    rotor, wind, speed = Rotor(), 11.0, 1.4
    power = rotor.torque(wind, speed, (3.0, 3.0, 3.0)) * speed
    share = _power_coefficient(speed * rotor.radius / wind, 3.0, 0.4554)
    assert power == pytest.approx(0.5 * 1.225 * np.pi * 57.5**2 * wind**3 * share, rel=1e-12)


def _runtime(system: HybridSystem, preset: str | None = None, **values: float) -> Runtime:
    runtime = Runtime(system)
    runtime.p[:] = system.start_parameters(preset)
    _write(runtime, values)
    return runtime


def _write(runtime: Runtime, values: dict[str, float]) -> None:
    system = runtime.system
    names = {name: (runtime.u, i) for i, name in enumerate(scalar_names(system.input_signals))}
    names |= {name: (runtime.p, i) for i, name in enumerate(scalar_names(system.parameter_signals))}
    for name, value in values.items():
        array, place = names[name]
        array[place] = value


def _outputs(runtime: Runtime) -> dict[str, float]:
    return dict(zip(scalar_names(runtime.system.outputs), map(float, runtime.update_outputs()), strict=True))


def _plain_turbine(_: float, x: np.ndarray, wind: float, torque: float, pitch: float) -> list[float]:
    """The equations of the thesis, written down once more; SI units and degrees."""
    speed, generator, torsion, converter = x[:4]
    ratio, blades = speed * 57.5 / wind, x[4:7]
    taken = 0.0
    for b in blades:
        inverse = 1.0 / (ratio + 0.08 * b) - 0.035 / (b**3 + 1.0)
        taken += 0.4554 / 0.48 * (0.5176 * (116 * inverse - 0.4 * b - 5) * np.exp(-21 * inverse) + 0.0068 * ratio)
    aerodynamic = 1.225 * np.pi * 57.5**3 * taken * wind**2 / (6 * ratio)
    shaft = 2.7e9 * torsion + 775.49 * (speed - generator / 95.0)
    return [
        (aerodynamic - shaft - 7.11 * speed) / 55e6,
        (0.97 * shaft / 95.0 - 45.6 * generator - (converter + 500.0)) / 390.0,
        speed - generator / 95.0,
        (torque - converter) / 0.02,
        *x[7:10],
        *(11.11**2 * (pitch - b) - 2 * 0.6 * 11.11 * rate for b, rate in zip(blades, x[7:10], strict=True)),
    ]


def test_the_turbine_moves_as_scipy_says() -> None:
    system = WindTurbine()
    stated = {"wind_speed": 13.0, "torque_reference": 20e3, "pitch_reference": 4.0}
    runtime = _runtime(system, "without_noise", **stated, torque_offset=500.0, internal_step=2e-3)
    start = runtime.x[:10].copy()
    runtime.start(0.0)
    runtime.advance(1.0)
    solved = solve_ivp(_plain_turbine, (0.0, 1.0), start, "DOP853", rtol=1e-11, atol=1e-12, args=(13.0, 20e3, 4.0)).y[
        :, -1
    ]
    # RK4 errs by (h / tau)^4 / 120 of what decays, 1e-6 for the converter; it decays, and what it moved does not
    assert runtime.x[:4] == pytest.approx(solved[:4], rel=1e-6)
    reported = _outputs(runtime)
    assert reported["generator_torque"] == pytest.approx(20.5e3, rel=1e-9)
    assert reported["measured_power"] == pytest.approx(0.98 * solved[1] * 20.5e3, rel=1e-6)
    assert reported["measured_pitch[4]"] == pytest.approx(solved[5], rel=1e-6)
    assert reported["drive_train_unstable"] == 0.0


def test_the_internal_step_damps_the_shaft_as_its_comment_says() -> None:
    step = WindTurbine.internal_step * np.array(DriveTrain().matrix())
    powers = [np.eye(3), step, step @ step / 2, step @ step @ step / 6, step @ step @ step @ step / 24]
    damping = np.log(np.linalg.eigvals(sum(powers))).real.min() / WindTurbine.internal_step
    exact = np.log(np.linalg.eigvals(expm(step))).real.min() / WindTurbine.internal_step
    assert damping / exact == pytest.approx(1.006, abs=5e-4)


def test_noise_of_the_readings() -> None:
    system = WindTurbine()
    runtime = _runtime(system, None, seed=3.0)
    runtime.x[:10] = 0.0  # nothing turns but the wind
    runtime.x[0], runtime.x[1] = 1.0, 95.0
    _write(runtime, {"sample_period": 1e-6})
    runtime.start(0.0)
    drawn = []
    for k in range(1, 800):
        runtime.advance(k * 1e-6)
        drawn.append(runtime.x[10:].copy())
    readings = np.array(drawn)
    expected = [0.5, 0.0251, 0.0251, 0.05, 0.05, 90.0, 1e3, *[0.2] * 6]
    # five standard deviations of an estimated one over 800 samples: 5 / sqrt(1600)
    assert readings.std(axis=0) == pytest.approx(expected, rel=0.125)
    assert readings[:, 0].mean() == pytest.approx(9.0 + 1.5, abs=5 * 0.5 / 800**0.5)
    assert np.abs(np.corrcoef(readings.T) - np.eye(13)).max() < 5 / 800**0.5


def test_the_controller_is_the_plain_loop() -> None:
    rng = np.random.default_rng(2)
    speeds = np.r_[np.linspace(150, 166, 40), np.linspace(166, 158, 30), np.linspace(158, 140, 40)]
    speeds = speeds + 0.05 * rng.standard_normal(len(speeds))
    powers = np.where(speeds > 161.5, 4.81e6, 4.0e6)
    runtime = _runtime(WindTurbineController(), None, generator_speed=speeds[0], generator_power=powers[0])
    zone, pitch, before, zones = 2, 0.0, 0.0, []
    for k, (speed, power) in enumerate(zip(speeds, powers, strict=True)):
        _write(runtime, {"generator_speed": speed, "generator_power": power})
        runtime.start(0.0) if k == 0 else runtime.advance(0.01 * k)
        error = speed - 162.0
        if zone == 2:
            zone = 3 if power >= 4.8e6 or speed >= 162.0 else 2
        elif speed < 162.0 - 15.0:
            zone = 2
        pitch = min(max(pitch + 4.0 * error + (0.01 - 4.0) * before, 0.0), 90.0) if zone == 3 else 0.0
        before = error
        torque = 1.2170801318882305 * speed**2 if zone == 2 else 4.8e6 / (0.98 * speed)
        reported = _outputs(runtime)
        assert (reported["zone"], reported["pitch_reference"]) == (zone, pytest.approx(pitch, abs=1e-9))
        assert reported["torque_reference"] == pytest.approx(torque, rel=1e-12)
        zones.append(zone)
    assert np.count_nonzero(np.diff(zones)) == 2
    assert pitch == 0.0


def test_stand_ins_of_the_wind() -> None:
    runtime = _runtime(Wind())
    runtime.start(0.0)
    runtime.advance(100.0)
    assert _outputs(runtime)["wind_speed"] == pytest.approx(9.0 + 4.0 * np.sin(1.0), rel=1e-12)
    runtime = _runtime(Wind(), "synthetic", sample_period=20.0, sine_amplitude=0.0, mean_to=9.0)
    runtime.start(0.0)
    seen = []
    for k in range(1, 1200):
        runtime.advance(20.0 * k)
        seen.append(runtime.x[0])
    d = np.array(seen)
    # the squares of an AR(1) process with a^2 = exp(-2) count (1 - a^4) / (1 + a^4) times: four standard errors
    assert d.std() == pytest.approx(1.2, rel=0.11)
    assert (d[1:] * d[:-1]).mean() / d.var() == pytest.approx(np.exp(-1.0), abs=0.12)


def _short(**changes: Any) -> Any:
    scenario = cosim.Scenario.load("wind_turbine")
    for name, value in changes.items():
        scenario.set(name.replace("__", "."), value)
    return scenario.set("master.record_every", 1).set("expect", []).run()  # too short for what is expected


def test_a_case_expects_the_alarm_of_its_own_fault() -> None:
    scenario = cosim.Scenario.load("wind_turbine").set("stop", 30.0)
    stuck = {"fault_channel": 5, "fault_gain": 0.0, "fault_offset": 10.0, "fault_onset": 20.0, "fault_length": 5.0}
    for name, value in stuck.items():
        scenario.set(f"pitch_sensors.{name}", value)
    raw = tomllib.loads((files("cosim") / "scenarios" / "wind_turbine.toml").read_text(encoding="utf-8"))
    own = [e for e in raw["cases"]["F1"]["expect"] if e["check"] == "on"]
    scenario.set("expect", [{**e, "from": 20.0, "before": 20.05} for e in own])
    scenario.set("report.true_fault", "pitch_sensors.active").set(
        "report.detection", raw["cases"]["F1"]["report"]["detection"]
    )
    outcome = scenario.run()
    assert [evaluated.passed for evaluated in outcome.expectations] == [True]
    # rows are 1 s apart, and yet the instants are exact: those at which the fault and its alarm go on and off
    assert len(outcome.result.time) < 40
    (reported,) = outcome.result.summary["fault_detection"]
    assert (reported["start_delays"], reported["end_delays"]) == ([0.0], [pytest.approx(0.04)])
    missed = scenario.set("diagnosis.pitch_difference_limit", 1e3).run()
    assert [evaluated.passed for evaluated in missed.expectations] == [False]


def test_a_run_with_the_printed_drive_train_is_warned() -> None:
    printed = _short(stop=0.05, turbine__preset="as_published")
    assert any("drive train is unstable" in text for text in printed.result.summary["warnings"])
    assert not any("drive train" in text for text in _short(stop=0.05).result.summary["warnings"])


CASES = {
    "F1": (1000.0, "pitch_sensors.reading[5]", "stuck", np.radians(10.0)),
    "F2": (2500.0, "pitch_sensors.reading[4]", "gain", 5.0),
    "F3": (2000.0, "rotor_speed_sensors.reading[1]", "stuck", 3.5),
    "F4": (2000.0, "rotor_speed_sensors.reading[2]", "gain", 5.0),
    "F5": (2000.0, "generator_speed_sensors.reading[1]", "stuck", 50.0),
    "F6": (2000.0, "generator_speed_sensors.reading[2]", "gain", 5.0),
    "F7": (2000.0, "converter.reading", "stuck", 1000.0),
    "F8": (2900.0, "pitch_frequency.reading[2]", "stuck", 5.73),
    "F9": (3530.0, "pitch_damping.reading[3]", "stuck", 0.9),
    "F10": (2000.0, "efficiency.reading", "stuck", 0.25),
}
"""Onset [s] (of F9: when its ramp is over), signal, and what Table 7.1 says of it, in SI units."""


@pytest.mark.parametrize("case", CASES)
def test_a_case_has_its_fault_at_its_instant(case: str) -> None:
    onset, signal, kind, size = CASES[case]
    ran = _short(case=case, start=onset - 0.03, stop=onset + 0.03)
    value = ran[signal]
    healthy = ran[
        signal.replace("_sensors.reading", "").join(("turbine.measured_", "")) if "_sensors" in signal else signal
    ]
    after = ran.result.time > onset - 1e-6
    assert after.sum() == 4
    expected = size if kind == "stuck" else size * healthy[after]
    assert value[after] == pytest.approx(expected, rel=1e-9)
    if case == "F9":
        assert (np.diff(value[~after]) > 0.0).all()
    else:
        assert (np.abs(value[~after] / value[after][0] - 1.0) > 0.1).all()
