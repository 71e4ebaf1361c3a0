"""Unknown-input observers: errors that do not feel the unknown inputs, the printed gains, and what they refuse."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from own_condition import own_condition
from scipy.integrate import solve_ivp
from scipy.linalg import eigvals, expm

from fmu_observer.design.decoupling import decoupled_gain, decoupling, decoupling_condition
from fmu_observer.design.extended_disturbance import decaying_gain, extended_gain, extended_matrices
from fmu_observer.models.exhibits.pendulum_model import pendulum
from fmu_observer.models.known_models import MODELS
from fmu_observer.models.observer_model import ObserverModel
from fmu_observer.models.train.braked_train_model import braked_train
from fmu_observer.models.train.coupled_vehicles_model import coupled_vehicles
from fmu_observer.observability import UnobservableError
from fmu_observer.observers.generic.continuous import DecouplingUio, Luenberger, ProportionalIntegralUio
from plant_models.hybrid import Runtime, input_signal, scalar_names, state

EXACT = 1e-9  # the solver works at 1e-12, over stiff couplers and disturbances that jump
PIECE = 0.25  # [s] for which a random input stays


def plain(A: Any, H: Any, C: Any) -> ObserverModel:
    """A model of matrices without known inputs."""
    A, H, C = (np.asarray(matrix, dtype=float) for matrix in (A, H, C))
    return ObserverModel(
        "plain",
        "Matrices",
        "test",
        tuple(state(f"x{i}", "1", 0.0, "State") for i in range(len(A))),
        (),
        tuple(input_signal(f"y{i}", "1", 0.0, "Measured") for i in range(len(C))),
        A,
        np.zeros((len(A), 0)),
        C,
        unknown_inputs=tuple(input_signal(f"d{i}", "1", 0.0, "Unknown") for i in range(H.shape[1])),
        H=H,
    )


def together(observer: Any, times: list[float], disturbance: Any, preset: str | None = None) -> tuple[Any, Any, Any]:
    """Plant states, observer states and observer outputs at the times; the disturbance is a function of time."""
    model, n = observer.model, observer.model.order
    p = observer.start_parameters(preset)

    def inputs(t: float, x: np.ndarray) -> np.ndarray:
        return np.concatenate([known(model, t), model.measured(x[:n])])

    def flow(t: float, x: np.ndarray) -> np.ndarray:
        moved = model.flow(x[:n], known(model, t)) + model.H @ disturbance(t)
        return np.concatenate([moved, observer.state_derivative(t, x[n:], inputs(t, x), p)])

    start = np.array([float(s.start_values[0]) for s in model.states]) + 0.3 * (1.0 + np.arange(n))
    rows, x, begin = [], np.concatenate([start, observer.start_state(preset)]), 0.0
    for end in times:
        for left in np.arange(begin, end - 1e-9, PIECE):  # the solver does not step over a jump of the disturbance
            part = solve_ivp(flow, (left, min(left + PIECE, end)), x, method="DOP853", rtol=1e-12, atol=1e-13)
            x = part.y[:, -1]
        begin = end
        reported = observer.output_vector(end, x[n:], inputs(end - 1e-9, x), p)
        rows.append((x[:n], x[n:], dict(zip(scalar_names(observer.outputs), reported, strict=True))))
    return tuple(zip(*rows, strict=True))  # type: ignore[return-value]


def known(model: ObserverModel, t: float) -> np.ndarray:
    return 1e3 * np.sin(t + np.arange(len(model.inputs)))


def jumping(width: int, seed: int, size: float = 20.0) -> Any:
    """A disturbance that jumps to another random value four times a second."""
    values = size * np.random.default_rng(seed).normal(size=(200, width))
    return lambda t: values[int((t + 1e-12) / PIECE)]


def estimates(model: ObserverModel, outputs: Any) -> np.ndarray:
    return np.array([[float(found[s.name]) for s in model.states] for found in outputs])


# -- decoupling -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("model", ["coupled_vehicles", "braked_train"])
def test_the_error_does_not_feel_the_unknown_input(model: str) -> None:
    """Whatever jumps there, the error is ``exp(N t)`` of the first one."""
    observer = DecouplingUio(model)
    times = [0.5, 1.0]
    plant, _, outputs = together(observer, times, jumping(1, 0))
    start = np.array([float(s.start_values[0]) for s in observer.model.states])
    first = decoupling(observer.model.A, observer.model.H, observer.model.C).P @ (
        -0.3 * (1.0 + np.arange(observer.model.order))
    )
    N = observer.matrices()["N"]
    exact = np.array([expm(N * t) @ first for t in times])
    error = estimates(observer.model, outputs) - np.array(plant)
    np.testing.assert_allclose(error, exact, atol=EXACT * (1.0 + np.abs(start).max()))
    assert np.abs(plant[-1] - start).max() > 1.0  # the plant did feel it


def test_the_printed_form_is_an_equal_observer() -> None:
    """``dz = N z + G u + L y`` of (2.12), with random numbers."""
    observer, generator = DecouplingUio(), np.random.default_rng(3)
    x, u, y = generator.normal(size=3), generator.normal(size=1), generator.normal(size=2)
    p = observer.start_parameters()
    matrices = observer.matrices(observer.unpack_parameters(p))
    printed = matrices["N"] @ x + matrices["G"] @ u + matrices["L"] @ y
    found = observer.state_derivative(0.0, x, np.concatenate([u, y]), p)
    np.testing.assert_allclose(found, printed, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(matrices["G"] - (np.eye(3) + matrices["M"] @ observer.model.C) @ observer.model.B, 0.0)
    np.testing.assert_allclose(np.sort(np.linalg.eigvals(matrices["N"]).real), [-3.0, -2.5, -2.0], rtol=1e-9)


def rosenbrock_drop(A: np.ndarray, H: np.ndarray, C: np.ndarray, s: complex) -> float:
    """Smallest singular value of ``[[s I - A, -H], [C, 0]]``: zero at an invariant zero."""
    zero = np.zeros((len(C), H.shape[1]))
    return float(np.linalg.svd(np.block([[s * np.eye(len(A)) - A, -H], [C, zero]]), compute_uv=False)[-1])


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10_000), st.integers(2, 5))
def test_invariant_zeros_are_those_of_the_pencil(seed: int, n: int) -> None:
    """One measurement, one unknown input: the n - 1 finite generalised eigenvalues of the Rosenbrock pencil."""
    generator = np.random.default_rng(seed)
    A, H, C = generator.normal(size=(n, n)), generator.normal(size=(n, 1)), generator.normal(size=(1, n))
    if abs(float((C @ H)[0, 0])) < 0.05:  # the zeros leave towards infinity
        return
    found = decoupling(A, H, C).fixed
    left = np.block([[A, H], [C, np.zeros((1, 1))]])
    pencil = eigvals(left, np.diag([1.0] * n + [0.0]))
    finite = sorted(pencil[np.isfinite(pencil)], key=abs)[: n - 1]
    size = 1.0 + max(map(abs, finite))
    assert len(found) == n - 1
    for value in found:
        assert min(abs(value - other) for other in finite) < 1e-6 * size
        assert rosenbrock_drop(A, H, C, value) < 1e-6 * size


def test_a_zero_that_decays_stays_a_pole() -> None:
    """With the locomotive's speed alone the wagon on its coupler is that zero; the gain moves what is left."""
    model = coupled_vehicles()
    alone = replace(model, measurements=model.measurements[:1], C=model.C[:1])
    condition = decoupling_condition(alone)
    wagon = np.roots([1.0, 5e4 / 60e3 + 2e-3, 2.5e6 / 60e3])  # m2 v2' = K e + D (v1 - v2) - r m2 v2, e' = -v2
    assert condition.holds
    assert condition.numbers["invariant_zeros"] == 2
    assert condition.numbers["rightmost_zero"] == pytest.approx(wagon.real.max(), rel=1e-9)
    observer = DecouplingUio(alone)
    found = np.linalg.eigvals(observer.matrices()["N"])
    np.testing.assert_allclose(sorted(found, key=lambda s: s.imag)[::2], sorted(wagon, key=lambda s: s.imag), rtol=1e-9)
    assert np.abs(found + 2.0).min() < 1e-9
    with pytest.raises(ValueError, match="got 0 poles, expected 1, one for each mode to place"):
        decoupled_gain(alone, [])


