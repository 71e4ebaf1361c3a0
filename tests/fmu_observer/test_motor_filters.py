"""Filters of the synchronous motor: against filterpy, Jacobians against exact ones, what they see and what they say."""

from __future__ import annotations

from typing import Any

import filterpy.kalman
import numpy as np
import pytest
from own_condition import own_condition

from fmu_observer.observers.generic.discrete.extended_kalman_filter import ExtendedKalmanFilter
from fmu_observer.observers.motors import MotorEkf, MotorEkfStator
from fmu_observer.observers.motors.motor_ekf import ROWS
from fmu_observer.observers.motors.motor_filter import MotorFilter
from plant_models.hybrid import Runtime, scalar_names
from plant_models.hybrid.exact_jacobian import exact_jacobian
from plant_models.railway.traction import to_stator

T, COUNT = 1e-4, 200


def parameters(observer: MotorFilter, preset: str | None = None) -> Any:
    return observer.unpack_parameters(observer.start_parameters(preset))


def drawn_inputs(observer: MotorFilter) -> np.ndarray:
    """Voltages, the load where it is an input, measured currents, shape (COUNT + 1, inputs)."""
    rng = np.random.default_rng(3)
    names = [signal.name for signal in observer.inputs]
    columns = {name: 3.0 * np.sin(np.arange(COUNT + 1) / 40.0 + i) for i, name in enumerate(names)}
    for name in names:
        columns[name] += rng.normal(size=COUNT + 1) * (0.3 if name.startswith("measured") else 0.1)
    columns |= {"load_torque": np.where(np.arange(COUNT + 1) > 100, 0.02, 0.0)} if "load_torque" in names else {}
    return np.stack([columns[name] for name in names], axis=1)


def run(observer: MotorFilter, inputs: np.ndarray) -> np.ndarray:
    """State after each sample, shape (COUNT + 1, states)."""
    runtime = Runtime(observer)
    runtime.u[:] = inputs[0]
    runtime.start(0.0)
    rows = [runtime.x.copy()]
    for k in range(1, COUNT + 1):
        runtime.u[:] = inputs[k]
        runtime.advance(k * T)
        rows.append(runtime.x.copy())
    return np.array(rows)


