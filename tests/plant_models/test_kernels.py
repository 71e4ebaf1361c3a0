"""One definition, three lives: traced kernel, NumPy kernel and batch give the same numbers."""

from __future__ import annotations

import numpy as np
import pytest
from railway_runs import started
from toy_systems import Booster, Clockwork, ImplicitBooster, ImplicitClockwork, ImplicitSlider, Slider

from plant_models import Driver, Locomotive, Odometer
from plant_models.hybrid import HybridSystem, NumpyKernel, Runtime, TracedKernel, TracedSystem
from plant_models.hybrid.integration import step

SYSTEMS = [
    Clockwork(),
    ImplicitClockwork(),
    Slider(),
    ImplicitSlider(),
    Booster(),
    ImplicitBooster(),
    Locomotive(),
    Locomotive(adhesion="polach", zones="position", gradient_shape="linear"),
    Odometer(),
    Driver(),
]
ROUNDING = 1e-12  # the same operations in another order: a few hundred roundings of 1.1e-16 each


def _state_in_motion(system: HybridSystem, rng: np.random.Generator) -> np.ndarray:
    return system.start_state() + rng.uniform(0.1, 3.0, system.state_count)


def _inputs_in_use(system: HybridSystem, rng: np.random.Generator) -> np.ndarray:
    scale = 5e4 if isinstance(system, Locomotive) else 2.0
    return system.start_inputs() + scale * rng.uniform(-1.0, 1.0, len(system.start_inputs()))


@pytest.mark.parametrize("system", SYSTEMS, ids=lambda s: f"{s.name}-{s.method}")
def test_traced_and_numpy_kernels_agree_to_rounding(system: HybridSystem) -> None:
    rng = np.random.default_rng(3)
    kernels = (TracedKernel(system), NumpyKernel(system))
    for _ in range(5):
        x, u = _state_in_motion(system, rng), _inputs_in_use(system, rng)
        results = []
        for kernel in kernels:
            kernel.x[:], kernel.u[:] = x, u
            kernel.step(12.3, system.internal_step)
            kernel.grid_steps(0.0, 9995, 12, system.internal_step)
            for event in system.events:
                kernel.jump(event.name, 12.4)
            kernel.output(12.4)
            results.append(np.concatenate([kernel.x, kernel.y]))
        # A stiff step solves with a matrix of condition up to 1e3: its rounding is larger by that.
        tolerance = ROUNDING * (1e3 if system.method == "rosenbrock" else 1.0)
        np.testing.assert_allclose(results[0], results[1], rtol=tolerance, atol=tolerance)


@pytest.mark.parametrize("system", SYSTEMS, ids=lambda s: f"{s.name}-{s.method}")
def test_a_batch_is_its_members(system: HybridSystem) -> None:
    rng = np.random.default_rng(4)
    members = 5
    x = np.stack([_state_in_motion(system, rng) for _ in range(members)], axis=1)
    x[: len(x) // 2, 0] = 0.0  # one member with something at rest
    u = np.stack([_inputs_in_use(system, rng) for _ in range(members)], axis=1)
    p = np.stack([system.start_parameters() * f for f in np.linspace(1.0, 1.2, members)], axis=1)
    functions = {
        "flow": system.state_derivative,
        "output": system.output_vector,
        "friction": system.friction_vector,
        **{e.name: lambda t, x, u, p, e=e: system.jump_vector(e.name, t, x, u, p) for e in system.events},
    }
    if not system.frictions:
        del functions["friction"]
    if system.method == "rk4":
        functions["step"] = lambda t, x, u, p: step(system, t, 0.01, x, u, p)
    for name, function in functions.items():
        together = function(15.0, x, u, p)
        alone = np.stack([function(15.0, x[:, i], u[:, i], p[:, i]) for i in range(members)], axis=1)
        assert together.shape == alone.shape, name
        # NumPy's vectorised exp and tanh may differ from the scalar ones in the last place.
        np.testing.assert_allclose(together, alone, rtol=1e-13, atol=1e-13, err_msg=name)


def test_a_runtime_takes_either_kernel_and_runs_equally() -> None:
    system = Clockwork()
    runs = []
    for kernel in (TracedKernel(system), NumpyKernel(system)):
        runtime = Runtime(system, kernel)
        runtime.start(0.0)
        runtime.advance(0.5)
        runtime.u[1] = 0.8
        runtime.trigger("kick")
        runtime.advance(1.234)
        runs.append(np.concatenate([runtime.x, runtime.update_outputs()]))
    np.testing.assert_allclose(runs[0], runs[1], rtol=ROUNDING, atol=ROUNDING)


def test_exact_jacobians_agree_with_differences() -> None:
    system = Locomotive()
    traced = TracedSystem(system)
    t, x, u, p = 1.0, np.array([3.0, 8.0, 14.2]), np.array([4e4]), started(system).p.copy()
    exact = np.asarray(traced.jacobian("flow", "x")(t, x, u, p))
    for column in range(3):
        d = np.zeros(3)
        d[column] = 1e-5
        central = (system.state_derivative(t, x + d, u, p) - system.state_derivative(t, x - d, u, p)) / 2e-5
        np.testing.assert_allclose(
            exact[:, column], central, rtol=1e-5, atol=1e-6
        )  # central differences: error 1e-10 x third derivative


def test_structural_dependencies_of_the_plants() -> None:
    loco = TracedSystem(Locomotive())
    assert not loco.dependencies("output", "u")[0, 0]  # position does not depend on the effort directly
    assert not TracedSystem(Driver()).dependencies("output", "u").any()  # the driver breaks the algebraic loop