def test_what_cannot_be_decoupled_is_refused_in_words() -> None:
    train = plain([[0.0, 1.0], [0.0, -0.1]], [[0.0], [1.0]], [[0.0, 1.0]])  # position and speed, the speed measured
    values = decoupling_condition(train).numbers
    assert (values["rank_CH"], values["rank_H"], values["rightmost_zero"]) == (1, 1, 0.0)
    assert not decoupling_condition(train).holds
    with pytest.raises(UnobservableError, match=r"free of its unknown inputs: .*offset that stays.*states x0 \(1\)"):
        DecouplingUio(train)
    hidden = plain([[0.0, 1.0], [0.0, -0.1]], [[0.0], [1.0]], [[1.0, 0.0]])  # the position measured: d shows later
    assert decoupling_condition(hidden).numbers == {"rank_CH": 0, "rank_H": 1}
    with pytest.raises(
        ValueError, match=r"measurements \(y0\) do not show .* unknown input \(d0\) at once: rank\(C H\)"
    ):
        DecouplingUio(hidden)
    ProportionalIntegralUio(hidden)  # which it says to use
    two = plain(np.diag([-1.0, -2.0]), np.eye(2), [[1.0, 1.0]])
    with pytest.raises(ValueError, match=r"rank\(C H\) = 1, expected rank\(H\) = 2"):
        DecouplingUio(two)