@pytest.mark.parametrize(
    "observer", [MotorEkf(), MotorEkfStator(), MotorEkfStator(load="estimated")], ids=["rotor", "stator", "load"]
)
def test_it_is_the_filter_of_filterpy(observer: MotorFilter) -> None:
    """The same equations by another package, given our transition and Jacobians."""
    p, inputs, n = parameters(observer), drawn_inputs(observer), observer.order
    nis = [name for s in observer.states for name in s.scalar_names].index("held_nis")
    ours = run(observer, inputs)
    theirs = filterpy.kalman.ExtendedKalmanFilter(n, 2)
    theirs.x, theirs.P = ours[0, :n] * 0.0, np.reshape(observer.start_state()[n : n + n * n], (n, n))
    theirs.Q, theirs.R = np.diag(p.process_variance), np.diag(p.measurement_variance)
    for k in range(COUNT + 1):
        u = observer.unpack_inputs(inputs[k])
        if k > 0:
            theirs.x, theirs.F = (np.asarray(value) for value in observer.predict(theirs.x, u, p))
            theirs.P = theirs.F @ theirs.P @ theirs.F.T + theirs.Q
        innovation, H = observer.measure(theirs.x, u, p)
        theirs.update(np.asarray(innovation), lambda _, H=H: np.asarray(H), lambda _: np.zeros(2))
        np.testing.assert_allclose(ours[k, :n], theirs.x, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(ours[k, n : n + n * n].reshape(n, n), theirs.P, rtol=1e-8, atol=1e-12)
        assert ours[k, nis] == pytest.approx(innovation @ np.linalg.solve(theirs.S, innovation), rel=1e-6)


def test_the_generic_filter_of_the_euler_motor_is_equal() -> None:
    """Its model remembers held currents and whether it has been sampled: known exactly, they take no part."""
    observer, generic = MotorEkf(), ExtendedKalmanFilter("synchronous_motor_euler", outputs=["current_d", "current_q"])
    p, inputs = parameters(observer), drawn_inputs(observer)
    whole = np.zeros(7)
    whole[:4] = p.process_variance
    runtime = Runtime(generic)
    reported = scalar_names(generic.parameter_signals)
    runtime.p[[reported.index(f"process_covariance[{i}]") for i in range(1, 50)]] = np.diag(whole).ravel()
    runtime.p[[reported.index(f"measurement_covariance[{i}]") for i in range(1, 5)]] = np.diag(
        p.measurement_variance
    ).ravel()
    held = scalar_names(generic.states)
    runtime.x[held.index("estimated_sampled")] = 1.0
    runtime.x[[held.index(f"estimate_covariance[{i}]") for i in range(1, 50)]] = np.diag([1.0] * 4 + [0.0] * 3).ravel()
    runtime.u[:] = inputs[0]
    runtime.start(0.0)
    ours = run(observer, inputs)
    for k in range(1, COUNT + 1):
        runtime.u[:] = inputs[k]
        runtime.advance(k * T)
        np.testing.assert_allclose(runtime.x[:4], ours[k, :4], rtol=1e-9, atol=1e-9)
    P = np.reshape(runtime.x[held.index("estimate_covariance[1]") :][:49], (7, 7))
    np.testing.assert_allclose(P[:4, :4], ours[-1, 4:20].reshape(4, 4), rtol=1e-9, atol=1e-12)
    assert runtime.x[held.index("last_nis")] == pytest.approx(ours[-1, 22], rel=1e-9)


@pytest.mark.parametrize(
    "observer", [MotorEkf(), MotorEkfStator(), MotorEkfStator(load="estimated")], ids=["rotor", "stator", "load"]
)
def test_the_jacobians_are_exact(observer: MotorFilter) -> None:
    """Against derivatives of the step and of the measurement themselves, with L_d and L_q told apart."""
    values = observer.start_parameters()
    values[
        [s.name for s in observer.parameter_signals].index("inductance_q")
        + len(values)
        - len(observer.parameter_signals)
    ] = 0.02
    p, n = observer.unpack_parameters(values), observer.order
    assert p.inductance_q == 0.02
    at, reported = np.array([0.7, 1.3, 90.0, 0.6, 0.03])[:n], drawn_inputs(observer)[7]
    u = observer.unpack_inputs(reported)
    step = exact_jacobian(lambda x, _: observer.predict(x, u, p)[0], n, 1)
    np.testing.assert_allclose(observer.predict(at, u, p)[1], step(at, np.zeros(1)), rtol=1e-12, atol=1e-15)
    seen = exact_jacobian(lambda x, _: observer.measure(x, u, p)[0], n, 1)
    np.testing.assert_allclose(observer.measure(at, u, p)[1], -seen(at, np.zeros(1)), rtol=1e-12, atol=1e-15)


def test_the_printed_jacobian_has_three_misprints() -> None:
    exact, printed = (MotorEkf(jacobian=name) for name in ("exact", "as_published"))  # type: ignore[arg-type]
    p, at = parameters(exact), np.array([0.7, 1.3, 90.0, 0.6])
    u = exact.unpack_inputs(exact.start_inputs())
    difference = np.asarray(printed.predict(at, u, p)[1]) - np.asarray(exact.predict(at, u, p)[1])
    assert difference[0, 2] == pytest.approx(T * 2.0 * (0.7 - 1.3))  # x1 in place of x2
    assert difference[1, 2] == pytest.approx(T * 2.0 * 2.0 * 0.7)  # plus in place of minus
    assert np.count_nonzero(difference) == 2  # the third does nothing where L_d = L_q
    with pytest.raises(ValueError, match="unknown jacobian 'wrong'; choose one of: exact, as_published"):
        MotorEkf(jacobian="wrong")  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("observer", "rank", "at_rest"),
    [
        (MotorEkf(), 3, 3),
        (MotorEkf(frame="stator"), 3, 3),
        (MotorEkfStator(), 4, 3),
        (MotorEkfStator(load="estimated"), 5, 4),
    ],
)
def test_what_is_observable(observer: MotorFilter, rank: int, at_rest: int) -> None:
    moving, still = (
        own_condition(observer),
        observer.condition_of(observer.unpack_parameters(observer.start_parameters()), 0.0, 0.0),
    )
    assert (moving.numbers["rank"], still.numbers["rank"]) == (rank, at_rest)
    assert moving.holds == (rank == observer.order)
    assert moving.numbers["smallest_singular_value"] > 0.0 or not moving.holds
    with pytest.raises(ValueError, match="unknown parameter 'mass'"):
        own_condition(observer, {"mass": 1.0})


def test_the_angle_of_the_printed_filter_is_its_speed_added_up() -> None:
    """And its variance grows for ever."""
    observer = MotorEkf()
    rows = run(observer, drawn_inputs(observer))
    n = observer.order
    variance = rows[:, n + 15]
    assert (np.diff(variance) > 0.0).all()
    reported = [s.name for s in observer.outputs]
    assert reported[:4] == ["current_d", "current_q", "speed", "angle"]
    assert {"speed_std", "innovation_d", "innovation_q", "nis"} < set(reported)


def test_a_filter_of_turned_currents_is_the_printed_one_at_its_own_angle() -> None:
    """Fed with what its own angle makes of rotor quantities, it computes what the printed filter computes."""
    rotor, stator = MotorEkf(), MotorEkf(frame="stator")
    inputs = drawn_inputs(rotor)
    one, other = Runtime(rotor), Runtime(stator)
    one.u[:] = other.u[:] = inputs[0]
    one.start(0.0)
    other.start(0.0)
    for k in range(1, 50):
        one.u[:] = inputs[k]
        before = one.x[3]
        one.advance(k * T)
        # the angle is predicted without the currents, and corrected by their innovation afterwards
        predicted = before + T * 2.0 * other.x[2]
        other.u[:] = (*to_stator(*inputs[k, :2], before), inputs[k, 2], *to_stator(*inputs[k, 3:], predicted))
        other.advance(k * T)
        np.testing.assert_allclose(other.x[:4], one.x[:4], rtol=1e-9, atol=1e-9)


def test_rows_are_printed_rows() -> None:
    observer = MotorEkf()
    assert set(ROWS) < set(observer.presets)
    values = observer.preset_values("bbo_20")
    assert [values[f"process_variance[{i}]"] for i in range(1, 5)] == [0.0127, 0.0108, 0.6934, 0.5012]
    assert [values[f"measurement_variance[{i}]"] for i in (1, 2)] == [1.5007, 1.5733]
