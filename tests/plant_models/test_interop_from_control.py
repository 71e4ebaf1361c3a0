"""python-control objects as hybrid systems: the same numbers to rounding, there and back."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from railway_runs import NO_ZONES, started
from scipy.linalg import expm
from toy_systems import Hyperbola

from plant_models import Locomotive
from plant_models.hybrid import HybridSystem, Runtime, vector
from plant_models.interop import from_nonlinear_io, from_state_space, to_nonlinear_io, to_state_space

RADIUS = 0.575
LAG = control.ss(
    [[-1.0, 2.0], [0.0, -3.0]],
    [[0.0], [1.0]],
    [[1.0, 0.0]],
    [[0.25]],
    name="lag",
    states=["slow", "fast"],
    inputs=["drive"],
    outputs=["level"],
)


def pendulum(_t: Any, x: Any, u: Any, params: Mapping[str, Any]) -> Any:
    return x[1], u[0] - params["stiffness"] * np.sin(x[0]) - 0.1 * x[1]


def array_pendulum(_t: Any, x: Any, u: Any, params: Mapping[str, Any]) -> Any:
    return np.array([x[1], u[0] - params["stiffness"] * np.sin(x[0]) - 0.1 * x[1]])


def make_pendulum(update: Any = pendulum) -> Any:
    return control.NonlinearIOSystem(
        update,
        lambda _t, x, _u, _params: [x[0]],
        name="pendulum",
        states=["angle", "rate"],
        inputs=["torque"],
        outputs=["angle"],
        params={"stiffness": 9.81, "label": "left"},
    )


def run(system: HybridSystem, until: float, u0: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    runtime = started(system, u0=[u0] * len(system.start_inputs()))
    runtime.advance(until)
    return runtime.x.copy(), runtime.update_outputs().copy()


# -- there and back -------------------------------------------------------------------------------------------------


@settings(max_examples=20)
@given(st.integers(0, 10**6), st.integers(1, 4), st.integers(1, 2), st.integers(1, 3))
def test_state_space_there_and_back_is_an_equal_system(seed: int, n: int, m: int, q: int) -> None:
    draw = np.random.default_rng(seed)
    A, B, C, D = (draw.normal(size=shape) for shape in ((n, n), (n, m), (q, n), (q, m)))
    back = to_state_space(from_state_space(control.StateSpace(A, B, C, D, 0)))
    for found, expected in zip((back.A, back.B, back.C, back.D), (A, B, C, D), strict=True):
        np.testing.assert_allclose(found, expected, rtol=1e-14, atol=0.0)


@pytest.mark.parametrize(
    ("system", "x0", "changes", "arguments"),
    [
        (Hyperbola(), [1.0], {}, {"internal_step": 0.1}),
        (Locomotive(), [0.0, 12.0, 12.0 / RADIUS], NO_ZONES, {"internal_step": 5e-4, "method": "rosenbrock"}),
    ],
    ids=["hyperbola", "locomotive"],
)
def test_a_hybrid_system_there_and_back_runs_equally(
    system: HybridSystem, x0: list[float], changes: dict[str, float], arguments: Any
) -> None:
    back = from_nonlinear_io(to_nonlinear_io(system, parameters=changes), x0, **arguments)
    assert back.traceable
    ours, copy = (started(s, x0=x0, u0=[3e4] * len(system.inputs), **c) for s, c in ((system, changes), (back, {})))
    for t in (1.0, 2.0):
        ours.advance(t)
        copy.advance(t)
        np.testing.assert_allclose(copy.x, ours.x, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(copy.update_outputs(), ours.update_outputs(), rtol=1e-12, atol=1e-7)  # forces, in N


# -- continuous -----------------------------------------------------------------------------------------------------


def test_a_linear_system_follows_the_matrix_exponential() -> None:
    system = from_state_space(LAG, {"slow": 2.0}, units={"drive": "N", "slow": "m"})
    assert [(s.name, s.unit) for s in (*system.states, *system.inputs)] == [
        ("slow", "m"),
        ("fast", "1"),
        ("drive", "N"),
    ]
    x, y = run(system, 1.5, u0=2.0)
    steady = -np.linalg.solve(LAG.A, LAG.B[:, 0] * 2.0)
    expected = steady + expm(LAG.A * 1.5) @ ([2.0, 0.0] - steady)
    np.testing.assert_allclose(x, expected, rtol=1e-11)  # RK4 at 1 ms: (3e-3)^4 over some 1/s
    assert y[0] == pytest.approx(expected[0] + 0.25 * 2.0, rel=1e-11)


def test_a_transfer_function_is_accepted() -> None:
    system = from_state_space(control.tf([1.0], [0.5, 1.0], name="first_order"))
    assert system.options == {}
    _, y = run(system, 1.0, u0=1.0)
    assert y[0] == pytest.approx(1.0 - np.exp(-2.0), rel=1e-9)


def test_a_gain_without_states_is_accepted() -> None:
    system = from_state_space(control.ss([], [], [], [[3.0]], name="gain"))
    assert run(system, 1.0, u0=2.0)[1][0] == 6.0


def test_nonlinear_functions_are_traced_where_they_can_be() -> None:
    traced, plain = (
        from_nonlinear_io(make_pendulum(), [1.0, 0.0]),
        from_nonlinear_io(make_pendulum(array_pendulum), [1.0, 0.0]),
    )
    assert (traced.traceable, plain.traceable) == (True, False)
    np.testing.assert_allclose(run(traced, 1.0, 0.5)[0], run(plain, 1.0, 0.5)[0], rtol=1e-12)
    times = np.linspace(0.0, 1.0, 11)
    response = control.input_output_response(
        make_pendulum(), times, np.full(11, 0.5), [1.0, 0.0], solve_ivp_kwargs={"rtol": 1e-10, "atol": 1e-12}
    )
    assert run(traced, 1.0, 0.5)[1][0] == pytest.approx(response.outputs[-1], abs=1e-8)


def test_numbers_in_params_become_parameters() -> None:
    system = from_nonlinear_io(make_pendulum(), units={"stiffness": "1/s2"})
    assert [(s.name, s.unit, s.start) for s in system.parameters] == [("stiffness", "1/s2", 9.81)]
    soft = started(system, x0=[0.1, 0.0], stiffness=0.0)
    soft.advance(1.0)
    assert soft.x[0] == 0.1
    # the output came first
    assert [s.name for s in (*system.states, *system.outputs)] == ["angle_state", "rate", "angle"]


def test_an_interconnected_system_runs_as_python() -> None:
    spring = control.ss([], [], [], [[-4.0]], inputs=["place"], outputs=["force"], name="spring")
    mass = control.ss(
        [[0, 1], [0, 0]], [[0], [1]], [[1, 0]], 0, inputs=["force"], outputs=["place"], name="mass", states=2
    )
    nonlinear = control.NonlinearIOSystem(
        lambda _t, x, u, _params: mass.A @ x + mass.B @ u,
        lambda _t, x, _u, _params: x[:1],
        states=["p", "v"],
        inputs=["force"],
        outputs=["place"],
        name="body",
    )
    system = from_nonlinear_io(control.interconnect([nonlinear, spring], outputs=["place"]), [1.0, 0.0])
    assert not system.traceable
    assert run(system, 1.0)[1][0] == pytest.approx(np.cos(2.0), abs=1e-9)


# -- sampled --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("nonlinear", [False, True])
def test_a_discrete_system_steps_as_python_control_does(nonlinear: bool) -> None:
    linear = control.ss([[0.9, 0.2], [-0.1, 0.8]], [[0.0], [1.0]], [[1.0, 0.0]], [[0.5]], 0.25, name="filter")
    draw = np.random.default_rng(7).normal(size=9)
    times = 0.25 * np.arange(9)
    if nonlinear:
        source = control.NonlinearIOSystem(
            lambda _t, x, u, _params: linear.A @ x + linear.B @ u,
            lambda _t, x, u, _params: linear.C @ x + linear.D @ u,
            states=2,
            inputs=1,
            outputs=1,
            dt=0.25,
            name="filter",
        )
        system = from_nonlinear_io(source, [1.0, -1.0])
    else:
        system = from_state_space(linear, [1.0, -1.0])
    assert system.traceable
    expected = control.forced_response(linear, times, draw, [1.0, -1.0]).outputs
    runtime = Runtime(system)
    found = []
    for k, t in enumerate(times):
        runtime.u[0] = draw[k]
        runtime.start(0.0) if k == 0 else runtime.advance(float(t))
        found.append(float(runtime.update_outputs()[0]))
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    runtime.u[0] = 99.0
    runtime.advance(2.1)
    assert runtime.update_outputs()[0] == found[-1]  # held until the next instant


def test_an_unspecified_period_must_be_stated() -> None:
    system = control.ss([[0.5]], [[1.0]], [[1.0]], 0, True, name="some")
    with pytest.raises(ValueError, match=r"some: its time base is discrete but unspecified .*give sample_period"):
        from_state_space(system)
    period = from_state_space(system, sample_period=0.2).parameters[0]
    assert (period.name, period.start) == ("sample_period", 0.2)


# -- names and refusals ---------------------------------------------------------------------------------------------


def test_names_become_legal_and_unique() -> None:
    system = from_state_space(
        control.ss([[-1.0]], [[1.0]], [[1.0]], 0, inputs=["lambda"], states=["1st"], outputs=["y[0]"], name="a b")
    )
    assert [s.name for s in (*system.states, *system.inputs, *system.outputs)] == ["v_1st", "v_lambda", "y_0"]
    assert system.name == "a_b"
    equal = from_state_space(
        control.ss([[-1.0]], [[1.0]], [[1.0]], 0, inputs=["v"], states=["v"], outputs=["v"], name="v")
    )
    assert [s.name for s in (*equal.inputs, *equal.outputs, *equal.states)] == ["v", "v_output", "v_state"]
    clash = from_nonlinear_io(
        control.NonlinearIOSystem(
            lambda _t, x, _u, params: vector(-params["seed"] * x[0]),
            None,
            states=["time"],
            outputs=["time"],
            inputs=[],
            params={"seed": 2.0},
            name="reserved",
        )
    )
    assert [s.name for s in (*clash.outputs, *clash.states, *clash.parameters)] == [
        "time_output",
        "time_state",
        "seed_parameter",
    ]
    assert run(clash, 1.0)[1][0] == 0.0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"x0": {"fats": 1.0}}, r"lag: state 'fats' is unknown; did you mean fast"),
        ({"x0": [1.0, 2.0, 3.0]}, r"lag: state: got 3 values, expected 2: slow, fast"),
        ({"units": {"pressure": "Pa"}}, r"lag: signal 'pressure' is unknown"),
        ({"sample_period": 0.1}, r"lag: it is continuous, so a sample_period"),
    ],
)
def test_wrong_arguments_are_named(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        from_state_space(LAG, **arguments)


def test_a_system_of_unknown_size_and_a_method_without_jacobian_are_refused() -> None:
    with pytest.raises(ValueError, match=r"its nstates is not known; give states"):
        from_nonlinear_io(control.NonlinearIOSystem(pendulum, name="bare"))
    with pytest.raises(ValueError, match=r"'rosenbrock' needs functions that can be traced"):
        from_nonlinear_io(make_pendulum(array_pendulum), method="rosenbrock")