@pytest.mark.parametrize("kind", [DecouplingUio, ProportionalIntegralUio])
@pytest.mark.parametrize("name", MODELS)
def test_any_model_is_taken_or_refused_in_words(kind: Any, name: str) -> None:
    """Refused is what cannot be: no unknown input acts, or the measurements do not show it at once."""
    model = MODELS[name]()
    H = model.H if model.unknown_inputs else model.B
    if not np.any(H):
        with pytest.raises(ValueError, match=f"'{name}' declares no unknown inputs, and has no matrix B"):
            kind(name)
        return
    if kind is DecouplingUio and np.linalg.matrix_rank(model.C @ H) < np.linalg.matrix_rank(H):
        with pytest.raises(ValueError, match=f"'{name}': the measurements .* do not show every unknown input"):
            kind(name)
        return
    found = own_condition(kind(name))
    assert found.holds or name == "flexible_joint_arm_as_printed"  # printed with a sign that makes it unstable
    assert found.numbers["abscissa"] < 0.0 or not found.holds


def test_unknown_inputs_that_are_not_declared_are_errors_of_the_known_ones() -> None:
    """A pendulum under a torque of 0.3 N m that nobody tells of: found by the observer, phi and all."""
    observer = ProportionalIntegralUio("pendulum", rho=1)
    assert [s.name for s in observer.model.unknown_inputs] == ["torque_error"]
    assert own_condition(observer).holds
    truth = pendulum()
    runtime = Runtime(observer)
    names = scalar_names(observer.input_signals)
    x, u, step = np.array([0.3, 0.0]), np.zeros(len(truth.inputs)), 1e-3
    runtime.u[names.index("measured_angle")] = x[0]
    runtime.start(0.0)
    for k in range(1, 20_001):
        reported = u + 0.3
        middle = x + 0.5 * step * np.asarray(truth.flow(x, reported))
        x = x + step * np.asarray(truth.flow(middle, reported))
        runtime.u[names.index("measured_angle")] = x[0]
        runtime.advance(k * step)
    found = dict(zip(scalar_names(observer.outputs), runtime.update_outputs(), strict=True))
    # the angle is held for a step of 1 ms, at up to 2 rad/s
    assert found["torque_error"] == pytest.approx(0.3, abs=0.02)
    assert found["angle"] == pytest.approx(x[0], abs=2e-3)


# masses [kg], slope of the resistance [1/s], force per effort: a railcar, a freight train, a train per unit mass
TRAINS = [(40e3, 0.008, 1.0), (2000e3, 0.001, 0.9), (1.0, 0.1, 0.1)]


@pytest.mark.parametrize(("mass", "drag", "effort"), TRAINS)
@pytest.mark.parametrize("kind", [DecouplingUio, ProportionalIntegralUio])
def test_any_train_is_observed(kind: Any, mass: float, drag: float, effort: float) -> None:
    """An effort of 0.5 m/s2 and an unknown deceleration of 0.2: the estimate is that of the closed form."""
    observer = kind("braked_train", mass=mass, drag=drag, effort=effort)
    assert own_condition(observer).holds
    names = scalar_names(observer.input_signals)
    runtime = Runtime(observer)
    terminal = 0.3 / drag

    def speed(t: float) -> float:
        return terminal + (30.0 - terminal) * np.exp(-drag * t)

    runtime.u[names.index("effort")] = 0.5 * mass / effort
    runtime.u[names.index("measured_speed")] = 30.0
    runtime.start(0.0)
    for k in range(1, 2001):
        runtime.u[names.index("measured_speed")] = speed(0.01 * k - 0.005)
        runtime.advance(0.01 * k)
    found = dict(zip(scalar_names(observer.outputs), runtime.update_outputs(), strict=True))
    # the reading is that of the middle of the last step: 5 ms at less than 3 m/s2
    assert found["speed"] == pytest.approx(speed(20.0), abs=0.015)
    if "disturbance" in found:
        assert found["disturbance"] == pytest.approx(-0.2, abs=2e-3)


