"""Synchronous motors against each other, a closed form, an adaptive solver and the balance of power; their control."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from plant_models.hybrid import HybridSystem, Runtime
from plant_models.railway.traction import (
    DriveCycle,
    DriveShaft,
    FieldOrientedControl,
    Inverter,
    SynchronousMotor,
    SynchronousMotorEuler,
    ThreePhaseMotor,
    inverse_park,
    to_stator,
)

VOLTAGES = (-1.5, 6.0)
LOAD = 0.02


def reported(system: HybridSystem, inputs: Mapping[str, float], parameters: Mapping[str, Any] | None = None) -> Runtime:
    """A runtime that has started."""
    runtime = Runtime(system)
    for name, value in inputs.items():
        runtime.u[[s.name for s in system.input_signals].index(name)] = value
    names = [name for s in system.parameter_signals for name in s.scalar_names]
    for name, value in (parameters or {}).items():
        runtime.p[names.index(name)] = value
    runtime.start(0.0)
    return runtime


def outputs(runtime: Runtime) -> dict[str, float]:
    names = [name for s in runtime.system.outputs for name in s.scalar_names]
    return dict(zip(names, runtime.update_outputs().tolist(), strict=True))


def equations(_: float, x: np.ndarray) -> list[float]:
    """(4.31) with the numbers of Annex C, written out."""
    R, L, phi, p, J, f = 3.4, 0.0121, 0.013, 2.0, 5.9e-6, 1e-4
    v = VOLTAGES
    return [
        (v[0] - R * x[0]) / L + p * x[2] * x[1],
        (v[1] - R * x[1]) / L - p * x[2] * x[0] - phi / L * p * x[2],
        (1.5 * p * phi * x[1] - LOAD - f * x[2]) / J,
        p * x[2],
    ]


def in_rotor_frame() -> dict[str, float]:
    return {"voltage_d": VOLTAGES[0], "voltage_q": VOLTAGES[1], "load_torque": LOAD}


def solved() -> np.ndarray:
    found = solve_ivp(equations, (0.0, 0.05), np.zeros(4), method="DOP853", rtol=1e-11, atol=1e-11)
    return np.asarray(found.y[:, -1])


def test_the_motor_solves_its_equations() -> None:
    motor = reported(SynchronousMotor(), in_rotor_frame())
    motor.advance(0.05)
    np.testing.assert_allclose(motor.x, solved(), rtol=1e-6)  # order 4 at 1e-4 s: (h / 3.6 ms)^4 = 6e-7


def test_a_steady_state_is_the_closed_form() -> None:
    """1000 rpm and 0.05 N.m need 1.551 A; voltages follow from (4.27)."""
    speed, p, L = 1000.0 * np.pi / 30.0, 2.0, 0.0121
    current = (0.05 + 1e-4 * speed) / 0.039
    voltages = (-p * speed * L * current, 3.4 * current + p * speed * 0.013)
    assert current == pytest.approx(1.551, abs=5e-4)
    inputs = {"voltage_d": voltages[0], "voltage_q": voltages[1], "load_torque": 0.05}
    motor = reported(SynchronousMotor(), inputs)
    motor.advance(2.0)
    now = outputs(motor)
    # e^(-t / 59 ms) has died away; the rest is the internal step's rounding
    assert (now["current_d"], now["current_q"], now["speed"]) == pytest.approx((0.0, current, speed), abs=1e-8)
    assert now["torque"] == pytest.approx(0.05 + 1e-4 * speed)


@pytest.mark.parametrize("frame", ["rotor", "stator"])
def test_three_phases_are_an_equal_motor(frame: str) -> None:
    """Under voltages that turn with the rotor, and under those that stand still."""
    motor, phases = SynchronousMotor(frame=frame), ThreePhaseMotor()  # type: ignore[arg-type]
    one, other = Runtime(motor), Runtime(phases)
    one.start(0.0)
    other.start(0.0)
    for k in range(1000):
        one.u[:] = (*VOLTAGES, LOAD)
        angle = one.x[3] if frame == "rotor" else 0.0
        other.u[:] = (*inverse_park(*VOLTAGES, angle), LOAD)
        if frame == "rotor":  # held over 1e-5 s in both, in the stator frame of the phases
            one.u[:] = (*VOLTAGES, LOAD)
        one.advance((k + 1) * 1e-5)
        other.advance((k + 1) * 1e-5)
    a, b = outputs(one), outputs(other)
    tolerance = 1e-3 if frame == "rotor" else 1e-9  # there the voltage turns by half a step against the rotor
    for name in ("current_d", "current_q", "speed", "angle", "torque"):
        assert b[name] == pytest.approx(a[name], rel=tolerance, abs=tolerance)
    assert b["current_a"] + b["current_b"] + b["current_c"] == pytest.approx(0.0, abs=1e-12)


def test_power_is_balanced() -> None:
    """3/2 (v . i) = heat + what is stored in inductances and inertia + friction + load."""
    motor = reported(SynchronousMotor(), in_rotor_frame())
    stored = lambda x: 0.75 * 0.0121 * (x[0] ** 2 + x[1] ** 2) + 0.5 * 5.9e-6 * x[2] ** 2  # noqa: E731
    h, stated, lost = 1e-5, 0.0, 0.0
    before = motor.x.copy()
    for k in range(2000):
        motor.advance((k + 1) * h)
        middle, before = 0.5 * (motor.x + before), motor.x.copy()
        stated += h * 1.5 * (VOLTAGES[0] * middle[0] + VOLTAGES[1] * middle[1])
        lost += h * (1.5 * 3.4 * (middle[0] ** 2 + middle[1] ** 2) + 1e-4 * middle[2] ** 2 + LOAD * middle[2])
    assert stated == pytest.approx(lost + stored(motor.x), rel=1e-4)  # sums of order 2 in h


def test_the_euler_form_converges_at_order_one() -> None:
    exact, errors = solved(), []
    for period in (1e-4, 5e-5, 2.5e-5):
        motor = reported(SynchronousMotorEuler(), in_rotor_frame(), {"sample_period": period, **_quiet()})
        motor.advance(0.05)
        errors.append(np.abs(motor.x[:3] / exact[:3] - 1.0).max())
    for coarse, fine in pairwise(errors):
        assert coarse / fine == pytest.approx(2.0, rel=0.1)


def _quiet() -> dict[str, float]:
    return {f"process_variance[{i}]": 0.0 for i in range(1, 5)} | {f"measurement_variance[{i}]": 0.0 for i in (1, 2)}


def test_noise_has_the_variances_that_are_stated() -> None:
    system = SynchronousMotorEuler()
    motor = reported(system, {})
    readings = []
    for k in range(2000):
        before = motor.x[:4].copy()
        motor.advance((k + 1) * 1e-4)
        now = outputs(motor)
        readings.append((now["measured_current_d"] - now["current_d"], now["measured_current_q"] - now["current_q"]))
        assert (motor.x[:4] != before).all()
    np.testing.assert_allclose(np.var(readings, axis=0), 0.1, rtol=0.1)  # 3 deviations of 2000 samples


def test_stator_readings_are_turned_rotor_currents() -> None:
    motor = reported(SynchronousMotor(frame="stator"), {"voltage_alpha": 4.0, "voltage_beta": 3.0})
    motor.advance(0.01)
    now = outputs(motor)
    turned = to_stator(now["current_d"], now["current_q"], now["angle"])
    assert (now["measured_current_alpha"], now["measured_current_beta"]) == pytest.approx(turned)
    with pytest.raises(ValueError, match="unknown frame 'north'; choose one of: rotor, stator"):
        SynchronousMotor(frame="north")  # type: ignore[arg-type]


def test_control_carries_the_load_step() -> None:
    """As measured independently, with noise: at least 86.3 rad/s after the step, at most 3.57 A, then 104.7 rad/s."""
    motor, control = Runtime(SynchronousMotorEuler()), Runtime(FieldOrientedControl())
    names = [name for s in motor.system.parameter_signals for name in s.scalar_names]
    for name, value in _quiet().items():
        motor.p[names.index(name)] = value
    motor.start(0.0)
    control.u[0] = 1000.0 * np.pi / 30.0
    control.start(0.0)
    speeds, currents = [], []
    for k in range(4000):
        motor.u[:3] = (*control.update_outputs()[:2], 0.05 if k >= 2000 else 0.0)
        motor.advance((k + 1) * 1e-4)
        control.u[1:] = motor.x[[2, 3, 0, 1]]
        control.advance((k + 1) * 1e-4)
        speeds.append(motor.x[2])
        currents.append(motor.x[1])
        assert np.hypot(*control.update_outputs()[:2]) <= 28.0 / np.sqrt(3.0) + 1e-12
    assert min(speeds[2000:]) == pytest.approx(86.3, abs=0.5)  # its anti-windup may differ
    assert max(currents) == pytest.approx(3.57, abs=0.3)  # noise of 0.03 A a step adds to theirs
    assert speeds[1999] == pytest.approx(104.72, abs=0.2)
    assert speeds[-1] == pytest.approx(104.72, abs=0.2)


def test_a_torque_is_asked_for_and_limited() -> None:
    control = reported(FieldOrientedControl(reference="torque"), {"torque_reference": 0.039})
    assert outputs(control)["current_reference"] == pytest.approx(1.0)
    control = reported(FieldOrientedControl(reference="torque"), {"torque_reference": -10.0})
    assert outputs(control)["current_reference"] == -8.0


def test_the_cycle_turns_round_on_its_instants() -> None:
    cycle = DriveCycle()
    p = cycle.unpack_parameters(cycle.start_parameters("low_speed"))
    at = lambda t: cycle.output(t, None, None, p)["speed_reference"]  # noqa: E731
    assert [round(float(at(t)), 3) for t in (0.0, 0.2499, 0.25, 0.4999, 0.5)] == [
        10.472,
        10.472,
        -10.472,
        -10.472,
        10.472,
    ]
    p = cycle.unpack_parameters(cycle.start_parameters())
    assert [float(cycle.output(t, None, None, p)["load_torque"]) for t in (0.0, 0.4999, 0.5)] == [0.0, 0.0, 0.05]


def test_a_twisted_shaft_hands_on_the_torque() -> None:
    """At rest at both ends: k twist on the motor, and gear times motors over radius of it at the rims."""
    shaft = Runtime(DriveShaft())
    shaft.x[0] = 0.1
    shaft.start(0.0)
    now = outputs(shaft)
    assert now["load_torque"] == pytest.approx(1000.0)
    assert now["effort"] == pytest.approx(4.0 * 6.5 / 0.575 * 1000.0)
    shaft.u[3] = now["effort"]
    assert outputs(shaft)["torque_reference"] == pytest.approx(1000.0)


@pytest.mark.parametrize("angle", np.linspace(0.0, 2.0 * np.pi, 13))
def test_an_inverter_gives_what_its_direct_voltage_allows(angle: float) -> None:
    """Up to U / sqrt(3) all of it; of much more a corner or an edge of the hexagon."""
    inverter = Inverter()
    p = inverter.unpack_parameters(inverter.start_parameters())
    ask = lambda length: inverter.unpack_inputs(np.array([length * np.cos(angle), length * np.sin(angle), 1.0, 2.0]))  # noqa: E731
    now = inverter.output(0.0, np.zeros(0), u := ask(28.0 / np.sqrt(3.0)), p)
    got = (now["voltage_alpha"], now["voltage_beta"])
    np.testing.assert_allclose(got, u[:2], atol=1e-12)
    duties = [now[f"duty_{phase}"] for phase in "abc"]
    assert max(duties) + min(duties) == pytest.approx(1.0)  # centred
    assert 28.0 * now["direct_current"] == pytest.approx(1.5 * (got[0] + 2.0 * got[1]))
    far = inverter.output(0.0, np.zeros(0), ask(1e3), p)
    assert all(0.0 <= far[f"duty_{phase}"] <= 1.0 for phase in "abc")
    length = np.hypot(far["voltage_alpha"], far["voltage_beta"])
    assert 28.0 / np.sqrt(3.0) - 1e-9 <= length <= 28.0 * 2.0 / 3.0 + 1e-9