def test_numbers_that_a_model_does_not_have_are_refused() -> None:
    with pytest.raises(ValueError, match=r"'pendulum' has no number 'mass': its numbers are fixed"):
        ProportionalIntegralUio("pendulum", mass=3.0)
    with pytest.raises(ValueError, match=r"'braked_train' has no number 'stiffness': it is made of mass, drag, effort"):
        DecouplingUio("braked_train", stiffness=3.0)
    with pytest.raises(ValueError, match=r"mass = 0.0 kg, expected a mass above zero"):
        DecouplingUio("braked_train", mass=0.0)
    with pytest.raises(ValueError, match=r"drag = nan"):
        DecouplingUio("braked_train", drag=float("nan"))
    with pytest.raises(ValueError, match=r"with numbers of its own; mass belongs to a model by name"):
        DecouplingUio(braked_train(), mass=3.0)


def test_the_preset_is_that_of_the_train_of_the_thesis() -> None:
    assert "as_published" in ProportionalIntegralUio().presets
    assert not ProportionalIntegralUio(mass=90e3).presets


def test_the_condition_sees_a_gain_that_does_not_stabilise() -> None:
    assert own_condition(DecouplingUio()).holds
    found = own_condition(DecouplingUio(), {"gain": np.zeros(6)})
    assert not found.holds
    assert found.numbers["rank_CH"] == 1
    assert not own_condition(ProportionalIntegralUio(), {"gain": [0.0, 0.0, -1.0]}).holds


# -- proportional-integral --------------------------------------------------------------------------------------------


def test_the_printed_gain_and_its_poles() -> None:
    """3.2.3.1: K = [101.4, 2650, 3750] for poles at -50, -50 and -1.5 1/s."""
    gain = extended_gain([[-0.1]], [[1.0]], [[1.0]], 2, [-50.0, -50.0, -1.5])  # type: ignore[arg-type]
    np.testing.assert_allclose(gain[:, 0], [101.4, 2650.0, 3750.0], rtol=1e-12)
    observer = ProportionalIntegralUio()
    p = observer.unpack_parameters(observer.start_parameters("as_published"))
    np.testing.assert_allclose(p.gain, gain[:, 0], rtol=1e-12)
    closed = observer.A_e - np.reshape(p.gain, (3, 1)) @ observer.C_e
    np.testing.assert_allclose(np.poly(closed), [1.0, 101.5, 2650.0, 3750.0], rtol=1e-9)
    assert own_condition(observer, preset="as_published").numbers["abscissa"] == pytest.approx(-1.5, rel=1e-9)
    np.testing.assert_array_equal(observer.start_state("as_published"), [30.0, -0.91, 0.13])


@pytest.mark.parametrize("model", ["braked_train", "coupled_vehicles"])
def test_a_ramp_is_estimated_exactly(model: str) -> None:
    """d'' = 0, so the error is ``exp((A_e - L C_e) t)`` of the first one."""
    observer = ProportionalIntegralUio(model, rho=2)
    times = [1.0, 4.0]
    plant, states, outputs = together(observer, times, lambda t: np.array([0.4 - 0.2 * t]))
    truth = np.array([[*x, 0.4 - 0.2 * t, -0.2] for x, t in zip(plant, times, strict=True)])
    n, order = observer.model.order, len(observer.A_e)
    L = observer.start_parameters()[: order * (order - 2 if model == "braked_train" else 2)]
    closed = observer.A_e - L.reshape(order, -1) @ observer.C_e
    first = np.concatenate([-0.3 * (1.0 + np.arange(n)), [-0.4, 0.2]])
    exact = np.array([expm(closed * t) @ first for t in times])
    np.testing.assert_allclose(np.array(states) - truth, exact, atol=1e-7 * 30.0)
    name = observer.model.unknown_inputs[0].name
    assert float(outputs[1][name]) == pytest.approx(truth[1, n], abs=2e-2)
    assert float(outputs[1][f"{name}_rate"]) == pytest.approx(-0.2, abs=5e-2)


def test_one_disturbance_state_lags_behind_a_ramp_by_its_slope() -> None:
    """rho = 1: the steady error solves ``(A_e - L C_e) e = [0; d']``; with poles p1, p2 that of d is ``d' (p1 + p2) /
    (p1 p2)``, of v ``-d' / (p1 p2)``."""
    observer = ProportionalIntegralUio("braked_train", rho=1)
    plant, states, outputs = together(observer, [12.0], lambda t: np.array([0.5 * t]))
    assert states[0][1] - 6.0 == pytest.approx(-0.5 * 4.5 / 5.0, rel=1e-8)
    assert float(outputs[0]["residual_speed"]) == pytest.approx(plant[0][0] - states[0][0], abs=1e-12)
    assert float(outputs[0]["residual_speed"]) == pytest.approx(0.5 / 5.0, rel=1e-8)


def test_a_zero_at_the_origin_hides_a_constant_disturbance() -> None:
    """The measured state is the derivative of the one on which d acts: a constant d does not show."""
    blind = plain([[-1.0, 0.0], [-1.0, -2.0]], [[1.0], [1.0]], [[0.0, 1.0]])
    assert rosenbrock_drop(blind.A, np.asarray(blind.H), blind.C, 0.0) < 1e-12
    with pytest.raises(UnobservableError, match=r"plain: .*offset that stays.*d0"):
        ProportionalIntegralUio(blind, rho=1)


@pytest.mark.parametrize(
    ("rho", "message"),
    [(0, "rho must be at least 1"), (4, "rho must be at most 3"), (1.5, "a whole number, got 1.5"), (True, "got True")],
)
def test_a_number_of_disturbance_states_that_cannot_be(rho: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        ProportionalIntegralUio(rho=rho)


def test_matrices_that_do_not_fit_are_refused() -> None:
    with pytest.raises(ValueError, match=r"A \(2, 2\), H \(1, 1\) and C \(1, 2\) do not fit"):
        extended_matrices(np.eye(2), np.eye(1), np.eye(2)[:1], 2)


@settings(max_examples=12, deadline=None)
@given(st.integers(0, 10_000), st.floats(0.0, 3.0))
def test_a_quadratic_lyapunov_function_gives_the_decay(seed: int, decay: float) -> None:
    generator = np.random.default_rng(seed)
    A, C = generator.normal(size=(3, 3)), generator.normal(size=(2, 3))
    L = decaying_gain(A, C, decay)
    assert np.linalg.eigvals(A - L @ C).real.max() < -decay


def test_three_disturbance_states_have_names_and_units() -> None:
    observer = ProportionalIntegralUio("coupled_vehicles", rho=3)
    found = {s.name: s.unit for s in observer.outputs}
    assert found["acceleration_error_rate"] == "m/s3"
    assert found["acceleration_error_second_rate"] == "m/s4"
    pushed = replace(braked_train(), unknown_inputs=(input_signal("push", "N"),))
    assert {s.name: s.unit for s in ProportionalIntegralUio(pushed, rho=3).outputs}["push_second_rate"] == "N/s2"
    assert "as_published" not in observer.presets
    assert own_condition(observer).numbers["rank"] == 6


def test_residuals_are_weighted() -> None:
    observer = ProportionalIntegralUio("coupled_vehicles", rho=1)
    p = observer.unpack_parameters(observer.start_parameters())
    u = observer.unpack_inputs(np.array([0.0, 10.5, 9.0]))
    x = observer.unpack_states(observer.start_state())
    found = observer.output(0.0, x, u, p._replace(residual_gain=np.array([2.0, 1.0, 0.0, -1.0])))
    assert (found["residual_speed"], found["residual_wagon_speed"]) == (2.0 * 0.5 - 1.0, 1.0)


def test_other_observers_leave_unknown_inputs_out() -> None:
    assert own_condition(Luenberger(braked_train())).holds
    assert [s.name for s in Luenberger(coupled_vehicles()).inputs] == [
        "effort",
        "measured_speed",
        "measured_wagon_speed",
    ]
